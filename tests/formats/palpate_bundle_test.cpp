// Runs palpate-bundle as users do: what it prints and its exit codes.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>
#include <regex>

#include "formats/checksum.h"
#include "tests/formats/run_palpate_bundle.h"
#include "tests/support/tiny_bundle.h"

namespace palpate {
namespace {

using namespace formats;
using testing::HasSubstr;
using namespace tests;

const BundleParts& box() {
  static const BundleParts parts = tests::tiny_bundle({.single_dof = true});
  return parts;
}

std::string box_file() {
  const auto file = scratch("h5");
  write_bundle(file, box());
  return file.string();
}

TEST(PalpateBundleInfo, ShowsOneScreenAndTheSameAsJson) {
  const std::string file = box_file();
  const ProgramRun text = palpate_bundle("info " + file);
  for (const char* shown : {"organ       box", "64 nodes, 56 on the surface", "Young 5400 Pa, Poisson 0.45",
                            "worst residual 1e-15", "tensors/displacement_surface"})
    EXPECT_THAT(text.out, HasSubstr(shown));
  EXPECT_LE(std::count(text.out.begin(), text.out.end(), '\n'), 36);

  const auto json = info_of(file);
  EXPECT_EQ(json["counts"]["surface_nodes"], 56);
  EXPECT_EQ(json["provenance"]["solver"], "dense Cholesky");
  EXPECT_EQ(json["materials"][0]["young_pa"], 5400.0);
  EXPECT_EQ(json["sections"].size(), box().sections.size() + 1);
}

TEST(PalpateBundleInfo, StatesTheBoxesAndAreasOfWhatMayBeTouchedAndOfWhatIsHeld) {
  // The box of 60 x 50 x 40 mm in 3 x 3 x 3 cells, held at x = 0: its surface has 14,800 mm2. A node's area is a third of that of
  // the triangles around it, so the held nodes have the held face and a third or more of the triangles beside it.
  const auto scratch_file = scratch("h5");
  write_bundle(scratch_file, tests::tiny_bundle());
  const std::string file = scratch_file.string();
  const auto regions = info_of(file)["regions"];
  const auto box = [](const nlohmann::json& region, int d) {
    return std::pair{region["box_mm"][0][d].get<double>(), region["box_mm"][1][d].get<double>()};
  };
  const auto near = [](double low, double high) {
    return testing::Pair(testing::DoubleNear(low, 1e-9), testing::DoubleNear(high, 1e-9));
  };
  EXPECT_THAT(box(regions["organ"], 0), near(0, 60));
  EXPECT_NEAR(regions["organ"]["area_mm2"].get<double>(), 14800, 1e-6);
  EXPECT_THAT(box(regions["held"], 0), near(0, 0));
  EXPECT_THAT(box(regions["held"], 1), near(0, 50));
  EXPECT_EQ(regions["held"]["nodes"], 16);
  EXPECT_GT(regions["held"]["area_mm2"].get<double>(), 2000);
  EXPECT_LT(regions["held"]["area_mm2"].get<double>(), 2000 + 2.0 / 3 * 180 * 20);
  EXPECT_THAT(box(regions["touchable"], 0), near(20, 60));
  EXPECT_NEAR(regions["touchable"]["share"].get<double>() + regions["held"]["share"].get<double>(), 1, 1e-12);
  EXPECT_THAT(palpate_bundle("info " + file).out, testing::HasSubstr("x 20 .. 60, y 0 .. 50, z 0 .. 40 mm; area"));
}

TEST(PalpateBundleInfo, KeepsControlCharactersOfAHostileFileFromTheTerminal) {
  BundleParts parts = box();
  parts.set_text(SectionId::region_names, "\x1b[2Jbox\n");
  const auto file = scratch("h5");
  write_bundle(file, parts);
  EXPECT_EQ(palpate_bundle("info " + file.string()).out.find('\x1b'), std::string::npos);
}

TEST(PalpateBundle, EndsWithTwoWhereThereIsNoBundle) {
  write_bytes(scratch("text"), std::string(5000, 'x'));
  write_bytes(scratch("empty"), "");
  for (const std::string command : {"info ", "verify ", "diff "})
    for (const std::string& file :
         {scratch("text").string(), scratch("missing").string(), std::string("/tmp"), std::string("/dev/null")}) {
      const ProgramRun ended = palpate_bundle(command + file + (command == "diff " ? " " + file : ""), 2);
      EXPECT_EQ(std::count(ended.errors.begin(), ended.errors.end(), '\n'), 1) << ended.errors;
      EXPECT_THAT(ended.errors, HasSubstr(file));
    }
  palpate_bundle("", 2);
  palpate_bundle("verify a.h5 --columns 3", 2);  // only of use with the mesh
  palpate_bundle("verify a.h5 --mesh a.msh", 2);
}

TEST(PalpateBundleVerify, HoldsOnARealBundle) {
  const ProgramRun ended = palpate_bundle("verify " + box_file());
  EXPECT_THAT(ended.out, HasSubstr("ok       reciprocity"));
  EXPECT_THAT(ended.out, testing::Not(HasSubstr("NOT HELD")));
}

TEST(PalpateBundleVerify, HoldsWithoutTheInterior) {
  const auto file = scratch("h5");
  write_bundle(file, tests::tiny_bundle({.interior = false}));
  palpate_bundle("verify " + file.string());
}

TEST(PalpateBundleVerify, FindsAChangedByteInAnySection) {
  const std::string file = box_file(), bytes = file_bytes(file);
  const auto index = info_of(file);
  for (const auto& section : index["sections"]) {
    std::string damaged = bytes;
    const std::size_t at = section["offset"].get<std::size_t>() + section["bytes"].get<std::size_t>() / 2;
    damaged[at] = static_cast<char>(damaged[at] ^ 1);
    write_bytes(scratch("damaged"), damaged);
    const auto check = check_of(scratch("damaged"), "checksums", 3);
    EXPECT_FALSE(check["held"]);
    EXPECT_THAT(check["detail"].get<std::string>(), HasSubstr(section["path"].get<std::string>()));
  }
}

TEST(PalpateBundleVerify, EndsWithThreeOnACutBundle) {
  const std::string bytes = file_bytes(box_file());
  write_bytes(scratch("cut"), bytes.substr(0, bytes.size() / 2));
  EXPECT_FALSE(check_of(scratch("cut"), "structure", 3)["held"]);
}

// A bundle whose checksums fit, but whose numbers break a law.
template <class Number, class Change>
std::string broken(SectionId id, const Change& change) {
  const auto file = scratch("broken");
  write_bundle(file, changed<Number>(box(), id, change));
  return file.string();
}
template <class Number, class Change>
void expect_found(SectionId id, const std::string& check, const Change& change) {
  EXPECT_FALSE(check_of(broken<Number>(id, change), check, 3)["held"]) << check;
}

TEST(PalpateBundleVerify, FindsNumbersThatAreNotFinite) {
  const auto nan = [](auto& x) { x[x.size() / 2] = std::numeric_limits<double>::quiet_NaN(); };
  const auto infinite = [](auto& x) { x.back() = -std::numeric_limits<float>::infinity(); };
  expect_found<double>(SectionId::nodes, "finite numbers", nan);
  expect_found<double>(SectionId::force, "finite numbers", nan);
  expect_found<float>(SectionId::displacement_surface, "finite displacements", infinite);
  expect_found<float>(SectionId::displacement_interior, "finite displacements", infinite);
}

TEST(PalpateBundleVerify, FindsResponseCurvesThatAreNone) {
  const auto with = [](std::vector<double> p, std::vector<double> q, std::vector<double> range) {
    BundleParts parts = box();
    parts.set(SectionId::response_radial, {p.size()}, p);
    parts.set(SectionId::response_force, {q.size()}, q);
    parts.set(SectionId::response_range, {2}, range);
    const auto file = scratch("responses");
    write_bundle(file, parts);
    return file.string();
  };
  const std::string good = with({1e-3, 1e-3}, {0.5, 0.5}, {2e-3, 1});
  EXPECT_TRUE(check_of(good, "radial response P", 0)["held"]);
  EXPECT_TRUE(check_of(good, "force response Q", 0)["held"]);
  const auto falls = check_of(with({1e-3, 1e-3}, {-0.5, -0.5}, {2e-3, 1}), "force response Q", 3);
  EXPECT_FALSE(falls["held"]);
  EXPECT_THAT(falls["detail"].get<std::string>(), HasSubstr("falls to -1 N"));
  EXPECT_FALSE(check_of(with({1e3, 1e3}, {0.5, 0.5}, {2e-3, 1}), "radial response P", 3)["held"]);
  EXPECT_FALSE(check_of(with({1e-3, 1e-3}, {5.5, 0.5}, {2e-3, 1}), "force response Q", 3)["held"]);
  EXPECT_TRUE(check_of(with({0, 0}, {0.5, 0.5}, {0, 1}), "force response Q", 0)["held"]) << "P was not measured";
}

TEST(PalpateBundleVerify, FindsIndicesAndMeshesThatDoNotHold) {
  expect_found<std::int32_t>(SectionId::tetrahedra, "stored indices", [](auto& x) { x[5] = 64; });
  expect_found<std::int32_t>(SectionId::tetrahedra, "volumes", [](auto& x) { std::swap(x[0], x[1]); });
  expect_found<std::int32_t>(SectionId::triangles, "surface", [](auto& x) { std::swap(x[0], x[1]); });
  expect_found<double>(SectionId::poisson, "materials", [](auto& x) { x[0] = 0.5; });
  expect_found<double>(SectionId::residual, "certificate", [](auto& x) { x[4] = 1e-6; });
  expect_found<double>(SectionId::force, "symmetric T^f", [](auto& x) { x[1] *= 1 + 1e-9; });
  expect_found<double>(SectionId::force, "definite T^f", [](auto& x) { x[0] = -x[0]; });
}

TEST(PalpateBundleVerify, FindsAPreloadThatMovesAFixedNode) {
  BundleParts parts = box();
  const auto fixed = parts.get<std::uint8_t>(SectionId::fixed);
  std::vector<double> displacement(fixed.size());
  for (std::size_t i = 0; i < fixed.size(); ++i) displacement[i] = fixed[i] ? 0.0 : 1e-4;
  const auto file = scratch("h5");
  for (const bool moved : {false, true}) {
    if (moved) displacement[static_cast<std::size_t>(std::find(fixed.begin(), fixed.end(), 1) - fixed.begin())] = 1e-9;
    parts.set(SectionId::preload_displacement, {fixed.size() / 3, 3}, displacement);
    write_bundle(file, parts);
    EXPECT_EQ(check_of(file, "preload", moved ? 3 : 0)["held"], !moved);
  }
}

// A piston of the fixed face along x and a pressure; their fields are no solutions, which only the inputs could tell.
BundleParts with_motions() {
  BundleParts parts = box();
  const auto fixed = parts.get<std::uint8_t>(SectionId::fixed);
  const std::size_t nodes = fixed.size() / 3, ns = parts.sections.at(SectionId::displacement_surface).shape[2];
  std::vector<float> field(6 * ns), interior(6 * (nodes - ns));
  for (std::size_t m = 0; m < 2; ++m)
    for (std::size_t i = 0; i < 3 * nodes; ++i) {
      const float u = m == 0 ? i % 3 == 0 : fixed[i] ? 0.0f : 1e-6f;
      (i < 3 * ns ? field[3 * ns * m + i] : interior[3 * (nodes - ns) * m + i - 3 * ns]) = u;
    }
  parts.set_text(SectionId::motion_names, "piston\nfilling\n");
  parts.set(SectionId::motion_kinds, {2}, std::vector<std::int32_t>{1, 4});
  parts.set(SectionId::motion_surface, {2, ns, 3}, field);
  parts.set(SectionId::motion_interior, {2, nodes - ns, 3}, interior);
  parts.set(SectionId::motion_volume, {2, 2}, std::vector<double>{0, 0, 1e-5, 2e-9});
  parts.set(SectionId::motion_residual, {2}, std::vector<double>{1e-13, 1e-14});
  const std::size_t triangles = parts.get<std::int32_t>(SectionId::triangles).size() / 3;
  std::vector<std::uint8_t> pressed(2 * triangles, 0);
  pressed[triangles + 3] = 1;
  parts.set(SectionId::motion_pressed, {2, triangles}, pressed);
  return parts;
}

void motion_fault(const BundleParts& parts, const std::string& sentence) {
  write_bundle(scratch("h5"), parts);
  const auto found = check_of(scratch("h5"), "motions", 3);
  EXPECT_FALSE(found["held"]);
  EXPECT_THAT(found["detail"].get<std::string>(), HasSubstr(sentence));
}
template <class Number, class Change>
void motion_fault(SectionId id, const std::string& sentence, const Change& change) {
  motion_fault(changed<Number>(with_motions(), id, change), sentence);
}

TEST(PalpateBundleVerify, FindsMotionsThatBreakALaw) {
  const auto file = scratch("h5");
  write_bundle(file, with_motions());
  EXPECT_TRUE(check_of(file, "motions", 0)["held"]);
  const auto fixed = box().get<std::uint8_t>(SectionId::fixed);
  const auto held = static_cast<std::size_t>(std::find(fixed.begin(), fixed.end(), 1) - fixed.begin());
  const std::size_t ns = box().sections.at(SectionId::displacement_surface).shape[2];
  using Id = SectionId;
  motion_fault<float>(Id::motion_surface, "motion 0: node 1 ",
                      [](auto& x) { x[4] = std::numeric_limits<float>::infinity(); });
  motion_fault<float>(Id::motion_surface, "motion 1, a load, moves", [&](auto& x) { x[3 * ns + held] = 1e-9f; });
  motion_fault<double>(Id::motion_volume, "motion 0 is no pressure", [](auto& x) { x[1] = 1e-6; });
  motion_fault<double>(Id::motion_volume, "pressure 1 sweeps -2e-09", [](auto& x) { x[3] = -x[3]; });
  motion_fault<double>(Id::motion_residual, "worst residual 0.001", [](auto& x) { x[1] = 1e-3; });
  motion_fault<std::uint8_t>(Id::motion_pressed, "motion 0, no pressure, presses on 1 triangles",
                             [](auto& x) { x[2] = 1; });
  motion_fault<std::uint8_t>(Id::motion_pressed, "motion 1, a pressure, presses on 0 triangles",
                             [](auto& x) { std::fill(x.begin(), x.end(), std::uint8_t{0}); });
  BundleParts parts = with_motions();
  parts.set_text(Id::motion_names, "piston\n");
  motion_fault(parts, "2 motions but 1 names");
  parts = with_motions();
  parts.sections.erase(Id::motion_volume);
  motion_fault(parts, "a pressure has no volumes");
  const auto none = [](auto& x) { std::fill(x.begin(), x.end(), 0.0f); };
  parts = changed<float>(changed<float>(with_motions(), Id::motion_surface, none), Id::motion_interior, none);
  parts.set(Id::motion_kinds, {2}, std::vector<std::int32_t>{4, 4});
  parts.set(Id::motion_volume, {2, 2}, std::vector<double>{2e-9, 1e-9, -1e-9, 2e-9});
  motion_fault(parts, "of one another's surface");
  BundleParts kinds = with_motions();
  kinds.set(SectionId::motion_kinds, {2}, std::vector<std::int32_t>{1, 6});
  write_bundle(file, kinds);
  EXPECT_THAT(check_of(file, "stored indices", 3)["detail"].get<std::string>(), HasSubstr("expected 1 to 5"));
  write_bundle(file, changed<std::uint8_t>(with_motions(), Id::motion_pressed, [](auto& x) { x[0] = 2; }));
  EXPECT_THAT(check_of(file, "stored indices", 3)["detail"].get<std::string>(),
              HasSubstr("motion/pressed: expected 0 or 1"));
}

TEST(PalpateBundleVerify, MotionsThatLackASectionAreNotWritten) {
  for (const SectionId id :
       {SectionId::motion_names, SectionId::motion_kinds, SectionId::motion_surface, SectionId::motion_residual}) {
    BundleParts parts = with_motions();
    parts.sections.erase(id);
    EXPECT_THAT([&] { write_bundle(scratch("h5"), parts); },
                testing::ThrowsMessage<std::exception>(HasSubstr("found 3 of them")));
  }
}

TEST(PalpateBundleVerify, FindsDisplacementsThatBreakALaw) {
  const auto touchable = box().get<std::int32_t>(SectionId::touchable);
  const auto fixed = box().get<std::uint8_t>(SectionId::fixed);
  const std::size_t ns = box().sections.at(SectionId::displacement_surface).shape[2];
  const auto entry = [&](std::size_t k, std::size_t j, std::size_t n, std::size_t i) {
    return ((k * 3 + j) * ns + n) * 3 + i;
  };
  const auto held = static_cast<std::size_t>(std::find(fixed.begin(), fixed.end(), 1) - fixed.begin());
  const auto change = [&](std::size_t at, float factor, float sum) {
    return broken<float>(SectionId::displacement_surface, [&](auto& x) { x[at] = x[at] * factor + sum; });
  };
  EXPECT_FALSE(check_of(change(entry(4, 1, held / 3, held % 3), 1, 1e-30f), "fixed nodes", 3)["held"]);
  EXPECT_FALSE(check_of(change(entry(4, 1, touchable[4], 1), 1.00001f, 0), "own displacement", 3)["held"]);
  // A change of a millionth of the largest displacement, far from the touched node. The bound there is about 1e-7 of the
  // pair's own 3 x 3 entry.
  const auto reciprocity = check_of(change(entry(0, 0, touchable.back(), 2), 1, 1e-6f), "reciprocity", 3);
  EXPECT_FALSE(reciprocity["held"]);
  EXPECT_GT(reciprocity["found"], 1.0);
  // A column scaled as a whole has the right pattern, but breaks reciprocity.
  const std::string scaled = broken<float>(SectionId::displacement_surface, [&](auto& x) {
    for (std::size_t n = 0; n < ns; ++n)
      for (std::size_t i = 0; i < 3; ++i)
        if (n != static_cast<std::size_t>(touchable[7])) x[entry(7, 1, n, i)] *= 1.0001f;
  });
  EXPECT_FALSE(check_of(scaled, "reciprocity", 3)["held"]);
}

TEST(PalpateBundleDiff, SaysWhatDiffers) {
  const std::string a = box_file();
  palpate_bundle("diff " + a + " " + a);

  BundleParts parts = box();
  parts.provenance.replace(parts.provenance.find("box"), 3, "cub");
  auto young = parts.get<double>(SectionId::young);
  young[0] *= 1.5;
  parts.set(SectionId::young, {1}, young);
  parts.sections.erase(SectionId::displacement_interior);
  const std::string b = scratch("b.h5");
  write_bundle(b, parts);
  const ProgramRun ended = palpate_bundle("diff --json " + a + " " + b, 3);
  const auto report = nlohmann::json::parse(ended.out);
  ASSERT_EQ(report["provenance"].size(), 1u);
  EXPECT_EQ(report["provenance"][0]["b"], "cub");
  ASSERT_EQ(report["sections"].size(), 2u);
  EXPECT_EQ(report["sections"][0]["section"], "material/young");
  EXPECT_EQ(report["sections"][0]["largest_difference"], 2700.0);
  EXPECT_DOUBLE_EQ(report["sections"][0]["relative_difference"].get<double>(), 2700.0 / 8100.0);
  EXPECT_EQ(report["sections"][1]["only_in"], "a");
  const ProgramRun text = palpate_bundle("diff " + a + " " + b, 3);
  EXPECT_THAT(text.out, HasSubstr("material/young: 1 of 1"));
}

TEST(PalpateBundle, SurvivesDamageOfEveryKind) {
  // Random bytes in the index and in small sections, with a right index checksum: an exit code, never a signal.
  const std::string file = box_file(), bytes = file_bytes(file);
  std::mt19937_64 random(1);
  for (int round = 0; round < 10; ++round) {
    std::string damaged = bytes;
    for (int change = 0; change < 4; ++change) {
      const std::uint64_t at = round % 2 ? random() % (bytes.size() - 8) : 64 + random() % (15 * 72);
      const std::uint64_t value = random() >> random() % 64;
      std::memcpy(damaged.data() + at, &value, 1 + random() % 8);
    }
    BundleHeader header;
    std::memcpy(&header, damaged.data(), sizeof header);
    header.index_checksum = 0;
    std::memcpy(damaged.data(), &header, sizeof header);
    header.index_checksum =
        xxh64(damaged.data(), sizeof header + header.section_count % kMaxSections * sizeof(SectionEntry));
    std::memcpy(damaged.data(), &header, sizeof header);
    write_bytes(scratch("damaged"), damaged);
    for (const std::string& command : {std::string("info "), std::string("verify "), "diff " + file + " "}) {
      const ProgramRun ended =
          run_in(fresh_folder(), PALPATE_BUNDLE_PROGRAM " " + command + scratch("damaged").string());
      EXPECT_TRUE(ended.code == 0 || ended.code == 2 || ended.code == 3)
          << command << round << ": " << ended.code << ended.errors;
    }
  }
}

// ---- with the inputs ------------------------------------------------------------------------------------------------

TEST(PalpateBundleVerify, SolvesColumnsAgainFromTheInputs) {
  write_inputs();
  const ProgramRun ended = verify_with_inputs(precompute(), 0);
  for (const char* name : {"input hashes", "same body", "solved again", "T^f solved again"})
    EXPECT_THAT(ended.out, HasSubstr(std::string("\"name\": \"") + name + "\""));
}

TEST(PalpateBundleVerify, SolvesColumnsOfAnOrganOnSoftSupportsAgainAndShowsThem) {
  write_inputs(R"([[foundation]]
name = "bed"
normal = { value = 40, unit = "kPa/cm", source = "test" }
select = { patch = "z0" }
[[spring]]
name = "cord"
from = { patch = "x1" }
stiffness = { value = 30, unit = "N/m", source = "test" }
)");
  const std::string bundle = precompute();
  verify_with_inputs(bundle, 0);
  const ProgramRun info = palpate_bundle("info " + bundle);
  EXPECT_THAT(info.out, HasSubstr("            16 nodes fixed, 1 along one or two axes"));
  EXPECT_THAT(info.out, HasSubstr("foundation bed: normal 4e+06 N/m^3 (test); 0.003 m^2"));
  EXPECT_THAT(
      info.out,
      testing::ContainsRegex(
          "spring cord: 30 N/m \\(test\\); from 16 nodes at \\([-0-9.e]+, [-0-9.e]+, [-0-9.e]+\\) mm to their places"));
  // The same supports, a little softer: other hashes, and other columns.
  write_bytes(scratch("boundary.toml"),
              std::regex_replace(file_bytes(scratch("boundary.toml")), std::regex("value = 40"), "value = 39"));
  const auto report = nlohmann::json::parse(verify_with_inputs(bundle, 3).out);
  for (const auto& check : report["checks"])
    if (check["name"] == "input hashes") {
      EXPECT_FALSE(check["held"].get<bool>());
    }
}

constexpr const char* kMotionTables = R"([[motion]]
name = "diaphragm"
kind = "piston"
axis = [0, 0, 1]
[[motion]]
name = "filling"
kind = "pressure"
select = { patch = "z1" }
)";

TEST(PalpateBundleVerify, SolvesMotionsAgainAndShowsThem) {
  write_inputs(kMotionTables);
  const std::string bundle = precompute();
  const ProgramRun ended = verify_with_inputs(bundle, 0);
  EXPECT_THAT(ended.out, HasSubstr("\"name\": \"motions solved again\""));
  const ProgramRun info = palpate_bundle("info " + bundle);
  EXPECT_THAT(info.out,
              testing::ContainsRegex("motions     diaphragm: piston along \\(0, 0, 1\\); per m; [0-9]+ nodes"));
  EXPECT_THAT(info.out, testing::ContainsRegex("            filling: pressure; per Pa; 0.00[0-9]+ m\\^2; residual"));
  // The same motions in another order.
  const std::string boundary = file_bytes(scratch("boundary.toml")), tables = kMotionTables;
  const auto second = tables.find("[[motion]]\nname = \"filling\"");
  write_bytes(scratch("boundary.toml"),
              boundary.substr(0, boundary.find("[[motion]]")) + tables.substr(second) + tables.substr(0, second));
  verify_with_inputs(bundle, 3);
}

TEST(PalpateBundleVerify, HoldsWithFilesOfOneNameInTwoFoldersAndFindsThatOneOfThemIsAnother) {
  const auto folder = scratch("fields");
  std::string tables;
  for (const std::string name : {"in", "out"}) {
    std::filesystem::create_directories(folder / name);
    std::string field = "x,y,z,ux,uy,uz\n60,50,40,0,1,0\n";  // mm, near the held nodes of write_inputs()
    for (const int y : {0, 17, 33, 50})
      for (const int z : {0, 13, 27, 40}) field += fmt::format("0,{},{},1,0,{}\n", y, z, name.size());
    write_bytes(folder / name / "field.csv", field);
    tables += "[[motion]]\nname = \"" + name + "\"\nkind = \"field\"\nfile = \"" + folder.filename().string() + "/" +
              name + "/field.csv\"\n";
  }
  write_inputs(tables);
  const std::string bundle = precompute();
  verify_with_inputs(bundle, 0);
  for (const std::string name : {"in", "out"}) {
    const std::string field = file_bytes(folder / name / "field.csv");
    write_bytes(folder / name / "field.csv", field + "9,9,9,1,1,1\n");
    const ProgramRun ended = verify_with_inputs(bundle, 3);
    EXPECT_THAT(ended.errors, HasSubstr("file hashes does not hold"));
    EXPECT_THAT(ended.out, HasSubstr(name + "/field.csv is not"));
    write_bytes(folder / name / "field.csv", field);
  }
}

TEST(PalpateBundleVerify, FindsThatTheMeasuredCurveIsAnother) {
  write_inputs();
  const auto curve = scratch("curve.csv");
  const std::string measured = "displacement_mm,force_N\n1,1\n2,2\n3,3\n4,4\n5,5\n";
  write_bytes(curve, measured);
  write_bytes(scratch("organ.toml"), kOrgan + "[response]\ncurve = \"" + curve.string() + R"("
source = "test"
height = { value = 10, unit = "mm" }
radius = { value = 5, unit = "mm" }
young = { value = 5.4, unit = "kPa", source = "test" }
poisson = { value = 0.45, source = "test" }
)");
  const std::string bundle = precompute();
  verify_with_inputs(bundle, 0);
  write_bytes(curve, measured + "6,7\n");
  const ProgramRun ended = verify_with_inputs(bundle, 3);
  EXPECT_THAT(ended.out, HasSubstr("curve.csv is not"));
}

TEST(PalpateBundleVerify, FindsAColumnThatTheInputsDoNotGive) {
  // T^u and T^f of a softer organ satisfy every law; only solving again finds the difference.
  write_inputs();
  OpenedBundle bundle{precompute()};
  const SectionEntry& stiffness = bundle.section(SectionId::force);
  for (std::uint64_t at = 0; at < stiffness.bytes; at += 8) bundle.scale(stiffness.offset + at, 0.5);
  bundle.write();
  palpate_bundle("verify " + bundle.file);
  const ProgramRun ended = verify_with_inputs(bundle.file, 3);
  EXPECT_THAT(ended.errors, HasSubstr("T^f solved again does not hold"));
}

// A bundle as a faulty solver would leave it: complete and sealed, but C is off by 1e-4 between one node and all others, and
// symmetric as C must be. The stored numbers break no law, so that only solving again finds the fault.
TEST(PalpateBundleVerify, FindsTheWrongColumnsOfOneNode) {
  write_inputs();
  OpenedBundle bundle{precompute()};
  const auto wrong_node =
      bundle.get<std::int32_t>(bundle.section(SectionId::touchable).offset);      // of the first columns
  const SectionEntry& surface = bundle.section(SectionId::displacement_surface);  // [S,3,Ns,3]
  for (std::uint64_t column_node = 0; column_node < surface.shape[0]; ++column_node)
    for (std::uint64_t j = 0; j < 3; ++j)
      for (std::uint64_t node = 0; node < surface.shape[2]; ++node)
        for (std::uint64_t i = 0; i < 3; ++i) {
          const bool of_wrong_node = node == static_cast<std::uint64_t>(wrong_node);
          if ((column_node == 0) == of_wrong_node) continue;  // neither, or the node's own identity
          bundle.scale(surface.offset + 4 * (((column_node * 3 + j) * surface.shape[2] + node) * 3 + i), 1.0001f);
        }
  bundle.write();
  const ProgramRun ended = verify_with_inputs(bundle.file, 3, 1000);
  EXPECT_THAT(ended.errors, HasSubstr("solved again does not hold"));
}

TEST(PalpateBundleVerify, FindsAMotionThatTheInputsDoNotGive) {
  write_inputs(kMotionTables);
  OpenedBundle bundle{precompute()};
  const SectionEntry& field = bundle.section(SectionId::motion_surface);  // [M,Ns,3]
  for (std::uint64_t at = field.bytes / 2; at < field.bytes; at += 4) bundle.scale(field.offset + at, 1.0001f);
  bundle.write();
  palpate_bundle("verify " + bundle.file);
  const ProgramRun ended = verify_with_inputs(bundle.file, 3);
  EXPECT_THAT(ended.errors, HasSubstr("motions solved again does not hold"));
}

TEST(PalpateBundleVerify, FindsThatTheInputsAreOthers) {
  write_inputs();
  const std::string bundle = precompute();
  write_bytes(scratch("organ.toml"), file_bytes(scratch("organ.toml")) + "# changed\n");
  const ProgramRun ended = verify_with_inputs(bundle, 3);
  EXPECT_THAT(ended.errors, HasSubstr("organ.toml is not"));
}

}  // namespace
}  // namespace palpate
