// A record replays to the same bits, and a file that is no record is refused.
#include "programs/player/record.h"

#include <algorithm>
#include <regex>

#include "formats/bundle_reader.h"
#include "formats/scene_config.h"
#include "tests/programs/player/played_scene.h"
#include "tests/support/texts.h"

namespace palpate::tests {
namespace {

using testing::HasSubstr;

// A disc that comes down, is drawn aside and slips, and a clamp that starts late; capsules and grips are evaluated once.
const std::string kTools =
    "[[tool]]\nname = \"probe \\\"1\\\"\"\npoints = [[0, 0, 0]]\ndisc_radius = 4\nfriction = 0.3\n"
    "path = [[0, 41, 26, 44], [0.05, 41, 26, 36], [0.1, 44.7, 29, 36.1]]\n"
    "[[tool]]\nname = \"rod\"\nhold = true\ncapsule = { radius = 3, length = 20, axis = [0.1, 1, 0], samples = 5 }\n"
    "path = [[0, 20, 15, 47], [0.1, 20, 15, 41]]\naway = [[0, 0.01], [0.06, 0.08]]\n"
    "[[tool]]\nname = \"clamp\"\npath = [[0.03, 60, 50, 40], [0.08, 61, 52, 40]]\n"
    "[[tool.grip]]\nbox = { min = [59, 49, -1], max = [61, 51, 41] }\naxes = \"xy\"\n";
const std::string kEffects =
    "[effects]\ncollision = \"deformed\"\nlaw = \"coulomb\"\nshape = \"volume\"\n"
    "[relaxation]\nterms = [[0.45, 0.5], [0.365, 50]]\nsource = \"1997\"\n[rate]\ntouch = 700\nshape = 50\n";

class Recorded : public PlayedScene {
 protected:
  void SetUp() override {
    PlayedScene::SetUp();
    write_scene(kTools, kEffects);
    played("scene.toml -o out --record run.record");
    std::filesystem::remove_all(folder_ / "out");
  }
  std::string record() const { return file_bytes(folder_ / "run.record"); }
  void write_record_text(const std::string& text) const {
    std::ofstream(folder_ / "run.record", std::ios::binary) << text;
  }
};

TEST_F(Recorded, ReplaysToTheSameHashes) {
  const ProgramRun ended = played("--replay run.record");
  EXPECT_THAT(ended.out, HasSubstr("71 touches replayed"));
  played("scene.toml --replay run.record");
  played("--replay run.record --bundle box.h5");
}

TEST_F(Recorded, IsASceneThatGivesTheSameNumbersAndRecordsAsItself) {
  const std::string before = record();
  played("scene.toml -o one");
  played("run.record -o two --record again.record");
  for (const char* file : {"forces.csv", "contacts.csv"})
    EXPECT_EQ(file_bytes(folder_ / "one" / file), file_bytes(folder_ / "two" / file)) << file;
  // The record has points in place of the capsule and a node for each grip; the results and their checksums are the same.
  EXPECT_EQ(file_bytes(folder_ / "again.record"), before);
  std::size_t nonzero = 0;
  const std::string contacts = file_bytes(folder_ / "one/contacts.csv");
  for (const char c : contacts) nonzero += c == '\n';
  EXPECT_GT(nonzero, 100u);  // the run touches at all
}

TEST_F(Recorded, WithOtherNumbersDoesNotVerify) {
  // A correct file with another checksum of the results, as if this build computed other numbers.
  const Record said = read_record(folder_ / "run.record");
  const SceneConfig scene = read_scene_config(folder_ / "run.record");
  const Player player(scene, folder_ / "box.h5");
  write_record(folder_ / "run.record", player, folder_ / "box.h5", {said.output.contacts ^ 1, said.output.shapes});
  const ProgramRun ended = run("--replay run.record");
  EXPECT_EQ(ended.code, 3);
  EXPECT_THAT(ended.errors, HasSubstr("other numbers"));
}

TEST_F(Recorded, IsRefusedWithAnotherBundleOrScene) {
  const auto refused = [&](const std::string& arguments, const char* why) {
    const ProgramRun ended = run(arguments);
    EXPECT_EQ(ended.code, 2) << arguments << ended.out;
    EXPECT_THAT(ended.errors, HasSubstr(why));
    EXPECT_EQ(std::count(ended.errors.begin(), ended.errors.end(), '\n'), 1) << ended.errors;
  };
  TinyBox stiffer;
  stiffer.young *= 2;
  write_bundle(folder_ / "other.h5", tiny_bundle(stiffer));
  refused("--replay run.record --bundle other.h5", "expected the bundle that");
  refused("--replay run.record --bundle none.h5", "none.h5");
  const auto other_scene = [&](const char* from, const char* to, const char* key) {
    write_scene(std::regex_replace(kTools, std::regex(from), to), std::regex_replace(kEffects, std::regex(from), to));
    refused("scene.toml --replay run.record", key);
  };
  other_scene("deformed", "rest", "another \"effects\"");
  other_scene("0.365", "0.364", "another \"relaxation\"");
  other_scene("touch = 700", "touch = 701", "another \"rate\"");
  other_scene("36\\.1", "36.100000000000009", "another \"tool\"");
  write_scene(kTools, kEffects + "[limits]\nforce = 7\n");
  refused("scene.toml --replay run.record", "another \"limits\"");
  // A bundle whose bytes were changed after its index was written.
  std::string bytes = file_bytes(folder_ / "box.h5");
  formats::BundleIndex index;
  ASSERT_EQ(formats::read_bundle_index(bytes.data(), bytes.size(), &index, nullptr), formats::BundleStatus::ok);
  bytes[formats::find_section(index, formats::SectionId::force)->offset + 3] ^= 1;
  std::ofstream(folder_ / "box.h5", std::ios::binary) << bytes;
  EXPECT_EQ(run("--replay run.record").code, 2);
}

TEST_F(Recorded, CutOrChangedAnywhereIsRefused) {
  const std::string whole = record();
  const auto refused = [&](const std::string& text) {
    write_record_text(text);
    const std::string said = tests::input_error([&] { read_record(folder_ / "run.record"); });
    return said.find("run.record: expected") != std::string::npos;
  };
  for (std::size_t bytes = 0; bytes < whole.size(); bytes += bytes < 140 ? 1 : 997)
    EXPECT_TRUE(refused(whole.substr(0, bytes))) << bytes;
  for (std::size_t at = 0; at < whole.size(); at += at < 140 ? 1 : 997)
    for (const int flip : {1, 0x20}) {
      std::string changed = whole;
      changed[at] = static_cast<char>(changed[at] ^ flip);
      EXPECT_TRUE(refused(changed)) << at;
    }
  EXPECT_TRUE(refused(whole + "\n"));
  write_record_text(whole.substr(0, whole.size() / 2));
  const ProgramRun ended = run("--replay run.record");
  EXPECT_EQ(ended.code, 2);
  EXPECT_EQ(std::count(ended.errors.begin(), ended.errors.end(), '\n'), 1) << ended.errors;
}

TEST_F(Recorded, TakesNoOptionThatItWouldIgnore) {
  for (const char* arguments : {"--replay run.record -o out", "--replay run.record --every 2",
                                "scene.toml --explain --record r", "scene.toml --realtime --record r", ""})
    EXPECT_EQ(run(arguments).code, 2) << arguments;
  EXPECT_EQ(run("scene.toml -o out --record nowhere/r").code, 2);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));  // refused before it was played
}

}  // namespace
}  // namespace palpate::tests
