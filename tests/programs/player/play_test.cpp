// palpate-run on a tiny bundle: what it writes is what the C API says.
#include <gmock/gmock.h>
#include <vtkCellData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLUnstructuredGridReader.h>
#include <palpate/palpate_scene_def.hpp>

#include <array>
#include <regex>
#include <sstream>

#include "programs/player/explain.h"
#include "programs/player/scene_warnings.h"
#include "programs/player/summary.h"
#include "tests/programs/player/played_scene.h"
#include "tests/support/bundle_forms.h"
#include "tests/support/packed_bundle.h"
#include "tests/support/tools.h"

namespace palpate {
namespace {

using namespace tests;
namespace fs = std::filesystem;
using testing::HasSubstr;

TEST_F(PlayedScene, TakesAToolAwayWhenItsSceneSaysSo) {
  write_scene(kProbe + "away = [[0, 0.01], [0.08, 0.09]]\n");
  played("scene.toml -o out");
  const auto rows = rows_of("out/forces.csv");
  ASSERT_EQ(rows.size(), 101u);
  EXPECT_GT(number(rows[79], "force_z_N"), 0.01);
  for (std::size_t step = 80; step < 90; ++step) {
    EXPECT_EQ(rows[step].at("contacts"), "0") << step;
    EXPECT_EQ(number(rows[step], "raw_z_N"), 0) << step;
  }
}

TEST_F(PlayedScene, WritesTheForcesThatTheCApiGives) {
  write_scene(kProbe);
  played("scene.toml -o out");
  const auto rows = rows_of("out/forces.csv");
  ASSERT_EQ(rows.size(), 101u);

  palpate_bundle* bundle = nullptr;
  ASSERT_EQ(palpate_bundle_open_file((folder_ / "box.h5").c_str(), nullptr, &bundle, nullptr), PALPATE_OK);
  SceneDef def;
  def.max_tools = 1;
  palpate_scene* scene = nullptr;
  ASSERT_EQ(palpate_scene_create(bundle, &def, &scene, nullptr), PALPATE_OK);
  std::vector<double> memory(palpate_contacts_bytes(scene) / sizeof(double) + 1);
  auto* contacts = reinterpret_cast<palpate_contacts*>(memory.data());
  double largest = 0;
  for (int step = 0; step <= 100; ++step) {
    const double share = step / 1000.0 / 0.1;  // the same straight line, in metres
    const double point[3] = {0.041, 0.026, 0.044 + share * (0.035 - 0.044)};
    const palpate_tool tool = point_tool(point);
    const auto flags = palpate_scene_touch(scene, &tool, 1, 1e-3, contacts, memory.size() * sizeof memory[0]);
    const Row& row = rows[step];
    EXPECT_EQ(std::stoul(row.at("flags")), flags);
    EXPECT_EQ(std::stoi(row.at("contacts")), palpate_contacts_tool(contacts, 0)->contact_count);
    const char* axes[3] = {"x", "y", "z"};
    for (int d = 0; d < 3; ++d) {
      // The path is evaluated in another order of roundings: 1e-15 of 0.04 m, over a displacement of 1e-5 m.
      const double force = palpate_contacts_tool(contacts, 0)->force[d];
      EXPECT_NEAR(number(row, std::string("force_") + axes[d] + "_N"), force, 1e-9);
      EXPECT_NEAR(number(row, std::string("raw_") + axes[d] + "_N"), palpate_contacts_tool(contacts, 0)->force_raw[d],
                  1e-9);
      EXPECT_NEAR(number(row, std::string(axes[d]) + "_m"), point[d], 1e-15);
      largest = std::max(largest, std::abs(force));
    }
  }
  EXPECT_GT(largest, 0.01);  // the scene touches at all
  palpate_scene_destroy(scene);
  palpate_bundle_close(bundle);
}

TEST_F(PlayedScene, WritesNineDigitsAndTheNamesOfFlagsBesideTheirNumber) {
  // Beside the held face; nothing touches before the probe comes down.
  write_scene("[[tool]]\nname = \"probe\"\npoints = [[0, 0, 0]]\npath = [[0, 1, 26, 44], [0.1, 1, 26, 35]]\n",
              "[effects]\ncollision = \"deformed\"\n");
  played("scene.toml -o out --digits 9");
  const std::string forces = file_bytes(folder_ / "out/forces.csv");
  EXPECT_THAT(forces, HasSubstr("0.001,probe,0.001,0.026,0.04391,0,0,0,0,0,0,0,0,,0,0,0\n"));
  EXPECT_THAT(forces, HasSubstr(",64,NOT_TOUCHABLE,"));
  EXPECT_FALSE(std::regex_search(forces, std::regex("-0[,\n]"))) << "a zero has a sign";
  EXPECT_FALSE(std::regex_search(forces, std::regex("[1-9]\\.?[0-9]{9}"))) << "a number has ten digits";
  EXPECT_FALSE(std::regex_search(file_bytes(folder_ / "out/summary.json"), std::regex("-0\\.0\\b")));
  played("scene.toml -o out");
  std::size_t most = 0;
  for (const Row& row : rows_of("out/forces.csv")) most = std::max(most, row.at("raw_z_N").size());
  EXPECT_GT(most, 14u) << "all digits, where they are asked for";
}

TEST_F(PlayedScene, WritesLengthsInTheUnitThatTheSceneAsksFor) {
  const std::string suture =
      "[[link]]\nname = \"suture\"\nkind = \"spring\"\nplaces = [[60, 25, 20]]\nworld = [100, 25, 20]\nrest_length = "
      "30\n"
      "stiffness = 20\n";
  write_scene(kProbe + suture);
  played("scene.toml -o out");
  write_scene(kProbe + suture, "csv_unit = \"mm\"\n");
  played("scene.toml -o mm --record run.record");
  for (const char* file : {"forces.csv", "contacts.csv", "links.csv"}) {
    const auto in_m = rows_of(std::string("out/") + file), in_mm = rows_of(std::string("mm/") + file);
    ASSERT_EQ(in_m.size(), in_mm.size());
    for (std::size_t r = 0; r < in_m.size(); ++r) {
      ASSERT_EQ(in_m[r].size(), in_mm[r].size());
      for (const auto& [name, cell] : in_m[r])
        if (name.ends_with("_m") && !name.starts_with("modified_"))
          EXPECT_DOUBLE_EQ(number(in_mm[r], name.substr(0, name.size() - 1) + "mm"), number(in_m[r], name) / 1e-3);
        else
          EXPECT_EQ(in_mm[r].at(name), cell) << name;
    }
  }
  EXPECT_DOUBLE_EQ(number(rows_of("mm/forces.csv").front(), "z_mm"), 44);
  EXPECT_EQ(summary_of("mm")["largest_displacement_m"], summary_of("out")["largest_displacement_m"]);
  played("run.record -o again");
  EXPECT_EQ(file_bytes(folder_ / "again/links.csv"), file_bytes(folder_ / "mm/links.csv"))
      << "the record keeps the unit";
}

// The scene on the box's top that is 5 mm deep is deeper than a tenth of 40 mm.
const std::string kAcceptsSixMillimetres = "[limits]\ndisplacement = 0.006\n";

TEST_F(PlayedScene, WarnsOfAToolThatNeverTouchedWithTheLeastDistanceAndWhere) {
  // Ends 26 mm beside the box and 4 mm below its top, level with y = 0: the nearest place is on the box's edge.
  write_scene(
      "[[tool]]\nname = \"probe\"\npoints = [[0, 0, 1]]\npath = [[0, 41, -26, 44], [0.1, 41, -26, 35], [0.2, 41, -30, "
      "30]]\n");
  const ProgramRun missed = played("scene.toml -o out");
  const std::string sentence = "tool \"probe\" never touched";
  EXPECT_THAT(missed.errors, HasSubstr("warning: " + sentence));
  // The first step at which the point is level with the box, whose top is at z = 40.
  EXPECT_THAT(missed.errors, testing::AllOf(HasSubstr(" 26 mm "), HasSubstr("0.056 s"),
                                            HasSubstr("[41, -26, 39.96] mm"), HasSubstr("[41, 0, 39.96] mm")));
  const auto summary = summary_of();
  ASSERT_EQ(summary["warnings"].size(), 1u) << summary["warnings"];
  EXPECT_THAT(std::string(summary["warnings"][0]), HasSubstr(sentence));

  write_scene("[[tool]]\nname = \"probe\"\npoints = [[0, 0, 0]]\npath = [[0, 41, 26, 4400], [1, 41, 26, 3500]]\n");
  EXPECT_THAT(run("scene.toml -o out").errors, testing::AllOf(HasSubstr("3460 mm"), HasSubstr("`unit`")));
  // A grip is no touch of the tool's points.
  write_scene(
      "[[tool]]\nname = \"both\"\npoints = [[0, 0, 0]]\npath = [[0, 30, 25, 60], [0.1, 30, 25, 59]]\n[[tool.grip]]\n"
      "nearest = [60, 50, 40]\n");
  EXPECT_THAT(run("scene.toml -o out").errors, HasSubstr("tool \"both\" never touched"));
  write_scene(kProbe, "[effects]\ncollision = \"off\"\n");
  EXPECT_THAT(run("scene.toml -o off").errors, HasSubstr("only where collision"));
}

TEST_F(PlayedScene, WarnsOfNothingWhereAToolTouchesWithinTheLimits) {
  write_scene(kProbe, kAcceptsSixMillimetres);
  const ProgramRun touched = played("scene.toml -o touched --strict");
  EXPECT_THAT(touched.errors, testing::Not(HasSubstr("warning")));
  EXPECT_THAT(touched.errors, HasSubstr("note: tool \"probe\": largest force "));
  EXPECT_EQ(summary_of("touched")["warnings"], nlohmann::json::array());
}

TEST_F(PlayedScene, WarnsOfAToolThatBeganInside) {
  const std::string tool = "[[tool]]\nname = \"probe\"\npoints = [[0, 0, 5], [0, 0, -7]]\n";
  write_scene(tool + "path = [[0, 41, 26, 37], [0.1, 41, 26, 36]]\n");
  const std::string sentence = "warning: tool \"probe\" began inside the organ";
  const ProgramRun ended = run("scene.toml -o out");
  EXPECT_THAT(ended.errors,
              testing::AllOf(HasSubstr(sentence), HasSubstr("point 1 begins 10 mm deep, at [41, 26, 30] mm"),
                             HasSubstr("none of this tool's did")));
  EXPECT_THAT(ended.errors, testing::Not(HasSubstr("never touched")));  // one sentence for one cause
  // Out and in again: it touches, and the sentence stays.
  write_scene(tool + "path = [[0, 41, 26, 37], [0.1, 41, 26, 60], [0.2, 41, 26, 45]]\n", kAcceptsSixMillimetres);
  EXPECT_THAT(run("scene.toml -o out").errors,
              testing::AllOf(HasSubstr(sentence), testing::Not(HasSubstr("none of this tool's did"))));
}

TEST_F(PlayedScene, WarnsOfAGripFartherThanAnEdgeFromTheOrgan) {
  const auto grip = [&](const std::string& place) {
    write_scene("[[tool]]\nname = \"clamp\"\npath = [[0, 0, 0, 0], [0.1, 0, 0, 1]]\n[[tool.grip]]\nnearest = " + place +
                "\n");
    return run("scene.toml -o out").errors;
  };
  EXPECT_THAT(grip("[60, 50, 340]"), HasSubstr("scene.toml:7: the grip of tool \"clamp\" is 300 mm "));
  EXPECT_THAT(grip("[60, 50, 50]"), testing::Not(HasSubstr("warning")));  // the edges there are 13 to 29 mm long
}

TEST_F(PlayedScene, WarnsOfADisplacementBeyondLinearElasticity) {
  write_scene(kProbe);
  EXPECT_THAT(run("scene.toml -o out").errors, testing::ContainsRegex("warning: the organ .* 0.1 s.* 4 mm "));
  write_scene(kProbe, "[limits]\ndisplacement = 0.001\n");
  EXPECT_THAT(run("scene.toml -o out").errors, HasSubstr("1 mm that `displacement`"));
  // The bundle's own figure wins over 10 mm.
  BundleParts parts = tiny_bundle();
  parts.provenance.insert(1, "\"accuracy_linear_limit_mm\":3.5,");
  write_bundle(folder_ / "box.h5", parts);
  write_scene(kProbe);
  EXPECT_THAT(run("scene.toml -o out").errors, HasSubstr("beyond the 3.5 mm"));
}

TEST_F(PlayedScene, KnowsNoLimitOfLinearElasticityUnderLargeDeformation) {
  BundleParts parts = tiny_bundle();
  add_large_deformation(parts, {0});
  write_bundle(folder_ / "box.h5", parts);
  write_scene(kProbe, "[effects]\ndeformation = \"large\"\n");
  const ProgramRun ended = played("scene.toml -o out");
  EXPECT_THAT(ended.errors, testing::Not(HasSubstr("linear elasticity")));
  write_scene(kProbe, "[effects]\ndeformation = \"large\"\n[limits]\ndisplacement = 0.001\n");
  EXPECT_THAT(run("scene.toml -o out").errors, HasSubstr("1 mm that `displacement`"));
}

std::size_t times(const std::string& part, const std::string& text) {
  std::size_t count = 0;
  for (std::size_t at = 0; (at = text.find(part, at)) != std::string::npos; at += part.size()) ++count;
  return count;
}

// 2,000 operations have no room for a step of large deformation.
TEST_F(PlayedScene, ExplainsThatLargeDeformationTakesItsStepsWhateverTheLimitSays) {
  BundleParts parts = tiny_bundle();
  add_large_deformation(parts, {0});
  add_everything(parts);  // a preload, which this scene leaves out
  write_bundle(folder_ / "box.h5", parts);
  const std::string large = "[effects]\ncollision = \"off\"\ndeformation = \"large\"\n",
                    note = "\nscene: deformation LARGE takes up to 3 steps in a touch, ";
  write_scene(kProbe, large + "[limits]\noperations = 2000\n");
  const ProgramRun ended = played("scene.toml --explain --strict");
  EXPECT_EQ(times(note, ended.out), 1u) << ended.out;
  EXPECT_THAT(ended.errors, testing::Not(HasSubstr("preload")));
  EXPECT_THAT(run("scene.toml -o out").errors, testing::Not(HasSubstr("scene:")));  // notes are of the plan alone
  write_scene(kProbe, large + "[limits]\noperations = 100000000\n");
  EXPECT_EQ(times(note, run("scene.toml --explain").out), 0u);
}

TEST_F(PlayedScene, WarnsOnceOfWhatTheLibraryWarnsOf) {
  BundleParts parts = tiny_bundle();
  store_as_f16(parts);
  write_bundle(folder_ / "box.h5", parts);
  write_scene(kProbe, "[limits]\npoints = 300\ndisplacement = 0.006\n");
  const std::string warning = "scene: the tensors have half precision, too coarse for 300 contacts at once";
  for (const std::string how : {"-o out", "--explain", "--realtime --rate 500 --seconds 0.1 -o clock"}) {
    const ProgramRun ended = run("scene.toml --strict " + how);
    EXPECT_EQ(ended.code, 3) << how << ended.errors;
    EXPECT_EQ(times("warning: " + warning, ended.errors), 1u) << how << ended.errors;
  }
  for (const char* folder : {"out", "clock"}) {
    const auto told = summary_of(folder)["warnings"].dump();
    EXPECT_EQ(times(warning, told), 1u) << told;
  }
}

TEST_F(PlayedScene, SolvesLargeDeformationBesideTheTouchAtItsRate) {
  BundleParts parts = tiny_bundle();
  add_large_deformation(parts, {0});
  write_bundle(folder_ / "box.h5", parts);
  const auto forces_at = [&](const std::string& rate) {
    write_scene(kProbe, "[effects]\ndeformation = \"large-beside\"\n[rate]\n" + rate);
    played("scene.toml -o out");
    const std::string forces = file_bytes(folder_ / "out/forces.csv");
    const auto summary = summary_of();
    EXPECT_EQ(summary["deform_hz"], rate == "deform = 200\n" ? 200 : 50);
    EXPECT_TRUE(summary["timing_us"].contains("deform"));
    return forces;
  };
  const std::string often = forces_at("deform = 200\n");
  EXPECT_EQ(often, forces_at("deform = 200\n")) << "a run is not the same twice";
  EXPECT_NE(often, forces_at("deform = 50\n"));
  EXPECT_THAT(run("scene.toml --explain").out, HasSubstr("deformation: large-beside"));
  EXPECT_THAT(run("scene.toml --realtime --rate 500 --seconds 0.2 -o clock").out, HasSubstr("solve beside touch"));
  std::filesystem::remove_all(folder_ / "out");
  write_scene(kProbe, "[effects]\ndeformation = \"large-beside\"\n[rate]\ndeform = 2000\n");
  expect_refused("scene.toml -o out", "1000 Hz");
}

TEST_F(PlayedScene, PlaysTheModelThatLargeAutoStandsFor) {
  BundleParts parts = tiny_bundle();
  add_large_deformation(parts, {0});
  write_bundle(folder_ / "box.h5", parts);
  const auto forces_of = [&](const std::string& deformation) {
    write_scene(kProbe, "[effects]\ndeformation = \"" + deformation + "\"\n");
    played("scene.toml -o out");
    EXPECT_FALSE(summary_of()["timing_us"].contains("deform"));
    return file_bytes(folder_ / "out/forces.csv");
  };
  EXPECT_EQ(forces_of("large-auto"), forces_of("large"));
  EXPECT_THAT(run("scene.toml --explain").out, HasSubstr("deformation: large, "));
}

TEST_F(PlayedScene, WarnsOfTenMillimetresOnALargeOrganWithoutAFigureOfItsOwn) {
  write_bundle(folder_ / "box.h5", tiny_bundle({.size = {0.3, 0.25, 0.2}}));
  const auto pressed_to = [&](const std::string& z) {
    write_scene("[[tool]]\nname = \"probe\"\npoints = [[0, 0, 0]]\npath = [[0, 205, 130, 201], [0.1, 205, 130, " + z +
                "]]\n");
    return run("scene.toml -o out").errors;
  };
  EXPECT_THAT(pressed_to("185"), HasSubstr("beyond the 10 mm"));
  EXPECT_THAT(pressed_to("199"), testing::Not(HasSubstr("warning")));
}

TEST_F(PlayedScene, WarnsOfAnOrganThatIsNoOrgansSize) {
  const auto warned_of = [&](double scale) {
    write_bundle(folder_ / "box.h5", tiny_bundle({.size = {0.06 * scale, 0.05 * scale, 0.04 * scale}}));
    write_scene("[[tool]]\nname = \"clamp\"\npath = [[0, 0, 0, 0]]\n[[tool.grip]]\nnearest = [" +
                std::to_string(60 * scale) + ", 0, 0]\n");
    return run("scene.toml -o out").errors;
  };
  EXPECT_THAT(warned_of(1000), testing::AllOf(HasSubstr("60 m long"), HasSubstr("mesh_unit")));
  EXPECT_THAT(warned_of(0.1), HasSubstr("0.006 m long"));
  EXPECT_THAT(warned_of(1), testing::Not(HasSubstr("warning")));
}

TEST_F(PlayedScene, NamesTheStepFlagsThatWereRaisedWithTheirCount) {
  write_scene(kProbe, "[limits]\nforce = 1e-3\ndisplacement = 0.006\n");
  const ProgramRun ended = run("scene.toml -o out");
  const auto summary = summary_of();
  const int count = summary["touches_with_flag"]["FORCE_LIMITED"];
  EXPECT_GT(count, 0);
  const std::string sentence = std::to_string(count) + " of 101 touches raised FORCE_LIMITED";
  EXPECT_THAT(ended.errors, HasSubstr("warning: " + sentence));
  ASSERT_EQ(summary["warnings"].size(), 1u) << summary["warnings"];
  EXPECT_THAT(std::string(summary["warnings"][0]), testing::StartsWith(sentence));
  const ProgramRun realtime = run("scene.toml -o clock --realtime --seconds 0.3 --rate 1000");
  EXPECT_THAT(realtime.errors, testing::ContainsRegex("warning: .* 1000 Hz .*FORCE_LIMITED"));
  EXPECT_EQ(summary_of("clock")["warnings"].size(), 1u);
}

TEST_F(PlayedScene, CountsTheFlagsOfShapes) {
  BundleParts parts = tiny_bundle();
  parts.set(formats::SectionId::response_radial, {2}, std::vector<double>{0.5e-3, 0.5e-3});
  parts.set(formats::SectionId::response_force, {2}, std::vector<double>{0.5e-3, 0.5e-3});
  parts.set(formats::SectionId::response_range, {2}, std::vector<double>{1e-3, 1e-3});
  write_bundle(folder_ / "box.h5", parts);
  write_scene(kProbe, "[effects]\nradial = \"response\"\n" + kAcceptsSixMillimetres);
  EXPECT_THAT(run("scene.toml -o out").errors, testing::ContainsRegex("warning: [1-7] of 7 .*RESPONSE_RANGE"));
  EXPECT_TRUE(summary_of()["shapes_with_flag"].contains("RESPONSE_RANGE"));
}

TEST_F(PlayedScene, MakesWarningsErrorsUnderStrictAndWritesTheResultsAllTheSame) {
  write_scene(kProbe);
  const ProgramRun ended = run("scene.toml -o out --strict");
  EXPECT_EQ(ended.code, 3);
  EXPECT_THAT(ended.errors, HasSubstr("palpate-run: --strict: "));
  EXPECT_TRUE(fs::exists(folder_ / "out/forces.csv"));
}

TEST_F(PlayedScene, HasContactNodesForEveryNumberOfPointsThatASceneMayHave) {
  // Three for each would be more than palpate.h allows.
  write_scene(kProbe, "[limits]\npoints = 1001\n");
  played("scene.toml -o out");
}

TEST_F(PlayedScene, WritesTheSameBytesTwiceButForTimings) {
  write_scene(kProbe);
  played("scene.toml -o one");
  played("scene.toml -o two");
  int files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder_ / "one")) {
    if (!entry.is_regular_file() || entry.path().filename() == "summary.json") continue;
    EXPECT_EQ(file_bytes(entry.path()), file_bytes(folder_ / "two" / fs::relative(entry.path(), folder_ / "one")));
    ++files;
  }
  EXPECT_EQ(files, 3 + 2 * 7);  // two CSV, one PVD; 0.1 s at 60 Hz: frames 0 .. 6, organ and tools
  auto one = summary_of("one");
  auto two = summary_of("two");
  EXPECT_GT(one["timing_us"]["touch"]["max"], 0);
  one.erase("timing_us");
  two.erase("timing_us");
  EXPECT_EQ(one, two);
}

vtkNew<vtkUnstructuredGrid> read_grid(const fs::path& file) {
  vtkNew<vtkXMLUnstructuredGridReader> reader;
  reader->SetFileName(file.c_str());
  reader->Update();
  vtkNew<vtkUnstructuredGrid> grid;
  grid->ShallowCopy(reader->GetOutput());
  return grid;
}

TEST_F(PlayedScene, WritesShapesThatVtkReadsWithThePositionsOfTheContact) {
  write_scene(kProbe, "[effects]\nshape = \"volume\"\n");
  played("scene.toml -o out");
  const std::string pvd = file_bytes(folder_ / "out/shapes.pvd");
  EXPECT_THAT(pvd, HasSubstr("<DataSet timestep=\"0.1\" part=\"0\" file=\"shapes/organ_000006.vtu\"/>"));

  const auto organ = read_grid(folder_ / "out/shapes/organ_000006.vtu");
  const BundleParts parts = tiny_bundle();
  const auto nodes = parts.get<double>(formats::SectionId::nodes);
  ASSERT_EQ(organ->GetNumberOfPoints() * 3, static_cast<vtkIdType>(nodes.size()));
  EXPECT_EQ(organ->GetNumberOfCells() * 4,
            static_cast<vtkIdType>(parts.get<std::int32_t>(formats::SectionId::tetrahedra).size()));
  EXPECT_EQ(organ->GetCellData()->GetArray("region")->GetNumberOfTuples(), organ->GetNumberOfCells());

  auto* displacement = organ->GetPointData()->GetArray("displacement");
  auto* fixed = organ->GetPointData()->GetArray("fixed");
  double force[3] = {0, 0, 0}, largest = 0;
  for (vtkIdType n = 0; n < organ->GetNumberOfPoints(); ++n) {
    for (int d = 0; d < 3; ++d) {
      // f32 positions of 0.06 m: half a unit in the last place is 2e-9 m.
      EXPECT_NEAR(organ->GetPoint(n)[d], nodes[3 * n + d] + displacement->GetComponent(n, d), 8e-9);
      force[d] += organ->GetPointData()->GetArray("contact_force")->GetComponent(n, d);
      largest = std::max(largest, std::abs(displacement->GetComponent(n, d)));
    }
    EXPECT_EQ(fixed->GetTuple1(n), nodes[3 * n] == 0.0 ? 1 : 0);
  }
  EXPECT_GT(largest, 3e-3);  // the probe went about 5 mm in
  const auto rows = rows_of("out/forces.csv");
  EXPECT_NEAR(force[2], -number(rows.back(), "raw_z_N"), 1e-12);  // the organ feels what the tool does not

  const auto tools = read_grid(folder_ / "out/shapes/tools_000006.vtu");
  ASSERT_EQ(tools->GetNumberOfPoints(), 1);
  EXPECT_NEAR(tools->GetPoint(0)[2], 0.035, 1e-15);
  EXPECT_EQ(tools->GetPointData()->GetArray("force")->GetComponent(0, 2), number(rows.back(), "force_z_N"));
}

// The box's own surface as a render mesh: it goes where the nodes go.
std::string ply_of(const BundleParts& parts, const std::string& unit = "mm") {
  const auto nodes = parts.get<double>(formats::SectionId::nodes);
  const auto triangles = parts.get<std::int32_t>(formats::SectionId::triangles);
  const double scale = unit == "mm" ? 1000 : 1;
  std::ostringstream text;
  text << "ply\nformat ascii 1.0\nelement vertex " << nodes.size() / 3
       << "\nproperty double x\nproperty double y\nproperty double z\nelement face " << triangles.size() / 3
       << "\nproperty list uchar int vertex_indices\nend_header\n";
  for (std::size_t i = 0; i < nodes.size(); ++i) text << scale * nodes[i] << (i % 3 == 2 ? "\n" : " ");
  for (std::size_t i = 0; i < triangles.size(); ++i)
    text << (i % 3 ? " " : "3 ") << triangles[i] << (i % 3 == 2 ? "\n" : "");
  return text.str();
}

TEST_F(PlayedScene, MovesARenderMeshWithTheOrganInEveryUnit) {
  write_scene(kProbe);
  const BundleParts parts = tiny_bundle();
  for (const std::string unit : {"mm", "m"}) {
    std::ofstream(folder_ / "fine.ply") << ply_of(parts, unit);
    played("scene.toml -o out --render-mesh fine.ply" + (unit == "mm" ? "" : " --render-unit " + unit));
    EXPECT_THAT(file_bytes(folder_ / "out/shapes.pvd"), HasSubstr("part=\"2\" file=\"shapes/skin_000006.vtu\""));
    const auto organ = read_grid(folder_ / "out/shapes/organ_000006.vtu"),
               skin = read_grid(folder_ / "out/shapes/skin_000006.vtu");
    EXPECT_EQ(skin->GetNumberOfPoints() * 3,
              static_cast<vtkIdType>(parts.get<double>(formats::SectionId::nodes).size()));
    EXPECT_EQ(skin->GetNumberOfCells(), organ->GetNumberOfCells());
    double largest = 0;
    for (vtkIdType n = 0; n < organ->GetNumberOfPoints(); ++n)
      for (int d = 0; d < 3; ++d) {
        EXPECT_NEAR(skin->GetPoint(n)[d], organ->GetPoint(n)[d], 1e-7);  // six digits of 60 mm in the text
        largest = std::max(largest, std::abs(skin->GetPointData()->GetArray("displacement")->GetComponent(n, d)));
      }
    EXPECT_GT(largest, 3e-3);
    const auto summary = summary_of();
    EXPECT_GT(summary["timing_us"]["skin"]["max"], 0);
  }
  EXPECT_THAT(run("scene.toml --explain --render-mesh fine.ply --render-unit m").out,
              HasSubstr("shape   skin: render mesh"));
}

TEST_F(PlayedScene, SinksARenderMeshToTheDiscsOfTheTools) {
  std::ofstream(folder_ / "fine.ply") << ply_of(tiny_bundle(), "m");
  const std::string tool =
      "[[tool]]\nname = \"probe\"\npoints = [[0, 0, 0]]\ndisc_radius = 3\n"
      "path = [[0, 33, 24, 42], [0.1, 33, 24, 36]]\n";
  const auto last_skin = [&](const std::string& dent) {
    write_scene(tool, "[effects]\ncontact = \"patch\"\n" + dent);
    played("scene.toml -o out --render-mesh fine.ply --render-unit m");
    return read_grid(folder_ / "out/shapes/skin_000006.vtu");
  };
  const auto off = last_skin("");
  const std::string forces = file_bytes(folder_ / "out/forces.csv");
  const auto with = last_skin("dent = \"discs\"\n");
  EXPECT_EQ(file_bytes(folder_ / "out/forces.csv"), forces) << "what is drawn changes no force";
  double deepest = 0;
  for (vtkIdType n = 0; n < off->GetNumberOfPoints(); ++n)
    deepest = std::max(deepest, off->GetPoint(n)[2] - with->GetPoint(n)[2]);
  EXPECT_GT(deepest, 1e-4);
  EXPECT_THAT(run("scene.toml --explain --render-mesh fine.ply --render-unit m").out, HasSubstr("shape   dent: discs"));
  std::filesystem::remove_all(folder_ / "out");  // a refused run makes none
  expect_refused("scene.toml -o out", "effects.dent: ");
  write_scene(kProbe, "[effects]\ndent = \"discs\"\n");
  expect_refused("scene.toml -o out --render-mesh fine.ply --render-unit m", "a tool with a disc_radius");
}

TEST_F(PlayedScene, RefusesARenderMeshThatIsNone) {
  write_scene(kProbe);
  const std::string good = ply_of(tiny_bundle());
  std::ofstream(folder_ / "cut.ply") << good.substr(0, good.size() / 2);
  std::ofstream(folder_ / "points.ply") << "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float "
                                           "y\nproperty float z\nend_header\n1 2 3\n";
  std::ofstream(folder_ / "good.ply") << good;
  expect_refused("scene.toml -o out --render-mesh none.ply", "none.ply: ");
  expect_refused("scene.toml -o out --render-mesh cut.ply", "cut.ply: 108");
  expect_refused("scene.toml -o out --render-mesh points.ply", "points.ply: ");
  expect_refused("scene.toml -o out --render-mesh good.ply --render-unit m", "give metres");
  expect_refused("scene.toml -o out --render-mesh good.ply --render-unit mile", "mile");
  expect_refused("scene.toml -o out --render-unit m", "--render-mesh");
  expect_refused("scene.toml -o out --realtime --render-mesh good.ply", "--render-mesh");
}

TEST_F(PlayedScene, MovesGripsOnlyAlongTheirAxes) {
  write_scene(
      "[[tool]]\nname = \"plate\"\npath = [[0, 9, 9, 9], [0.1, 9, 9, 7]]\n[[tool.grip]]\n"
      "box = { min = [50, -1, 39], max = [61, 51, 41] }\naxes = \"z\"\n",
      "[effects]\ncollision = \"off\"\n[rate]\ntouch = 100\nshape = 10\n");
  played("scene.toml -o out");
  std::vector<Row> last;
  for (const Row& row : rows_of("out/contacts.csv"))
    if (row.at("time_s") == "0.1") last.push_back(row);
  ASSERT_EQ(last.size(), 4u);  // the edge x = 60, z = 40 of a box of 3 x 3 x 3 cells
  for (const Row& row : last) {
    EXPECT_EQ(number(row, "force_x_N"), 0);
    EXPECT_EQ(number(row, "force_y_N"), 0);
    EXPECT_LT(number(row, "force_z_N"), 0);  // held down by 2 mm
  }
  const auto organ = read_grid(folder_ / "out/shapes/organ_000001.vtu");
  for (const Row& row : last)
    EXPECT_NEAR(organ->GetPointData()->GetArray("displacement")->GetComponent(std::stoi(row.at("node")), 2), -0.002,
                2e-8);  // tensors in f32: 1e-5 of 2 mm
}

TEST_F(PlayedScene, TellsWhereTheSurfacePassesThroughItself) {
  // A node of the top and the one below it, 40 mm apart, are pushed past one another.
  const auto pushed = [](const char* name, const char* node, const char* to) {
    return fmt::format(
        "[[tool]]\nname = \"{}\"\npath = [[0, 0, 0, 0], [0.06, 0, 0, {}], [0.1, 0, 0, {}]]\n[[tool.grip]]\nnearest = "
        "{}\n",
        name, to, to, node);
  };
  const std::string push = pushed("down", "[40, 33, 40]", "-30") + pushed("up", "[40, 33, 0]", "30");
  const std::string effects = "[effects]\ncollision = \"off\"\ncrossings = true\n[rate]\ntouch = 1000\nshape = 100\n";
  write_scene(push, effects + "[limits]\ncrossings_calls = 1\ncrossings_operations = 1000000\n");
  const ProgramRun ended = played("scene.toml -o out");
  EXPECT_THAT(ended.errors, HasSubstr("the surface passes through itself from"));
  const auto summary = summary_of();
  EXPECT_GT(summary["shapes_with_flag"]["SURFACE_CROSSES"], 3);
  EXPECT_EQ(summary["crossings"]["checks"], summary["shapes"]);
  EXPECT_GT(summary["crossings"]["most_pairs"], 0);
  const double first = summary["crossings"]["first_s"];
  EXPECT_GT(first, 0.03) << "10 mm are left between the two";
  EXPECT_LE(first, 0.06);
  EXPECT_NEAR(summary["crossings"]["place_m"][2].get<double>(), 0.02, 0.01) << "in the middle";
  EXPECT_GT(summary["timing_us"]["crossings"]["p50"], 0);
  const auto marked = [&](const char* file) {
    double sum = 0;
    const auto organ = read_grid(folder_ / "out/shapes" / file);
    for (vtkIdType n = 0; n < organ->GetNumberOfPoints(); ++n)
      sum += organ->GetPointData()->GetArray("crosses")->GetTuple1(n);
    return sum;
  };
  EXPECT_EQ(marked("organ_000000.vtu"), 0);
  EXPECT_GT(marked("organ_000010.vtu"), 3);
  EXPECT_THAT(run("scene.toml --explain").out, HasSubstr("crossings: surface against itself"));

  write_scene(push, "[effects]\ncollision = \"off\"\n");
  played("scene.toml -o out");
  EXPECT_FALSE(summary_of().contains("crossings"));
  EXPECT_EQ(read_grid(folder_ / "out/shapes/organ_000000.vtu")->GetPointData()->GetArray("crosses"), nullptr);
  write_scene(push, "[effects]\ncollision = \"off\"\nshape = \"off\"\ncrossings = true\n");
  fs::remove_all(folder_ / "out");
  expect_refused("scene.toml -o out", "shape SURFACE or VOLUME");
}

TEST_F(PlayedScene, WritesStrainAndStressOfTheVolumeAndCarriesSurfaces) {
  const BundleParts parts = tiny_bundle();
  std::ofstream(folder_ / "tumour.ply") << ply_of(parts);
  const std::string effects = "[effects]\nshape = \"volume\"\ninside = true\n";
  const std::string carried = "[[carried]]\nname = \"tumour\"\nfile = \"tumour.ply\"\nwithin = 0.001\n";
  write_scene(carried + kProbe, effects);
  played("scene.toml -o out");
  EXPECT_THAT(file_bytes(folder_ / "out/shapes.pvd"),
              HasSubstr("part=\"2\" file=\"shapes/carried_tumour_000006.vtu\""));
  const auto organ = read_grid(folder_ / "out/shapes/organ_000006.vtu"),
             tumour = read_grid(folder_ / "out/shapes/carried_tumour_000006.vtu");
  const auto array = [&](const char* name) { return organ->GetPointData()->GetArray(name); };
  // The vertices are the organ's nodes, of six digits in the text.
  ASSERT_EQ(tumour->GetNumberOfPoints(), organ->GetNumberOfPoints());
  for (vtkIdType n = 0; n < organ->GetNumberOfPoints(); ++n)
    for (int d = 0; d < 3; ++d) {
      EXPECT_NEAR(tumour->GetPoint(n)[d], organ->GetPoint(n)[d], 1e-7);
      EXPECT_NEAR(tumour->GetPointData()->GetArray("displacement")->GetComponent(n, d),
                  array("displacement")->GetComponent(n, d), 1e-7);
    }
  for (const char* tensor : {"strain", "stress"}) {
    ASSERT_EQ(array(tensor)->GetNumberOfComponents(), 6) << tensor;
    EXPECT_STREQ(array(tensor)->GetComponentName(5), "XZ");
  }
  double most = 0;
  for (vtkIdType n = 0; n < organ->GetNumberOfPoints(); ++n) {
    double s[6], e[6], principal[3];
    array("stress")->GetTuple(n, s), array("strain")->GetTuple(n, e), array("principal_stress")->GetTuple(n, principal);
    const double von_mises = array("von_mises")->GetTuple1(n), pressure = array("pressure")->GetTuple1(n);
    // Single precision, of stresses up to some 1,000 Pa.
    EXPECT_NEAR(pressure, -(s[0] + s[1] + s[2]) / 3, 1e-3);
    EXPECT_NEAR(principal[0] + principal[1] + principal[2], s[0] + s[1] + s[2], 1e-2);
    EXPECT_NEAR(von_mises,
                std::sqrt(0.5 * (std::pow(s[0] - s[1], 2) + std::pow(s[1] - s[2], 2) + std::pow(s[2] - s[0], 2)) +
                          3 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5])),
                1e-2);
    EXPECT_NEAR(s[3], 5400 / 1.45 * e[3], 1e-2) << "2 mu of the strain";
    most = std::max(most, von_mises);
  }
  EXPECT_GT(most, 100);
  EXPECT_GT(summary_of()["timing_us"]["inside"]["p50"], 0);
  const ProgramRun explained = played("scene.toml --explain");
  EXPECT_THAT(explained.out, HasSubstr("inside: strain and stress"));
  // What does not fit together.
  fs::remove_all(folder_ / "out");
  write_scene(kProbe, "[effects]\ninside = true\n");
  expect_refused("scene.toml -o out", "beside inside = true");
  write_scene(carried + kProbe, "[effects]\nshape = \"volume\"\n");
  expect_refused("scene.toml -o out", "since \"tumour\"");
  write_scene(carried + carried + kProbe, effects);
  expect_refused("scene.toml -o out", "no other [[carried]]");
  std::ofstream(folder_ / "tumour.ply") << ply_of(parts, "m");  // read as mm: a speck at the origin, on the surface
  write_scene(carried + kProbe, effects);
  played("scene.toml -o speck");
  std::ofstream(folder_ / "far.ply")
      << "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double z\n"
         "element face 1\nproperty list uchar int vertex_indices\nend_header\n10 10 10\n20 20 20\n10 10 -7\n3 0 1 2\n";
  write_scene("[[carried]]\nname = \"far\"\nfile = \"far.ply\"\nwithin = 5\n" + kProbe, effects);
  expect_refused("scene.toml -o out", "vertex 2 at 10 10 -7 mm by 7 mm");
}

TEST_F(PlayedScene, TensorsAndCarriedSurfacesOfATurnedOrganAreInTheWorldsFrame) {
  std::ofstream(folder_ / "tumour.ply") << ply_of(tiny_bundle());
  const auto play = [&](const std::string& turn, const std::string& path, const std::string& out) {
    std::ofstream(folder_ / "scene.toml")
        << "name = \"test\"\nunit = \"mm\"\n[effects]\nshape = \"volume\"\ninside = true\n[[organ]]\nname = \"box\"\n"
           "bundle = \"box.h5\"\nturn = "
        << turn << "\n[[carried]]\nname = \"tumour\"\norgan = \"box\"\nfile = \"tumour.ply\"\nwithin = 0.001\n"
        << "[[tool]]\nname = \"probe\"\npoints = [[0, 0, 0]]\npath = " << path << "\n";
    played("scene.toml -o " + out);
    return folder_ / out / "shapes";
  };
  const auto plain = play("[0, 0, 0]", "[[0, 41, 26, 44], [0.1, 41, 26, 35]]", "plain");
  // A quarter turn about x: y becomes z, and z becomes -y.
  const auto turned = play("[90, 0, 0]", "[[0, 41, -44, 26], [0.1, 41, -35, 26]]", "turned");
  const auto before = read_grid(plain / "organ_box_000006.vtu"), after = read_grid(turned / "organ_box_000006.vtu");
  double largest = 0;
  for (const char* tensor : {"strain", "stress"})
    for (vtkIdType n = 0; n < before->GetNumberOfPoints(); ++n) {
      double a[6], b[6];
      before->GetPointData()->GetArray(tensor)->GetTuple(n, a), after->GetPointData()->GetArray(tensor)->GetTuple(n, b);
      const double expected[6] = {a[0], a[2], a[1], -a[5], -a[4], a[3]};
      // The two runs round differently, as does the turn.
      for (int i = 0; i < 6; ++i) ASSERT_NEAR(b[i], expected[i], 1e-4 * (std::string(tensor) == "stress" ? 1000 : 1));
      largest = std::max(largest, std::abs(a[5]));
    }
  EXPECT_GT(largest, 10);
  const auto from = read_grid(plain / "carried_tumour_box_000006.vtu"),
             to = read_grid(turned / "carried_tumour_box_000006.vtu");
  for (vtkIdType n = 0; n < from->GetNumberOfPoints(); ++n) {
    EXPECT_NEAR(to->GetPoint(n)[0], from->GetPoint(n)[0], 1e-7);
    EXPECT_NEAR(to->GetPoint(n)[1], -from->GetPoint(n)[2], 1e-7);
    EXPECT_NEAR(to->GetPoint(n)[2], from->GetPoint(n)[1], 1e-7);
  }
}

TEST_F(PlayedScene, WithoutShapeWritesNoShapes) {
  write_scene(kProbe, "[effects]\nshape = \"off\"\n");
  played("scene.toml -o out");
  EXPECT_FALSE(fs::exists(folder_ / "out/shapes"));
  EXPECT_EQ(rows_of("out/forces.csv").size(), 101u);
}

TEST_F(PlayedScene, WritesEveryNthShape) {
  write_scene(kProbe);
  played("scene.toml -o out --every 3");
  const auto summary = summary_of();
  EXPECT_EQ(summary["shapes"], 7);
  EXPECT_EQ(summary["shapes_written"], 3);
}

TEST_F(PlayedScene, ReplacesAnEarlierRunsFolderAndNoOther) {
  write_scene(kProbe);
  played("scene.toml -o out");
  played("scene.toml -o out/");
  EXPECT_FALSE(fs::exists(folder_ / "out.part"));
  std::ofstream(folder_ / "out/thesis.txt") << "mine";
  const ProgramRun ended = run("scene.toml -o out");
  EXPECT_EQ(ended.code, 2);
  EXPECT_THAT(ended.errors, HasSubstr("thesis.txt"));
  EXPECT_EQ(file_bytes(folder_ / "out/thesis.txt"), "mine");
}

TEST_F(PlayedScene, TakesUpAfterAKilledRun) {
  write_scene(kProbe);
  fs::create_directories(folder_ / "out.part/shapes");
  std::ofstream(folder_ / "out.part/forces.csv") << "half";
  played("scene.toml -o out");
  EXPECT_FALSE(fs::exists(folder_ / "out.part"));
}

TEST_F(PlayedScene, RefusesWhatItCannotPlayInOneSentence) {
  write_scene(kProbe);
  expect_refused("none.toml -o out", "none.toml");
  expect_refused("scene.toml -o out --bundle none.h5", "none.h5");
  expect_refused("scene.toml -o out --bundle scene.toml", "scene.toml");
  expect_refused("scene.toml -o nowhere/out", "nowhere");
  write_scene(kProbe, "[effects]\nforce = \"response\"\n");
  expect_refused("scene.toml -o out", "box.h5");  // the bundle has no measured response
  write_scene(
      "[[tool]]\nname = \"t\"\npath = [[0, 0, 0, 0]]\n[[tool.grip]]\nbox = { min = [90, 0, 0], max = [91, 1, 1] }\n");
  expect_refused("scene.toml -o out", "scene.toml:7: [[tool.grip]]");
  write_scene(kProbe + "points = [[0, 0, 0]]\n");
  expect_refused("scene.toml -o out", "scene.toml:8");
}

// The cells of the plan's table: pass -> predicted and measured microseconds; 0 where there is none.
std::map<std::string, std::array<double, 2>> explained(const std::string& output) {
  std::map<std::string, std::array<double, 2>> passes;
  std::stringstream lines(output);
  for (std::string line; std::getline(lines, line);) {
    if (line.compare(0, 5, "touch") != 0 && line.compare(0, 5, "shape") != 0 && line.compare(0, 6, "create") != 0)
      continue;
    const std::string name = line.substr(8, 24);
    std::stringstream cells(line.substr(8 + 24 + 4 * 10));
    auto& costs = passes[name.substr(0, name.find_last_not_of(' ') + 1)];
    std::string unit;
    cells >> costs[0] >> unit >> costs[1];
  }
  return passes;
}

TEST_F(PlayedScene, ExplainsEveryPassOfItsPlanAndWritesNothing) {
  write_scene(kProbe, "[effects]\nshape = \"volume\"\n[relaxation]\nterms = [[0.45, 0.5]]\nsource = \"1997\"\n");
  const ProgramRun ended = played("scene.toml -o out --explain");
  EXPECT_THAT(ended.out, HasSubstr("tensors/displacement_surface"));
  EXPECT_THAT(ended.out, HasSubstr("with 3 contact nodes of 1 contacts"));
  EXPECT_FALSE(fs::exists(folder_ / "out"));
  const auto passes = explained(ended.out);
  const char* expected[] = {"rest surface in buckets", "input",         "collision: rest",   "contact: point",
                            "solve: sticking",         "force: linear", "relaxation: prony", "output",
                            "superposition: volume",   "positions"};
  EXPECT_EQ(passes.size(), std::size(expected)) << ended.out;
  for (const char* name : expected) {
    ASSERT_TRUE(passes.count(name)) << name << "\n" << ended.out;
    EXPECT_EQ(passes.at(name)[0] > 0, std::string(name) != "rest surface in buckets") << name << "\n" << ended.out;
  }
  // Whatever the machine does meanwhile: a solve of three nodes and a field of 64 are not measured as nothing.
  EXPECT_GT(passes.at("solve: sticking")[1], 0.01) << ended.out;
  EXPECT_GT(passes.at("superposition: volume")[1], 0.01) << ended.out;
}

TEST_F(PlayedScene, RunsBothLoopsAgainstTheClock) {
  write_scene(kProbe);
  const ProgramRun ended = played("scene.toml -o out --realtime --seconds 0.3 --rate 500 --rate 2000");
  EXPECT_THAT(ended.out, HasSubstr("missed deadlines"));
  const auto summary = summary_of();
  ASSERT_EQ(summary["realtime"].size(), 2u);
  const double rates[2] = {500, 2000};
  for (int r = 0; r < 2; ++r) {
    const auto& entry = summary["realtime"][r];
    const auto& touch = entry["touch"];
    EXPECT_EQ(entry["touch_hz"], rates[r]);
    // Every step was made or counted as missed, however busy the machine; a late step counts once and what it left out too.
    const int steps = touch["steps"], missed = touch["missed_deadlines"], wanted = static_cast<int>(0.3 * rates[r]);
    EXPECT_LE(steps, wanted);
    EXPECT_GE(steps + missed, wanted);
    EXPECT_GT(steps, 0);
    for (const char* name : {"p50", "p90", "p99", "p99.9", "p99.99", "max"}) {
      EXPECT_GT(touch["work_us"][name], 0);
      EXPECT_GT(touch["wake_up_us"][name], 0) << "woken before it was due";
    }
    EXPECT_GT(entry["shape"]["steps"], 0);
    EXPECT_GT(entry["contacts_age_us"]["max"], 0);
  }
  EXPECT_EQ(run("scene.toml -o out --realtime --explain").code, 2);
  EXPECT_EQ(run("scene.toml -o out --realtime --rate 0").code, 2);
  EXPECT_EQ(run("scene.toml -o out --seconds 3").code, 2);
}

TEST(Predicted, IsTheLongerOfReadingAndComputingAndWhatWaits) {
  const MachineRates rates = {2e9, 3e9, 1e9};
  EXPECT_DOUBLE_EQ(predicted_seconds({40000, 30000, 0}, rates), 20e-6);
  EXPECT_DOUBLE_EQ(predicted_seconds({1000, 90000, 0}, rates), 30e-6);
  EXPECT_DOUBLE_EQ(predicted_seconds({40000, 30000, 5000}, rates), 25e-6);
}

TEST(Percentile, IsTheNearestRank) {
  std::vector<double> values;
  for (int i = 100; i >= 1; --i) values.push_back(i);
  EXPECT_EQ(percentile(values, .5), 50);
  EXPECT_EQ(percentile(values, .99), 99);
  EXPECT_EQ(percentile(values, .999), 100);
  EXPECT_EQ(percentile(values, 1), 100);
  EXPECT_EQ(percentile({7}, .5), 7);
  EXPECT_EQ(percentile({}, .5), 0);
}

TEST(Flags, HaveTheNamesOfTheApi) {
  EXPECT_THAT(flag_names(PALPATE_STEP_REGULARISED | PALPATE_STEP_NOT_TOUCHABLE),
              testing::ElementsAre("REGULARISED", "NOT_TOUCHABLE"));
}

// The box's sides, `above` mm beyond those of the bundle's box but at x = 0, as a PLY file.
void write_box_around(const fs::path& file, double above, const std::string& last = "3 1 7 5\n") {
  std::ofstream ply(file);
  ply << "ply\nformat ascii 1.0\nelement vertex 8\nproperty double x\nproperty double y\nproperty double z\n"
         "element face 12\nproperty list uchar int vertex_indices\nend_header\n";
  for (int v = 0; v < 8; ++v)
    ply << (v & 1 ? 60 + above : 0) << ' ' << (v & 2 ? 50 + above : -above) << ' ' << (v & 4 ? 40 + above : -above)
        << '\n';
  ply << "3 0 2 3\n3 0 3 1\n3 4 5 7\n3 4 7 6\n3 0 1 5\n3 0 5 4\n3 2 6 7\n3 2 7 3\n3 0 4 6\n3 0 6 2\n3 1 3 7\n" << last;
}

TEST_F(PlayedScene, MeetsTheSurfaceThatTheSceneNames) {
  write_box_around(folder_ / "fine.ply", 1);
  fs::create_directories(folder_ / "scenes");
  const std::string head = "name = \"test\"\nbundle = \"../box.h5\"\nunit = \"mm\"\n";
  // Comes down by 9 mm in 0.1 s, from 4 mm above the mesh.
  std::ofstream(folder_ / "scenes/mesh.toml") << head << kProbe;
  std::ofstream(folder_ / "scenes/fine.toml") << head << "[surface]\nfile = \"../fine.ply\"\n" << kProbe;
  const auto first_contact = [&](const std::string& scene) {
    played("scenes/" + scene + ".toml --output " + scene + " --record " + scene + ".record");
    return number(rows_of(scene + "/contacts.csv").at(0), "time_s");
  };
  EXPECT_NEAR(first_contact("mesh") - first_contact("fine"), 0.1 * 1 / 9, 0.0011) << "a step is 1 ms";
  played("--replay fine.record");
  played("--replay fine.record scenes/fine.toml");
  const ProgramRun other = run("--replay fine.record scenes/mesh.toml");
  EXPECT_EQ(other.code, 2);
  EXPECT_THAT(other.errors, HasSubstr("found another \"surface\""));
  write_box_around(folder_ / "fine.ply", 1.5);
  EXPECT_NE(run("--replay fine.record").code, 0);

  write_box_around(folder_ / "fine.ply", 1, "3 1 5 7\n");
  expect_refused("scenes/fine.toml --output out", "fine.ply: palpate_fine_surface: ");
  fs::remove(folder_ / "fine.ply");
  expect_refused("scenes/fine.toml --output out", "fine.ply");
}

TEST(LostDeformation, SaysWhenLargeDeformationDivergedAndInHowManyTouches) {
  LostDeformation lost;
  palpate_contacts contacts = {};
  const auto touch = [&](double time, palpate_step_flags flags, double residual) {
    contacts.flags = flags, contacts.body_residual = residual;
    lost.add(time, contacts);
  };
  touch(0.1, 0, 0.01);
  touch(0.2, PALPATE_STEP_DEFORMATION_BEHIND, 0.5);  // far from its solution, but not undone
  EXPECT_TRUE(lost.warnings().empty());
  touch(0.75, PALPATE_STEP_DEFORMATION_BEHIND, 0.9);
  touch(0.8, PALPATE_STEP_DEFORMATION_BEHIND, 12);
  ASSERT_EQ(lost.warnings().size(), 1u);
  EXPECT_THAT(lost.warnings()[0], testing::StartsWith("large deformation diverged at 0.75 s: 2 of 4"));
}

}  // namespace
}  // namespace palpate
