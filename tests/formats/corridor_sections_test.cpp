// palpate-bundle on bundles with corridors: what it shows, checks, compares and keeps.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <regex>

#include "tests/formats/run_palpate_bundle.h"
#include "tests/support/box_corridor.h"

namespace palpate {
namespace {

using namespace formats;
using testing::HasSubstr;
using testing::Not;
using namespace tests;

constexpr SectionId kCorridor[] = {SectionId::corridor_nodes, SectionId::corridor_compliance,
                                   SectionId::corridor_surface, SectionId::corridor_interior,
                                   SectionId::corridor_residual};

// The box has the nodes 56 .. 63 inside it; of the corridor's, 58 is held along y.
const DenseBody& body() {
  static const DenseBody dense = [] {
    DenseBody made = dense_box({});
    made.fixed[3 * 58 + 1] = 1;
    return made;
  }();
  return dense;
}

const BundleParts& box() {
  static const BundleParts parts = [] {
    BundleParts made = dense_bundle(body());
    add_corridor(made, body(), {56, 58, 61, 63});
    return made;
  }();
  return parts;
}

std::string written(const BundleParts& parts, const char* name = "h5") {
  write_bundle(scratch(name), parts);
  return scratch(name).string();
}

template <class Number, class Change>
BundleParts changed(SectionId id, const Change& change) {
  BundleParts parts = box();
  auto numbers = parts.get<Number>(id);
  change(numbers);
  parts.set(id, parts.sections.at(id).shape, numbers);
  return parts;
}

TEST(CorridorSections, AreShownAndHold) {
  BundleParts parts = box();
  parts.provenance.replace(1, 0, R"("corridor biopsy":"capsule from here to there; 4 nodes",)");
  const std::string file = written(parts);
  const ProgramRun info = palpate_bundle("info " + file);
  EXPECT_THAT(info.out, HasSubstr("corridors   4 nodes, 9.9 kB; worst residual 1e-15\n"
                                  "            biopsy: capsule from here to there; 4 nodes\n"));
  EXPECT_THAT(info.out, HasSubstr("corridor/displacement_interior"));
  const auto json = nlohmann::json::parse(palpate_bundle("info --json " + file).out);
  EXPECT_EQ(json["counts"]["corridor"], 4);
  EXPECT_EQ(json["corridors"]["bytes"], 4 * 4 + 36 * 4 * (64 + 4) + 8 * 3 * 4);
  EXPECT_EQ(json["corridors"]["list"][0]["name"], "biopsy");
  const ProgramRun verified = palpate_bundle("verify " + file);
  EXPECT_EQ(verified.code, 0) << verified.out << verified.errors;
  EXPECT_THAT(verified.out, HasSubstr("ok       corridors            4 nodes, worst residual 1e-15"));
  EXPECT_THAT(verified.out, HasSubstr("ok       corridor reciprocity"));
  EXPECT_THAT(palpate_bundle("info " + written(tiny_bundle())).out, Not(HasSubstr("corridor")));
}

TEST(CorridorSections, ThatBreakALawAreFound) {
  const auto fault = [](const BundleParts& parts, const std::string& check, const std::string& sentence) {
    const ProgramRun ended = palpate_bundle("verify " + written(parts, "broken"));
    EXPECT_EQ(ended.code, 3) << ended.out;
    EXPECT_THAT(ended.errors, HasSubstr(check + " does not hold: ")) << ended.out;
    EXPECT_THAT(ended.errors, HasSubstr(sentence));
  };
  using Id = SectionId;
  const auto nan = [](auto& x) { x[x.size() / 2] = std::numeric_limits<float>::quiet_NaN(); };
  fault(changed<float>(Id::corridor_compliance, nan), "corridors", "nan");
  fault(changed<float>(Id::corridor_surface, nan), "corridors", "moves by nan");
  fault(changed<float>(Id::corridor_interior, nan), "corridors", "moves by nan");
  fault(changed<float>(Id::corridor_compliance, [](auto& x) { x[7] = std::nextafter(x[7], 1.0f); }), "corridors",
        "is not symmetric");
  fault(changed<float>(Id::corridor_compliance, [](auto& x) { x[0] = -x[0]; }), "corridors", "node 56: not positive");
  // The row of dof y of node 58, and what another row has there.
  fault(changed<float>(Id::corridor_compliance, [](auto& x) { x[4 * 12 + 4] = 1e-9f; }), "corridors",
        "a fixed dof has 1e-09");
  fault(changed<float>(Id::corridor_surface, [](auto& x) { x[4 * 168 + 100] = 1e-9f; }), "corridors",
        "node 58: a fixed dof");
  fault(changed<float>(Id::corridor_interior, [](auto& x) { x[3 * 2 + 1] = 1e-9f; }), "corridors", "m/N at node 58");
  fault(changed<float>(Id::corridor_interior, [](auto& x) { x[3 * 5] = std::nextafter(x[3 * 5], 1.0f); }), "corridors",
        "node 61");
  fault(changed<double>(Id::corridor_residual, [](auto& x) { x[4] = 1e-9; }), "corridors", "node 58: residual 1e-09");
  fault(changed<double>(Id::corridor_residual, nan), "finite numbers", "corridor/residual");
  fault(changed<std::int32_t>(Id::corridor_nodes, [](auto& x) { x[1] = 12; }), "stored indices", "element 1 is 12");
}

TEST(CorridorSections, MustBeReciprocalToTheTouchableColumns) {
  const auto check = [](const BundleParts& parts) {
    const ProgramRun ended = palpate_bundle("verify --json " + written(parts, "broken"));
    const auto report = nlohmann::json::parse(ended.out);
    for (const auto& one : report["checks"])
      if (one["name"] == "corridor reciprocity") return one;
    return nlohmann::json{};
  };
  EXPECT_LE(check(box())["found"], 1.0);
  // One column a hundred thousandth too long; the nodes of two columns exchanged.
  const auto longer = check(changed<float>(SectionId::corridor_surface, [](auto& x) {
    for (std::size_t i = 168; i < 336; ++i) x[i] *= 1.00001f;
  }));
  EXPECT_FALSE(longer["held"]);
  EXPECT_GT(longer["found"], 1.0);
  const auto exchanged = check(changed<float>(SectionId::corridor_surface, [](auto& x) {
    std::swap_ranges(x.begin(), x.begin() + 3 * 168, x.begin() + 9 * 168);
  }));
  EXPECT_FALSE(exchanged["held"]);
  BundleParts surface = box();
  surface.sections.erase(SectionId::displacement_interior);
  EXPECT_TRUE(check(surface).is_null()) << "there is nothing to compare with";
}

TEST(CorridorSections, AreKeptByEveryPack) {
  const std::string source = written(box());
  for (const std::string options :
       {"--precision f16", "--surface", "--low-rank 1e-2", "--low-rank 1e-2 --precision f16"}) {
    const std::string file = scratch("packed").string();
    const ProgramRun ended = palpate_bundle("pack " + source + " -o " + file + " " + options);
    ASSERT_EQ(ended.code, 0) << ended.errors;
    const ProgramRun verified = palpate_bundle("verify " + file);
    EXPECT_EQ(verified.code, 0) << options << verified.out;
    EXPECT_THAT(verified.out, options == "--surface"
                                  ? Not(HasSubstr("corridor reciprocity"))
                                  : testing::Matcher<std::string>(HasSubstr("corridor reciprocity")));
    const auto before = nlohmann::json::parse(palpate_bundle("info --json " + source).out)["sections"],
               after = nlohmann::json::parse(palpate_bundle("info --json " + file).out)["sections"];
    const auto sums = [](const nlohmann::json& sections) {
      std::map<std::string, std::string> found;
      for (const auto& s : sections)
        if (s["path"].get<std::string>().starts_with("corridor/")) found[s["path"]] = s["xxh64"];
      return found;
    };
    EXPECT_EQ(sums(before).size(), std::size(kCorridor));
    EXPECT_EQ(sums(before), sums(after)) << options;
    std::filesystem::remove(file);
  }
}

TEST(CorridorSections, AreCompared) {
  const std::string a = written(box(), "a.h5");
  EXPECT_EQ(palpate_bundle("diff " + a + " " + a).code, 0);
  const ProgramRun ended = palpate_bundle(
      "diff " + a + " " + written(changed<float>(SectionId::corridor_surface, [](auto& x) { x[9] *= 2; }), "b.h5"));
  EXPECT_EQ(ended.code, 3);
  EXPECT_THAT(ended.out, HasSubstr("corridor/displacement_surface: 1 of 2016"));
  EXPECT_THAT(palpate_bundle("diff " + a + " " + written(dense_bundle(body()), "b.h5")).out,
              HasSubstr("corridor/residual: only in"));
}

// ---- with the inputs ------------------------------------------------------------------------------------------------

std::string verify_with_inputs(const std::string& bundle) {
  return "verify --json " + bundle + " --mesh " + scratch("msh").string() + " --organ " +
         scratch("organ.toml").string() + " --boundary " + scratch("boundary.toml").string() + " --columns 3 --seed 3";
}

constexpr const char* kTable = R"([[corridor]]
name = "biopsy"
from = [10, 25, 20]
to = [40, 25, 20]
radius = 2
)";

TEST(CorridorSections, AreSolvedAgainFromTheInputs) {
  for (const char* interior : {"", "[store]\ninterior = true\n"}) {
    write_inputs(std::string(kTable) + interior);
    const std::string bundle = precompute();
    const ProgramRun ended = palpate_bundle(verify_with_inputs(bundle));
    EXPECT_EQ(ended.code, 0) << ended.out << ended.errors;
    EXPECT_THAT(ended.out, HasSubstr("\"name\": \"corridors solved again\""));
    EXPECT_THAT(palpate_bundle("info " + bundle).out,
                HasSubstr("            biopsy: capsule from (10, 25, 20) mm to (40, 25, 20) mm, radius 2 mm; "));
    if (*interior == '\0') continue;
    EXPECT_THAT(ended.out, HasSubstr("\"name\": \"corridor reciprocity\""));
    // A longer corridor has other nodes.
    write_bytes(scratch("boundary.toml"),
                std::regex_replace(file_bytes(scratch("boundary.toml")), std::regex("to = \\[40"), "to = [55"));
    const ProgramRun longer = palpate_bundle(verify_with_inputs(bundle));
    EXPECT_EQ(longer.code, 3);
  }
}

TEST(CorridorSections, ThatTheInputsDoNotGiveAreFound) {
  write_inputs(kTable);
  const std::string bundle = precompute();
  // Every column a thousandth too long: its own laws still hold, as there is no interior.
  std::string bytes = file_bytes(bundle);
  BundleIndex index;
  ASSERT_EQ(read_bundle_index(bytes.data(), bytes.size(), &index, nullptr), BundleStatus::ok);
  const SectionEntry& surface = *find_section(index, SectionId::corridor_surface);
  for (std::uint64_t at = surface.offset; at < surface.offset + surface.bytes; at += 4) {
    float number = 0;
    std::memcpy(&number, &bytes[at], 4);
    number *= 1.001f;
    std::memcpy(&bytes[at], &number, 4);
  }
  std::vector<SectionEntry> entries(index.entries, index.entries + index.header.section_count);
  write_bytes(bundle, bytes);
  seal_bundle(bundle, entries);
  EXPECT_EQ(palpate_bundle("verify " + bundle).code, 0);
  const ProgramRun ended = palpate_bundle(verify_with_inputs(bundle));
  EXPECT_EQ(ended.code, 3);
  EXPECT_THAT(ended.errors, HasSubstr("corridors solved again does not hold"));
}

}  // namespace
}  // namespace palpate
