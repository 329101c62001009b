// palpate-run plays the blades and removals of a scene: what it writes is what the C API says, and the surface that it writes is closed.
#include <gmock/gmock.h>
#include <vtkCellData.h>
#include <vtkNew.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLUnstructuredGridReader.h>
#include <palpate/palpate_scene_def.hpp>

#include <cmath>
#include <cstring>
#include <map>

#include "tests/programs/player/played_scene.h"
#include "tests/support/box_corridor.h"

namespace palpate {
namespace {

using namespace tests;
using testing::HasSubstr;

// The box is 60 x 50 x 40 mm and held at x = 0; its cells are 10 x 12.5 x 10 mm. A blade comes from above at x = 40 and goes half way down, in
// a plane across x; the probe is far.
const std::string kFar = "[[tool]]\nname = \"probe\"\npoints = [[0, 0, 0]]\npath = [[0, 41, 26, 90]]\n";
std::string blade(const std::string& until, const std::string& more = "") {
  return "[[blade]]\nname = \"scalpel\"\nedge = [[0, -40, 0], [0, 40, 0]]\npath = [[0, 40, 25, 45], [0.1, 40, 25, " +
         until + "]]\n" + more;
}

class CutScene : public PlayedScene {
 protected:
  void SetUp() override {
    folder_ = fresh_folder();
    write_bundle(folder_ / "box.h5", cut_box({.cells = {6, 4, 4}}, 100));
  }

  // The triangles of a shape of the organ; lips: of these, how many.
  struct Shown {
    vtkNew<vtkXMLUnstructuredGridReader> reader;
    vtkUnstructuredGrid* grid;
    int lips = 0;
    explicit Shown(const std::filesystem::path& file) {
      reader->SetFileName(file.c_str());
      reader->Update();
      grid = reader->GetOutput();
      for (vtkIdType c = 0; c < grid->GetNumberOfCells(); ++c)
        lips += grid->GetCellData()->GetArray("lip")->GetTuple1(c) != 0;
    }
    // Each edge of a closed surface has two triangles, which go along it in opposite directions.
    void expect_closed() const {
      std::map<std::pair<vtkIdType, vtkIdType>, int> edges;
      for (vtkIdType c = 0; c < grid->GetNumberOfCells(); ++c) {
        ASSERT_EQ(grid->GetCell(c)->GetNumberOfPoints(), 3);
        for (int i = 0; i < 3; ++i)
          ++edges[{grid->GetCell(c)->GetPointId(i), grid->GetCell(c)->GetPointId((i + 1) % 3)}];
      }
      for (const auto& [edge, count] : edges) {
        EXPECT_EQ(count, 1);
        EXPECT_TRUE(edges.contains({edge.second, edge.first})) << edge.first << " " << edge.second;
      }
    }
    double area_of_lips() const {
      double sum = 0;
      for (vtkIdType c = 0; c < grid->GetNumberOfCells(); ++c) {
        if (grid->GetCellData()->GetArray("lip")->GetTuple1(c) == 0) continue;
        double p[3][3];
        for (int i = 0; i < 3; ++i) grid->GetPoint(grid->GetCell(c)->GetPointId(i), p[i]);
        double a[3], b[3];
        for (int d = 0; d < 3; ++d) a[d] = p[1][d] - p[0][d], b[d] = p[2][d] - p[0][d];
        sum += std::hypot(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]) / 2;
      }
      return sum;
    }
  };
  nlohmann::json gltf_of(const std::string& name) const {
    const std::string bytes = file_bytes(folder_ / name);
    std::uint32_t size = 0;
    std::memcpy(&size, bytes.data() + 12, 4);
    return nlohmann::json::parse(bytes.substr(20, size));
  }
};

TEST_F(CutScene, CutsAsFarAsTheBladeComesAndWritesTheSurfaceThatIsLeft) {
  write_scene(kFar + blade("20"));
  const ProgramRun ended = played("scene.toml -o out");
  const auto cut = summary_of()["cut"];
  // The way through the tissue: half of the box, 50 x 20 mm, along the faces nearest to it.
  EXPECT_NEAR(cut["area_m2"].get<double>(), 50e-3 * 20e-3, 0.3 * 50e-3 * 20e-3);
  EXPECT_EQ(cut["pieces"], 1);
  EXPECT_THAT(ended.errors, HasSubstr("faces, "));
  const std::vector<Row> rows = rows_of("out/cut.csv");
  ASSERT_GE(rows.size(), 3u);
  EXPECT_LT(rows.size(), 100u) << "rows of changes alone";
  EXPECT_EQ(number(rows[0], "time_s"), 0);
  EXPECT_EQ(number(rows[0], "faces"), 0);
  EXPECT_EQ(number(rows.back(), "time_s"), 0.1);
  EXPECT_EQ(number(rows.back(), "area_m2"), cut["area_m2"]);
  ASSERT_EQ(rows_of("out/events.csv").size(), 1u);
  EXPECT_EQ(rows_of("out/events.csv")[0].at("event"), "first cut");
  EXPECT_EQ(number(rows_of("out/events.csv")[0], "time_s"), cut["first_s"]);

  const Shown first(folder_ / "out/shapes/organ_000000.vtu"), last(folder_ / "out/shapes/organ_000006.vtu");
  EXPECT_EQ(first.lips, 0);
  EXPECT_EQ(last.lips, 2 * cut["faces"].get<int>()) << "two lips of each face";
  EXPECT_EQ(last.grid->GetNumberOfCells(), first.grid->GetNumberOfCells() + last.lips);
  first.expect_closed(), last.expect_closed();
  // Nothing pulls, so that the cut does not open.
  EXPECT_NEAR(last.area_of_lips(), 2 * cut["area_m2"].get<double>(), 1e-9);
  EXPECT_LT(summary_of()["largest_displacement_m"].get<double>(), 1e-6) << "new nodes lie where they come from";
  EXPECT_THAT(file_bytes(folder_ / "out/shapes.pvd"), HasSubstr("shapes/blades_000006.vtu"));
}

TEST_F(CutScene, IsCutAsTheCApiSays) {
  write_scene(kFar + blade("20", "turn = [[0, 0, 0, 0], [0.1, 0, 10, 0]]\ncuts = [[0.01, 0.09]]\n"));
  played("scene.toml -o out");
  palpate_bundle* bundle = nullptr;
  ASSERT_EQ(palpate_bundle_open_file((folder_ / "box.h5").c_str(), nullptr, &bundle, nullptr), PALPATE_OK);
  SceneDef def;
  def.collision = PALPATE_COLLISION_DEFORMED, def.contact = PALPATE_CONTACT_POINT, def.max_tools = 1;
  def.cut.cut = PALPATE_CUT_ON;
  palpate_scene* scene = nullptr;
  palpate_error error = {};
  ASSERT_EQ(palpate_scene_create(bundle, &def, &scene, &error), PALPATE_OK) << error.text;
  std::vector<double> memory(palpate_contacts_bytes(scene) / sizeof(double) + 1);
  auto* contacts = reinterpret_cast<palpate_contacts*>(memory.data());
  for (int step = 0; step <= 100; ++step) {
    const double edge[6] = {0.04, 0.025 - 0.04, 0.045 - 0.025 * step / 100, 0.04, 0.025 + 0.04, edge[2]};
    palpate_blade now = palpate_default_blade();
    now.points = edge, now.point_count = step >= 10 && step < 90 ? 2 : 0;
    ASSERT_EQ(palpate_scene_set_blade(scene, 0, &now, &error), PALPATE_OK) << error.text;
    palpate_scene_touch(scene, nullptr, 0, 1e-3, contacts, memory.size() * sizeof memory[0]);
  }
  // The blade turns about its own edge, y, which leaves the edge where it is.
  const palpate_cut_state& state = *palpate_scene_cut_state(scene);
  const Row last = rows_of("out/cut.csv").back();
  EXPECT_GT(state.faces, 0);
  EXPECT_EQ(number(last, "faces"), state.faces);
  EXPECT_EQ(number(last, "area_m2"), state.area);
  EXPECT_EQ(number(last, "nodes"), state.nodes);
  EXPECT_EQ(number(last, "rank"), state.rank);
  EXPECT_EQ(number(last, "waiting"), state.waiting);
  palpate_scene_destroy(scene);
  palpate_bundle_close(bundle);
}

TEST_F(CutScene, TellsWhenAPieceComesOff) {
  write_scene(kFar + blade("-10"));
  const ProgramRun ended = played("scene.toml -o out --export out.glb");
  const auto cut = summary_of()["cut"];
  EXPECT_EQ(cut["pieces"], 2);
  ASSERT_EQ(cut["pieces_s"].size(), 1u);
  const std::vector<Row> events = rows_of("out/events.csv");
  ASSERT_EQ(events.size(), 2u);
  EXPECT_EQ(events[1].at("event"), "piece came off");
  EXPECT_EQ(number(events[1], "time_s"), cut["pieces_s"][0]);
  EXPECT_THAT(ended.errors, HasSubstr("2 pieces"));
  Shown(folder_ / "out/shapes/organ_000006.vtu").expect_closed();

  // A node for each surface that a shape had, of which one at a time has the scale 1.
  const auto gltf = gltf_of("out.glb");
  ASSERT_GT(gltf["nodes"].size(), 3u);
  EXPECT_EQ(gltf["nodes"][0]["children"].size(), gltf["nodes"].size() - 1);
  std::size_t targets = 0;
  for (std::size_t i = 0; i < gltf["meshes"].size(); ++i) {
    const auto& primitives = gltf["meshes"][i]["primitives"];
    targets += primitives[0]["targets"].size();
    EXPECT_EQ(primitives.size(), i == 0 ? 1u : 2u) << "the lips are apart";
    EXPECT_EQ(gltf["nodes"][i + 1]["mesh"], i);
    EXPECT_EQ(gltf["nodes"][i + 1]["scale"][0], i == 0 ? 1 : 0);
  }
  EXPECT_EQ(targets, 7u) << "each shape once";
  int scaled = 0;
  for (const auto& channel : gltf["animations"][0]["channels"]) scaled += channel["target"]["path"] == "scale";
  EXPECT_EQ(scaled, static_cast<int>(gltf["meshes"].size()));
  EXPECT_EQ(gltf["materials"].back()["name"], "lip");
}

TEST_F(CutScene, RecordsAndReplaysIt) {
  const std::string hook =
      "[[removal]]\nname = \"hook\"\nradius = 9\nposition = [60, 25, 40]\ntimes = [[0.02, 0.06]]\n"
      "[[removal]]\nname = \"sucker\"\nradius = 9\nposition = [60, 50, 0]\ntime = 0.02\n";
  const std::string puller =
      "[[tool]]\nname = \"forceps\"\npath = [[0, 60, 25, 20], [0.1, 60, 25, 25]]\n[[tool.grip]]\nnearest = [60, 25, "
      "20]\n";
  write_scene(kFar + puller + blade("20", "turn = [[0, 0, 0, 0], [0.1, 5, 0, 0]]\n") + hook);
  expect_replayed({"forces.csv", "cut.csv", "events.csv", "contacts.csv"});
  EXPECT_GT(number(rows_of("out/cut.csv").back(), "removed"), 1);
  write_scene(kFar + puller + blade("20") + hook);
  EXPECT_THAT(run("scene.toml --replay run.record").errors, HasSubstr("found another \"blade\""));
  write_scene(kFar + puller + blade("20", "turn = [[0, 0, 0, 0], [0.1, 5, 0, 0]]\n"));
  EXPECT_THAT(run("scene.toml --replay run.record").errors, HasSubstr("found another \"removal\""));
}

TEST_F(CutScene, TellsWhatABladeFeels) {
  write_scene(kFar + blade("20", "toughness = 5\ndirection = [0, 0, -1]\nfriction = 100\nwidth = 10\n"));
  const ProgramRun ended = played("scene.toml -o out");
  const auto blade = summary_of()["blades"][0];
  EXPECT_EQ(blade["name"], "scalpel");
  EXPECT_GT(blade["peak_force_N"].get<double>(), 0.1);
  EXPECT_GT(blade["work_J"].get<double>(), 0);
  // The work of a new area: the edge's own account, in steps of 0.25 mm.
  EXPECT_NEAR(blade["work_J"].get<double>(), 5 * blade["area_m2"].get<double>(), 0.2 * blade["work_J"].get<double>());
  EXPECT_THAT(ended.errors, HasSubstr("blade \"scalpel\": largest force"));
  const std::vector<Row> rows = rows_of("out/blades.csv");
  EXPECT_EQ(rows.size(), 101u);
  EXPECT_EQ(number(rows.back(), "work_J"), blade["work_J"]);
  EXPECT_GT(blade["friction_work_J"].get<double>(), 0);
  EXPECT_EQ(number(rows.back(), "friction_work_J"), blade["friction_work_J"]);
}

TEST_F(CutScene, RemovesEachTissueThatIsDueInAStepOfItsOwn) {
  const auto removal = [](const std::string& name, const std::string& place) {
    return "[[removal]]\nname = \"" + name + "\"\nradius = 9\nposition = [" + place + "]\ntime = 0.02\n";
  };
  write_scene(
      kFar +
      "[[blade]]\nname = \"resting\"\nedge = [[0, 0, 0], [0, 0, 1]]\nposition = [0, 0, 90]\ncuts = [[0, 0.05]]\n" +
      removal("one", "60, 0, 40") + removal("other", "60, 50, 0"));
  played("scene.toml -o out");
  std::vector<double> times;
  double removed = 0;
  for (const Row& row : rows_of("out/cut.csv"))
    if (number(row, "removed") > removed) removed = number(row, "removed"), times.push_back(number(row, "time_s"));
  EXPECT_EQ(times, (std::vector<double>{0.02, 0.021}));
}

// The hook comes at 20 ms, and tissue goes when it has stayed for 10 ms, whether it is asked for every 5 ms or five times in a touch.
TEST_F(CutScene, RemovesTissueAfterItsTimeInContactHoweverOftenItIsAskedFor) {
  for (const char* const every : {"0.005", "0.0002"}) {
    write_scene(kFar +
                "[[removal]]\nname = \"hook\"\nradius = 9\nposition = [60, 0, 40]\ntimes = [[0.02, 0.06]]\nevery = " +
                every + "\ncontact_time = 0.01\n");
    played("scene.toml -o out");
    double went = 0;
    for (const Row& row : rows_of("out/cut.csv"))
      if (went == 0 && number(row, "removed") > 0) went = number(row, "time_s");
    EXPECT_NEAR(went, 0.03, 0.0055) << every;
  }
}

TEST_F(CutScene, LastsAsLongAsItsBladesAndRemovals) {
  const auto touches = [&](const std::string& tables) {
    write_scene(kFar + tables);
    played("scene.toml -o out");
    return summary_of()["touches"].get<int>();
  };
  const std::string edge = "[[blade]]\nname = \"scalpel\"\nedge = [[0, 0, 0], [0, 0, 1]]\n";
  EXPECT_EQ(touches(edge + "path = [[0, 0, 0, 90], [0.03, 0, 0, 90]]\n"), 31);
  EXPECT_EQ(touches(edge + "cuts = [[0, 0.04]]\n"), 41);
  EXPECT_EQ(touches("[[removal]]\nname = \"hook\"\nradius = 1\nposition = [0, 0, 90]\ntimes = [[0, 0.05]]\n"), 51);
}

TEST_F(CutScene, WarnsWhereNothingIsCutAndWhereNothingMoreIs) {
  write_scene(
      kFar +
      "[[blade]]\nname = \"scalpel\"\nedge = [[0, 0, 0], [0, 0, 1]]\nposition = [0, 0, 90]\ncuts = [[0, 0.02]]\n");
  EXPECT_THAT(played("scene.toml -o out").errors, HasSubstr("nothing was cut or removed"));
  write_scene(kFar + blade("-10"), "[limits]\ncut_nodes = 8\n");
  EXPECT_THAT(played("scene.toml -o out").errors, HasSubstr("nothing more was cut: "));
  EXPECT_FALSE(summary_of()["cut"]["full_s"].is_null());
  EXPECT_EQ(rows_of("out/events.csv").back().at("event"), "full");
}

TEST_F(CutScene, ExplainsWhatItCosts) {
  write_scene(kFar + blade("20"));
  EXPECT_THAT(played("scene.toml --explain").out, HasSubstr("cut"));
}

TEST_F(CutScene, RefusesABundleThatCannotBeCutAndABladeThatTheLibraryRefuses) {
  write_scene(kFar + "[[blade]]\nname = \"scalpel\"\nedge = [[0, 0, 0], [0, 0, 1]]\nposition = [0, 0, 2e9]\n");
  expect_refused("scene.toml -o out", "scene.toml:8: blade \"scalpel\": blade 0: expected ");
  write_bundle(folder_ / "box.h5", tiny_bundle());
  write_scene(kFar + blade("20"));
  expect_refused("scene.toml -o out", "cut");
}

TEST_F(CutScene, CutsTheOrganThatItNames) {
  std::ofstream(folder_ / "scene.toml")
      << "name = \"two\"\nunit = \"mm\"\n[[organ]]\nname = \"one\"\nbundle = \"box.h5\"\n[[organ]]\nname = \"two\"\n"
         "bundle = \"box.h5\"\nposition = [200, 0, 0]\n" +
             kFar +
             "[[blade]]\nname = \"scalpel\"\norgan = \"two\"\nedge = [[0, -40, 0], [0, 40, 0]]\npath = [[0, 240, 25, "
             "45], [0.1, 240, 25, 20]]\n";
  played("scene.toml -o out --export out.glb");
  EXPECT_FALSE(summary_of()["organs"][0].contains("cut"));
  EXPECT_GT(summary_of()["organs"][1]["cut"]["faces"].get<int>(), 0);
  EXPECT_EQ(rows_of("out/cut.csv").back().at("organ"), "two");
  const Shown last(folder_ / "out/shapes/organ_two_000006.vtu");
  EXPECT_EQ(last.lips, 2 * summary_of()["organs"][1]["cut"]["faces"].get<int>());
  last.expect_closed();
}

}  // namespace
}  // namespace palpate
