// palpate-run plays the loads of a scene: what it writes is what the C API says.
#include <gmock/gmock.h>
#include <palpate/palpate_scene_def.hpp>

#include <algorithm>
#include <cmath>

#include "tests/programs/player/played_scene.h"

namespace palpate {
namespace {

using namespace tests;
using testing::HasSubstr;

// The top of the box, which is 60 x 50 x 40 mm and held at x = 0, bears up to 0.2 N downwards; its far face a traction.
const std::string kLoads =
    "[[load]]\nname = \"swab\"\nnear = [42, 25, 41]\nradius = 12\nforces = [[0, 0, 0, 0], [0.05, 0, 0, -0.2]]\n"
    "[[load]]\nname = \"blade\"\nnear = [60, 25, 20]\nradius = 9\ntraction = [300, 0, 0]\nframe = \"organ\"\n";

class LoadScene : public PlayedScene {};

TEST_F(LoadScene, BearsThemAsTheCApiDoes) {
  write_scene(kProbe + kLoads);
  const ProgramRun ended = played("scene.toml -o out");
  const std::vector<Row> forces = rows_of("out/forces.csv"), loads = rows_of("out/loads.csv");
  ASSERT_EQ(forces.size(), 101u);
  ASSERT_EQ(loads.size(), 202u);

  palpate_bundle* bundle = nullptr;
  ASSERT_EQ(palpate_bundle_open_file((folder_ / "box.h5").c_str(), nullptr, &bundle, nullptr), PALPATE_OK);
  SceneDef def;
  def.collision = PALPATE_COLLISION_DEFORMED, def.contact = PALPATE_CONTACT_POINT, def.max_tools = 1;
  def.loads.count = 2;
  const double centre[2][3] = {{0.042, 0.025, 0.04}, {0.06, 0.025, 0.02}};
  for (int i = 0; i < 2; ++i) std::copy_n(centre[i], 3, def.loads.centre[i]);
  def.loads.radius[0] = 0.012, def.loads.radius[1] = 0.009;
  palpate_scene* scene = nullptr;
  ASSERT_EQ(palpate_scene_create(bundle, &def, &scene, nullptr), PALPATE_OK);
  std::vector<double> memory(palpate_contacts_bytes(scene) / sizeof(double) + 1);
  auto* contacts = reinterpret_cast<palpate_contacts*>(memory.data());
  const char* axes[3] = {"x", "y", "z"};
  for (int step = 0; step <= 100; ++step) {
    const double share = step / 100.0, weight[3] = {0, 0, -0.2 * std::min(1.0, 2 * share)}, traction[3] = {300, 0, 0};
    ASSERT_EQ(palpate_scene_set_load(scene, 0, PALPATE_LOAD_FORCE_IN_WORLD, weight, nullptr), PALPATE_OK);
    ASSERT_EQ(palpate_scene_set_load(scene, 1, PALPATE_LOAD_TRACTION, traction, nullptr), PALPATE_OK);
    const double point[3] = {0.041, 0.026, 0.044 - 0.009 * share};
    palpate_tool tool = palpate_default_tool();
    tool.points = point, tool.point_count = 1;
    palpate_scene_touch(scene, &tool, 1, 1e-3, contacts, memory.size() * sizeof memory[0]);
    for (int d = 0; d < 3; ++d) {
      // The path is evaluated in another order of roundings: 1e-15 of 0.04 m, over a displacement of 4e-5 m.
      EXPECT_NEAR(number(forces[step], std::string("raw_") + axes[d] + "_N"),
                  palpate_contacts_tool(contacts, 0)->force_raw[d], 1e-9);
      for (int i = 0; i < 2; ++i) {
        const palpate_load_state& state = *palpate_scene_load_state(scene, i);
        const Row& row = loads[2 * step + i];
        EXPECT_NEAR(number(row, std::string("force_") + axes[d] + "_N"), state.force[d], 1e-12);
        EXPECT_NEAR(number(row, std::string("place_") + axes[d] + "_m"), state.place[d], 1e-12);
        EXPECT_NEAR(number(row, std::string("displacement_") + axes[d] + "_m"), state.displacement[d], 1e-12);
      }
    }
  }
  EXPECT_LT(number(loads[200], "displacement_z_m"), -1e-4) << "it sinks at all";
  EXPECT_EQ(loads[1].at("load"), "blade");
  palpate_scene_destroy(scene);
  palpate_bundle_close(bundle);

  const auto summary = summary_of();
  ASSERT_EQ(summary["loads"].size(), 2u);
  EXPECT_EQ(summary["loads"][0]["name"], "swab");
  EXPECT_NEAR(summary["loads"][0]["peak_force_N"].get<double>(), 0.2, 1e-12);
  EXPECT_NEAR(summary["loads"][1]["peak_force_N"].get<double>(), 300 * summary["loads"][1]["area_m2"].get<double>(),
              1e-9);
  EXPECT_THAT(ended.errors, HasSubstr("load \"swab\": up to 0.2 N"));
  EXPECT_THAT(file_bytes(folder_ / "out/shapes.pvd"), HasSubstr("shapes/loads_000000.vtu"));
}

TEST_F(LoadScene, RecordsAndReplaysThem) {
  write_scene(kProbe + kLoads);
  expect_replayed({"forces.csv", "loads.csv", "contacts.csv"});
  write_scene(kProbe + kLoads + "[[load]]\nname = \"third\"\nnear = [42, 25, 41]\nradius = 2\nforce = [0, 0, 0]\n");
  EXPECT_THAT(run("scene.toml --replay run.record").errors, HasSubstr("found another \"load\""));
}

TEST_F(LoadScene, LastsAsLongAsItsRows) {
  write_scene("[[tool]]\nname = \"probe\"\npoints = [[0, 0, 0]]\npath = [[0, 0, 0, 90]]\n" + kLoads);
  played("scene.toml -o out");
  EXPECT_EQ(rows_of("out/loads.csv").size(), 2 * 51u);
}

TEST_F(LoadScene, ExplainsWhatTheyCost) {
  write_scene(kProbe + kLoads);
  EXPECT_THAT(played("scene.toml --explain").out, HasSubstr("touch   loads"));
}

TEST_F(LoadScene, RefusesAPatchThatIsFarOrHeldInOneSentence) {
  const auto load = [](const char* keys) {
    return std::string("[[load]]\nname = \"swab\"\nforce = [0, 0, 1]\n") + keys;
  };
  write_scene(kProbe + load("near = [9999, 0, 0]\nradius = 3\n"));
  expect_refused("scene.toml -o out", "scene.toml:8: load \"swab\": near: ");
  write_scene(kProbe + load("near = [10, 25, 40]\nradius = 30\n"));
  expect_refused("scene.toml -o out", "scene.toml: palpate_loads_def: the patch of load 0 reaches nodes");
  write_scene(kProbe + load("near = [42, 25, 40]\nradius = 5\n") + "[[load]]\nname = \"huge\"\nnear = [42, 25, 40]\n" +
              "radius = 5\nforce = [0, 0, 1e300]\n");
  EXPECT_THAT(run("scene.toml -o out").errors, HasSubstr("load \"huge\": "));
}

TEST_F(LoadScene, BearsThemOnTheOrganThatTheyNameInTheWorldsFrame) {
  std::ofstream(folder_ / "scene.toml")
      << "name = \"two\"\nunit = \"mm\"\n[[organ]]\nname = \"one\"\nbundle = \"box.h5\"\n[[organ]]\nname = \"two\"\n"
         "bundle = \"box.h5\"\nposition = [200, 0, 0]\nturn = [0, 0, 90]\n"
         "[[tool]]\nname = \"probe\"\npoints = [[0, 0, 0]]\npath = [[0, 0, 0, 900], [0.02, 0, 0, 900]]\n"
         "[[load]]\nname = \"swab\"\norgan = \"two\"\nnear = [42, 25, 40]\nradius = 12\nforce = [0.1, 0, 0]\n"
         "[[load]]\nname = \"blade\"\norgan = \"two\"\nnear = [60, 25, 20]\nradius = 9\nforce = [0.1, 0, 0]\nframe = "
         "\"organ\"\n";
  played("scene.toml -o out");
  const std::vector<Row> loads = rows_of("out/loads.csv");
  ASSERT_EQ(loads.size(), 2 * 21u);
  EXPECT_EQ(loads[0].at("organ"), "two");
  EXPECT_NEAR(number(loads[0], "force_x_N"), 0.1, 1e-12);
  EXPECT_NEAR(number(loads[1], "force_y_N"), 0.1, 1e-12) << "its axes are turned by 90 degrees";
  EXPECT_NEAR(number(loads[0], "place_x_m"), 0.2 - 0.025, 4e-3);
  EXPECT_EQ(summary_of()["organs"][1]["loads"].size(), 2u);
}

// A probe that presses the top with up to 0.1 N, from 1 mm above it.
const std::string kPusher =
    "[[tool]]\nname = \"probe\"\npoints = [[0, 0, 0]]\npath = [[0, 41, 26, 41]]\n[tool.given_force]\nforces = [[0, 0, "
    "0, "
    "-0.01], [0.1, 0, 0, -0.1]]\n";

class GivenForceScene : public PlayedScene {};

TEST_F(GivenForceScene, TellsWhereTheToolStandsAndWhatItFeels) {
  write_scene(kPusher, "[effects]\nlaw = \"sticking\"\ncollision = \"deformed\"\n");
  const ProgramRun ended = played("scene.toml -o out");
  const std::vector<Row> forces = rows_of("out/forces.csv");
  ASSERT_EQ(forces.size(), 101u);
  EXPECT_NEAR(number(forces[0], "z_m"), 0.041, 1e-12);
  for (std::size_t s = 50; s < forces.size(); ++s) {
    EXPECT_NEAR(number(forces[s], "raw_z_N"), 0.01 + 0.09 * static_cast<double>(s) / 100, 1e-6);
    EXPECT_LT(number(forces[s], "z_m"), number(forces[s - 1], "z_m"));
  }
  EXPECT_LT(number(forces[100], "z_m"), 0.0398);
  const auto given = summary_of()["tools"][0]["given_force"];
  EXPECT_GT(given["touches_carried"].get<int>(), 90);
  EXPECT_NEAR(given["largest_displacement_m"].get<double>(), 0.041 - number(forces[100], "z_m"), 1e-4);
  EXPECT_THAT(ended.errors, HasSubstr("force of tool \"probe\": carried in "));
  EXPECT_THAT(played("scene.toml --explain").out, HasSubstr("touch   force control"));
}

TEST_F(GivenForceScene, RecordsAndReplays) {
  write_scene(kPusher + kLoads);
  expect_replayed({"forces.csv", "loads.csv", "contacts.csv"});
  write_scene(kPusher + "speed = 10\n" + kLoads);
  EXPECT_THAT(run("scene.toml --replay run.record").errors, HasSubstr("found another \"tool\""));
}

}  // namespace
}  // namespace palpate
