// palpate-bundle on bundles with corridors and the region of a cut: what it shows, checks, compares and keeps.
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

TEST(CorridorSections, AreShownAndHold) {
  BundleParts parts = box();
  parts.provenance.replace(1, 0, R"("corridor biopsy":"capsule from here to there; 4 nodes",)");
  const std::string file = written(parts);
  const ProgramRun info = palpate_bundle("info " + file);
  EXPECT_THAT(info.out, HasSubstr("corridors   4 nodes, 9.9 kB; worst residual 1e-15\n"
                                  "            biopsy: capsule from here to there; 4 nodes\n"));
  EXPECT_THAT(info.out, HasSubstr("corridor/displacement_interior"));
  const auto json = info_of(file);
  EXPECT_EQ(json["counts"]["corridor"], 4);
  EXPECT_EQ(json["corridors"]["bytes"], 4 * 4 + 36 * 4 * (64 + 4) + 8 * 3 * 4);
  EXPECT_EQ(json["corridors"]["list"][0]["name"], "biopsy");
  const ProgramRun verified = palpate_bundle("verify " + file);
  EXPECT_THAT(verified.out, HasSubstr("ok       corridors            4 nodes, worst residual 1e-15"));
  EXPECT_THAT(verified.out, HasSubstr("ok       corridor reciprocity"));
  EXPECT_THAT(palpate_bundle("info " + written(tiny_bundle())).out, Not(HasSubstr("corridor")));
}

template <class Number, class Change>
void fault(SectionId id, const std::string& sentence, const Change& change, const std::string& check = "corridors") {
  const ProgramRun ended = palpate_bundle("verify " + written(changed<Number>(box(), id, change), "broken"), 3);
  EXPECT_THAT(ended.errors, HasSubstr(check + " does not hold: ")) << ended.out;
  EXPECT_THAT(ended.errors, HasSubstr(sentence));
}

TEST(CorridorSections, ThatBreakALawAreFound) {
  using Id = SectionId;
  const auto nan = [](auto& x) { x[x.size() / 2] = std::numeric_limits<float>::quiet_NaN(); };
  fault<float>(Id::corridor_compliance, "nan", nan);
  fault<float>(Id::corridor_surface, "moves by nan", nan);
  fault<float>(Id::corridor_interior, "moves by nan", nan);
  fault<float>(Id::corridor_compliance, "is not symmetric", [](auto& x) { x[7] = std::nextafter(x[7], 1.0f); });
  fault<float>(Id::corridor_compliance, "node 56: not positive", [](auto& x) { x[0] = -x[0]; });
  // The row of dof y of node 58, and what another row has there.
  fault<float>(Id::corridor_compliance, "a fixed dof has 1e-09", [](auto& x) { x[4 * 12 + 4] = 1e-9f; });
  fault<float>(Id::corridor_surface, "node 58: a fixed dof", [](auto& x) { x[4 * 168 + 100] = 1e-9f; });
  fault<float>(Id::corridor_interior, "m/N at node 58", [](auto& x) { x[3 * 2 + 1] = 1e-9f; });
  fault<float>(Id::corridor_interior, "node 61", [](auto& x) { x[3 * 5] = std::nextafter(x[3 * 5], 1.0f); });
  fault<double>(Id::corridor_residual, "node 58: residual 1e-09", [](auto& x) { x[4] = 1e-9; });
  fault<double>(Id::corridor_residual, "corridor/residual", nan, "finite numbers");
  fault<std::int32_t>(
      Id::corridor_nodes, "element 1 is 12", [](auto& x) { x[1] = 12; }, "stored indices");
}

TEST(CorridorSections, MustBeReciprocalToTheTouchableColumns) {
  const auto check = [](const BundleParts& parts, int code) {
    return check_of(written(parts, "broken"), "corridor reciprocity", code);
  };
  EXPECT_LE(check(box(), 0)["found"], 1.0);
  // One column a hundred thousandth too long; the nodes of two columns exchanged.
  const auto too_long = [](auto& x) {
    for (std::size_t i = 168; i < 336; ++i) x[i] *= 1.00001f;
  };
  const auto exchanged = [](auto& x) { std::swap_ranges(x.begin(), x.begin() + 3 * 168, x.begin() + 9 * 168); };
  const auto longer = check(changed<float>(box(), SectionId::corridor_surface, too_long), 3);
  EXPECT_FALSE(longer["held"]);
  EXPECT_GT(longer["found"], 1.0);
  EXPECT_FALSE(check(changed<float>(box(), SectionId::corridor_surface, exchanged), 3)["held"]);
  BundleParts surface = box();
  surface.sections.erase(SectionId::displacement_interior);
  EXPECT_TRUE(check(surface, 0).is_null()) << "there is nothing to compare with";
}

TEST(CorridorSections, AreKeptByEveryPack) {
  const std::string source = written(box());
  for (const std::string options :
       {"--precision f16", "--surface", "--low-rank 1e-2", "--low-rank 1e-2 --precision f16"}) {
    const std::string file = scratch("packed").string();
    palpate_bundle("pack " + source + " -o " + file + " " + options);
    const ProgramRun verified = palpate_bundle("verify " + file);
    EXPECT_THAT(verified.out, options == "--surface"
                                  ? Not(HasSubstr("corridor reciprocity"))
                                  : testing::Matcher<std::string>(HasSubstr("corridor reciprocity")));
    const auto before = info_of(source)["sections"], after = info_of(file)["sections"];
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
  palpate_bundle("diff " + a + " " + a);
  const std::string b = written(changed<float>(box(), SectionId::corridor_surface, [](auto& x) { x[9] *= 2; }), "b.h5");
  const ProgramRun ended = palpate_bundle("diff " + a + " " + b, 3);
  EXPECT_THAT(ended.out, HasSubstr("corridor/displacement_surface: 1 of 2016"));
  EXPECT_THAT(palpate_bundle("diff " + a + " " + written(dense_bundle(body()), "b.h5"), 3).out,
              HasSubstr("corridor/residual: only in"));
}

// ---- with the inputs ------------------------------------------------------------------------------------------------

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
    const ProgramRun ended = verify_with_inputs(bundle, 0);
    EXPECT_THAT(ended.out, HasSubstr("\"name\": \"corridors solved again\""));
    EXPECT_THAT(palpate_bundle("info " + bundle).out,
                HasSubstr("            biopsy: capsule from (10, 25, 20) mm to (40, 25, 20) mm, radius 2 mm; "));
    if (*interior == '\0') continue;
    EXPECT_THAT(ended.out, HasSubstr("\"name\": \"corridor reciprocity\""));
    // A longer corridor has other nodes.
    write_bytes(scratch("boundary.toml"),
                std::regex_replace(file_bytes(scratch("boundary.toml")), std::regex("to = \\[40"), "to = [55"));
    verify_with_inputs(bundle, 3);
  }
}

TEST(CorridorSections, ThatTheInputsDoNotGiveAreFound) {
  write_inputs(kTable);
  // Every column a thousandth too long: its own laws still hold, as there is no interior.
  OpenedBundle bundle{precompute()};
  const SectionEntry& surface = bundle.section(SectionId::corridor_surface);
  for (std::uint64_t at = 0; at < surface.bytes; at += 4) bundle.scale(surface.offset + at, 1.001f);
  bundle.write();
  palpate_bundle("verify " + bundle.file);
  const ProgramRun ended = verify_with_inputs(bundle.file, 3);
  EXPECT_THAT(ended.errors, HasSubstr("corridors solved again does not hold"));
}

// ---- the region of a cut --------------------------------------------------------------------------------------------

// The corridor's nodes, and two of the surface of which the first is held.
const BundleParts& box_with_cut() {
  static const BundleParts parts = [] {
    BundleParts made = box();
    add_cut(made, body(), {0, 39, 56, 58, 61, 63});
    return made;
  }();
  return parts;
}

TEST(CutSections, AreShownAndHold) {
  BundleParts parts = box_with_cut();
  parts.provenance.replace(1, 0, R"("cut":"2 nodes may be divided; 6 nodes with those beside them",)");
  const std::string file = written(parts);
  EXPECT_THAT(palpate_bundle("info " + file).out,
              HasSubstr("cut         6 nodes, 1.7 kB; worst residual 1e-15\n"
                        "            2 nodes may be divided; 6 nodes with those beside them\n"));
  EXPECT_EQ(info_of(file)["cut"]["bytes"], 4 * 6 + 36 * 6 * 7 + 8 * 3 * 6);
  EXPECT_TRUE(info_of(written(box(), "other"))["cut"].is_null());
  const ProgramRun verified = palpate_bundle("verify " + file);
  EXPECT_THAT(verified.out, HasSubstr("ok       cut                  6 nodes, worst residual 1e-15"));
  EXPECT_THAT(verified.out, HasSubstr("ok       cut beside tensors"));
}

template <class Number, class Change>
void fault_of_cut(SectionId id, const std::string& sentence, const Change& change, const std::string& check = "cut") {
  const ProgramRun ended =
      palpate_bundle("verify " + written(changed<Number>(box_with_cut(), id, change), "broken"), 3);
  EXPECT_THAT(ended.errors, HasSubstr(check + " does not hold: ")) << ended.out;
  EXPECT_THAT(ended.errors, HasSubstr(sentence));
}

TEST(CutSections, ThatBreakALawAreFound) {
  using Id = SectionId;
  // Blocks of 9: of the pairs (0, 0), (39, 0), (39, 39), (56, 0), (56, 39), (56, 56), ...
  fault_of_cut<double>(Id::cut_compliance, "nan", [](auto& x) { x[20] = std::numeric_limits<double>::quiet_NaN(); });
  fault_of_cut<double>(Id::cut_compliance, "nodes 39 and 0: a fixed dof has", [](auto& x) { x[9] = 1e-9; });
  fault_of_cut<double>(Id::cut_compliance, "nodes 39 and 39 is not symmetric",
                       [](auto& x) { x[19] = std::nextafter(x[19], 1.0); });
  fault_of_cut<double>(Id::cut_compliance, "node 39: not positive", [](auto& x) { x[18] = -x[18]; });
  fault_of_cut<double>(Id::cut_compliance, "and the corridor has", [](auto& x) { x[45] *= 1.000001; });
  fault_of_cut<double>(Id::cut_residual, "node 39: residual 1e-09", [](auto& x) { x[3] = 1e-9; });
  fault_of_cut<std::int32_t>(Id::cut_nodes, "node 57: inside the organ, and corridor/nodes",
                             [](auto& x) { x[3] = 57; });
  fault_of_cut<std::int32_t>(
      Id::cut_nodes, "element 1 is 0", [](auto& x) { x[1] = 0; }, "stored indices");
  // The block of a touchable node, a thousandth too large.
  fault_of_cut<double>(
      Id::cut_compliance, "relative difference",
      [](auto& x) {
        for (std::size_t i = 18; i < 27; ++i) x[i] *= 1.001;
      },
      "cut beside tensors");
}

TEST(CutSections, AreKeptByEveryPackThatKeepsTheirColumns) {
  write_inputs("[cut]\nregion = { sphere = { center = [45, 33, 27], radius = 6 } }\n");
  const std::string bundle = precompute();
  const ProgramRun verified = verify_with_inputs(bundle, 0);
  EXPECT_THAT(verified.out, HasSubstr("\"name\": \"cut solved again\""));
  for (const std::string options : {"--precision f16", "--low-rank 1e-2"}) {
    const std::string file = scratch("packed").string();
    palpate_bundle("pack " + bundle + " -o " + file + " " + options);
    EXPECT_THAT(palpate_bundle("verify " + file).out, HasSubstr("ok       cut beside tensors"));
    std::filesystem::remove(file);
  }
  const ProgramRun ended = palpate_bundle(
      "pack " + bundle + " -o " + scratch("less").string() + " --mesh " + scratch("msh").string() + " --patch y0", 2);
  EXPECT_THAT(ended.errors, HasSubstr("cut/nodes"));
}

TEST(CutSections, ThatTheInputsDoNotGiveAreFound) {
  write_inputs("[cut]\nregion = { sphere = { center = [45, 33, 27], radius = 6 } }\n");
  // The blocks of all pairs of two nodes a hundredth too large: no other section has them.
  OpenedBundle bundle{precompute()};
  const SectionEntry &nodes = bundle.section(SectionId::cut_nodes), &cut = bundle.section(SectionId::cut_compliance);
  for (std::uint64_t a = 0; a < nodes.shape[0]; ++a)
    for (std::uint64_t block = a * (a + 1) / 2; block < a * (a + 1) / 2 + a; ++block)
      for (std::uint64_t i = 0; i < 9; ++i) bundle.scale(cut.offset + 8 * (9 * block + i), 1.01);
  bundle.write();
  palpate_bundle("verify " + bundle.file);
  EXPECT_THAT(verify_with_inputs(bundle.file, 3).errors, HasSubstr("cut solved again does not hold"));
}

TEST(CutSections, AreCompared) {
  const std::string a = written(box_with_cut(), "a.h5");
  palpate_bundle("diff " + a + " " + a);
  const std::string b =
      written(changed<double>(box_with_cut(), SectionId::cut_compliance, [](auto& x) { x[18] *= 2; }), "b.h5");
  EXPECT_THAT(palpate_bundle("diff " + a + " " + b, 3).out, HasSubstr("cut/compliance: 1 of 189"));
}

}  // namespace
}  // namespace palpate
