// palpate-feel and palpate-draw as two processes, over the loopback.
#include <gmock/gmock.h>
#include <unistd.h>

#include <nlohmann/json.hpp>
#include <random>
#include <sstream>

#include "formats/bundle_reader.h"
#include "programs/link/sockets.h"
#include "tests/programs/link/linked_scene.h"
#include "tests/programs/link/process.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using tests::Process;

class TwoMachines : public tests::LinkedScene {
 protected:
  std::string file(const std::string& name) const { return (folder_ / name).string(); }

  Process start(const std::string& program, const std::string& name, std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), program);
    return Process(arguments, folder_ / (name + ".out"), folder_ / (name + ".err"));
  }

  nlohmann::json summary(const std::string& folder) const {
    return nlohmann::json::parse(tests::file_bytes(folder_ / folder / "summary.json"));
  }

  std::string last_shape(const std::string& folder) const {
    std::vector<fs::path> shapes;
    for (const auto& entry : fs::directory_iterator(folder_ / folder / "shapes"))
      if (entry.path().filename().string().rfind("organ", 0) == 0) shapes.push_back(entry.path());
    EXPECT_FALSE(shapes.empty());
    return shapes.empty() ? "" : tests::file_bytes(*std::max_element(shapes.begin(), shapes.end()));
  }

  // One process, every touch drawn, the first and the last shape written.
  void play_alone() {
    scene("alone", "[rate]\nshape = 1000\n");
    Process alone =
        start(PALPATE_RUN, "alone", {file("alone.toml"), "--every", "200", "--digits", "17", "-o", file("alone")});
    ASSERT_EQ(alone.wait(), 0) << alone.errors();
  }
};

TEST_F(TwoMachines, DrawTheLastShapeBitForBitAsOneDoes) {
  play_alone();
  scene();
  Process draw =
      start(PALPATE_DRAW, "draw", {file("scene.toml"), "--from", "0", "--seconds", "60", "-o", file("drawn")});
  Process feel =
      start(PALPATE_FEEL, "feel",
            {file("scene.toml"), "--to", draw.address(), "--every-step", "--digits", "17", "-o", file("felt")});
  EXPECT_EQ(feel.wait(), 0) << feel.errors();
  EXPECT_EQ(draw.wait(), 0) << draw.errors();
  EXPECT_EQ(last_shape("drawn"), last_shape("alone"));
  // What was felt is what one process feels, every step of it.
  EXPECT_EQ(tests::file_bytes(folder_ / "felt/forces.csv"), tests::file_bytes(folder_ / "alone/forces.csv"));
  EXPECT_EQ(tests::file_bytes(folder_ / "felt/contacts.csv"), tests::file_bytes(folder_ / "alone/contacts.csv"));
  const auto drawn = summary("drawn"), felt = summary("felt");
  EXPECT_TRUE(drawn["sender_said_goodbye"]);
  EXPECT_EQ(drawn["datagrams"]["sessions"], 1);
  EXPECT_EQ(felt["touch"]["steps"], 201);
  EXPECT_EQ(drawn["shapes"], drawn["shapes_written"]);
  EXPECT_THAT(feel.output(), HasSubstr("datagrams sent"));
  EXPECT_THAT(draw.output(), HasSubstr("age when drawn"));
}

TEST_F(TwoMachines, WarnOfTheStepFlagsThatWereRaised) {
  scene("weak", "[limits]\nforce = 1e-3\n");
  Process draw = start(PALPATE_DRAW, "draw",
                       {file("weak.toml"), "--from", "0", "--seconds", "60", "-o", file("drawn"), "--strict"});
  Process feel = start(PALPATE_FEEL, "feel",
                       {file("weak.toml"), "--to", draw.address(), "--every-step", "-o", file("felt"), "--strict"});
  EXPECT_EQ(feel.wait(), 3) << feel.errors();
  const std::string sentence = summary("felt")["warnings"].at(0);
  EXPECT_THAT(sentence, testing::ContainsRegex("^[0-9]+ of 201 touches raised FORCE_LIMITED: "));
  EXPECT_THAT(feel.errors(), HasSubstr("warning: " + sentence));
  EXPECT_EQ(draw.wait(), 0) << draw.errors();
  EXPECT_EQ(summary("drawn")["warnings"], nlohmann::json::array());
}

// This process stands between them: it loses, repeats and reorders, but lets the goodbye through.
TEST_F(TwoMachines, DrawTheSameLastShapeThroughABadNetwork) {
  play_alone();
  scene();
  Process draw =
      start(PALPATE_DRAW, "draw", {file("scene.toml"), "--from", "0", "--seconds", "60", "-o", file("drawn")});
  DatagramSender onward(resolve("test", draw.address(), SOCK_DGRAM));
  const Descriptor between = open_bound("test", resolve("test", "0", SOCK_DGRAM), SOCK_DGRAM);
  Process feel =
      start(PALPATE_FEEL, "feel", {file("scene.toml"), "--to", text_of(address_of(between.get())), "--every-step"});
  std::mt19937 random(5);
  tests::Bytes room(kMostDatagramBytes), kept;
  bool goodbye = false;
  for (int quiet = 0; quiet < 600 && !(goodbye && quiet > 0); ++quiet) {
    while (const auto count = receive(between.get(), 50, room)) {
      const tests::Bytes datagram(room.begin(), room.begin() + static_cast<std::ptrdiff_t>(*count));
      const bool last = datagram.size() > 72 && datagram[72] == 1;
      goodbye = goodbye || last;
      const unsigned chance = last ? 9 : random() % 10;
      if (chance < 3) continue;
      if (chance == 3 || chance == 4) kept = datagram;
      if (chance > 4) onward.send(datagram);
      if (chance == 5) onward.send(datagram);
      if (chance == 6 && !kept.empty()) onward.send(kept);
      quiet = -1;
    }
  }
  EXPECT_TRUE(goodbye);
  EXPECT_EQ(feel.wait(), 0) << feel.errors();
  EXPECT_EQ(draw.wait(), 0) << draw.errors();
  EXPECT_EQ(last_shape("drawn"), last_shape("alone"));
  EXPECT_GT(summary("drawn")["datagrams"]["lost"], 0);
}

TEST_F(TwoMachines, SayWhatTheyRefuseAndWhenNothingComes) {
  scene();
  Process draw =
      start(PALPATE_DRAW, "draw",
            {file("scene.toml"), "--from", "0", "--silence", "0.01", "--seconds", "60", "-o", file("drawn")});
  DatagramSender sender(resolve("test", draw.address(), SOCK_DGRAM));
  const std::string garbage(300, 'x');
  const auto bytes = std::span(reinterpret_cast<const unsigned char*>(garbage.data()), garbage.size());
  sender.send(bytes), sender.send(bytes), sender.send(bytes.first(0));
  for (int tries = 0; tries < 3000 && draw.errors().find("no contacts") == std::string::npos; ++tries) ::usleep(10000);
  Process feel = start(PALPATE_FEEL, "feel", {file("scene.toml"), "--to", draw.address()});
  EXPECT_EQ(feel.wait(), 0) << feel.errors();
  EXPECT_EQ(draw.wait(), 0) << draw.errors();
  EXPECT_THAT(draw.errors(), HasSubstr("no contacts for"));
  EXPECT_THAT(draw.errors(), HasSubstr("contacts come again"));
  EXPECT_THAT(draw.errors(), HasSubstr("a datagram was refused (magic)"));
  EXPECT_EQ(summary("drawn")["datagrams"]["refused"]["magic"], 2);
  EXPECT_EQ(summary("drawn")["datagrams"]["refused"]["size"], 1);
}

TEST_F(TwoMachines, WriteTheirReportsWhenTheyAreStopped) {
  scene();
  Process draw =
      start(PALPATE_DRAW, "draw", {file("scene.toml"), "--from", "0", "--seconds", "60", "-o", file("drawn")});
  draw.address();
  draw.stop();
  EXPECT_EQ(draw.wait(), 0) << draw.errors();
  EXPECT_EQ(summary("drawn")["shapes"], 0);
}

TEST_F(TwoMachines, RefuseBadUsageInOneSentence) {
  scene();
  scene("shapeless", "[effects]\nshape = \"off\"\n");
  scene("large", "[limits]\ncontact_nodes = 2000\n");
  const auto refused = [&](const std::string& program, const std::vector<std::string>& arguments,
                           const std::string& part) {
    Process process = start(program, "refused", arguments);
    EXPECT_EQ(process.wait(), 2) << part;
    EXPECT_THAT(process.errors(), HasSubstr(part));
    const std::string errors = process.errors();
    EXPECT_EQ(std::count(errors.begin(), errors.end(), '\n'), 1) << errors;
  };
  refused(PALPATE_FEEL, {file("scene.toml")}, "--to is required");
  refused(PALPATE_FEEL, {file("scene.toml"), "--to", "nowhere"}, "--to: expected PORT");
  refused(PALPATE_FEEL, {file("scene.toml"), "--to", "127.0.0.1:70000"}, "--to: expected PORT");
  refused(PALPATE_FEEL, {file("large.toml"), "--to", "9"}, "found 2000");
  scene("deformed", "[effects]\ndeformation = \"large\"\n");
  refused(PALPATE_FEEL, {file("deformed.toml"), "--to", "9"}, "effects.deformation: expected \"linear\"");
  refused(PALPATE_DRAW, {file("deformed.toml"), "--from", "0"}, "effects.deformation: expected \"linear\"");
  refused(PALPATE_DRAW, {file("shapeless.toml"), "--from", "0"}, "expected surface or volume");
  refused(PALPATE_DRAW, {file("scene.toml"), "--from", "192.0.2.1:0"}, "--from: 192.0.2.1:0");
  refused(PALPATE_DRAW, {file("absent.toml"), "--from", "0"}, "absent.toml");
}

// Where each section of the bundle lies in the file, and what this process has mapped of it.
class MappedSections : public tests::LinkedScene {
 protected:
  std::vector<std::string> mapped(Half half) {
    const Player player(scene("mapped", "[effects]\nshape = \"volume\"\n"), bundle(), half);
    std::ifstream file(bundle(), std::ios::binary);
    std::vector<char> head(formats::kUserBlockBytes);
    file.read(head.data(), static_cast<std::streamsize>(head.size()));
    formats::BundleIndex index;
    formats::BundleError error;
    EXPECT_EQ(formats::read_bundle_index(head.data(), fs::file_size(bundle()), &index, &error),
              formats::BundleStatus::ok);
    std::vector<std::string> names;
    for (std::uint32_t s = 0; s < index.header.section_count; ++s)
      if (is_mapped(index.entries[s].offset, index.entries[s].bytes))
        names.emplace_back(formats::describe_section(static_cast<formats::SectionId>(index.entries[s].id))->path);
    std::sort(names.begin(), names.end());
    return names;
  }

 private:
  // Sections begin on pages, so a mapping that overlaps one was made for it.
  bool is_mapped(std::uint64_t offset, std::uint64_t bytes) const {
    std::ifstream maps("/proc/self/maps");
    for (std::string line; std::getline(maps, line);) {
      if (line.find(bundle().string()) == std::string::npos) continue;
      std::uint64_t from = 0, to = 0, at = 0;
      std::string rights;
      char dash = 0;
      std::istringstream(line) >> std::hex >> from >> dash >> to >> rights >> at;
      if (at < offset + bytes && offset < at + (to - from)) return true;
    }
    return false;
  }
};

TEST_F(MappedSections, OfTheHalfThatFeelsHoldNoInteriorAndThoseOfTheHalfThatDrawsNoTriangles) {
  using testing::ElementsAre;
  EXPECT_THAT(mapped(Half::both), ElementsAre("mesh/nodes", "mesh/triangles", "tensors/displacement_interior",
                                              "tensors/displacement_surface", "tensors/force", "tensors/nodes"));
  EXPECT_THAT(mapped(Half::touch), ElementsAre("mesh/nodes", "mesh/triangles", "tensors/displacement_surface",
                                               "tensors/force", "tensors/nodes"));
  EXPECT_THAT(mapped(Half::shape), ElementsAre("mesh/nodes", "tensors/displacement_interior",
                                               "tensors/displacement_surface", "tensors/force", "tensors/nodes"));
}

}  // namespace
}  // namespace palpate
