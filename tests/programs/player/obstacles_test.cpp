// palpate-run plays the obstacles of a scene: what it writes is what the C API says.
#include <gmock/gmock.h>
#include <palpate/palpate_scene_def.hpp>

#include <cstring>

#include "tests/programs/player/played_scene.h"

namespace palpate {
namespace {

using namespace tests;
using testing::HasSubstr;

// The box is 60 x 50 x 40 mm and held at x = 0. A plate comes down on its top by 2 mm; a ridge with an edge along y stands below it, apart.
const std::string kFar =
    "[[tool]]\nname = \"probe\"\npoints = [[0, 0, 0]]\npath = [[0, 41, 26, 90], [0.1, 41, 26, 90]]\n";
const std::string kPlate =
    "[[obstacle]]\nname = \"plate\"\nkind = \"rectangle\"\nsize = [100, 90]\nnormal = [0, 0, -1]\nfriction = 0.3\n"
    "path = [[0, 30, 25, 42], [0.1, 30, 25, 38]]\n";
const std::string kRidge =
    "[[obstacle]]\nname = \"ridge\"\nkind = \"mesh\"\nfile = \"ridge.obj\"\nposition = [0, 0, -60]\n";

class ObstacleScene : public PlayedScene {
 protected:
  void SetUp() override {
    PlayedScene::SetUp();
    std::ofstream(folder_ / "ridge.obj") << "v 20 0 0\nv 40 0 0\nv 30 0 8\nv 20 50 0\nv 40 50 0\nv 30 50 8\n"
                                            "f 1 4 5 2\nf 1 3 6 4\nf 2 5 6 3\nf 1 2 3\nf 4 6 5\n";
  }
};

TEST_F(ObstacleScene, IsHeldOffAsTheCApiSays) {
  write_scene(kFar + kPlate + kRidge);
  const ProgramRun ended = played("scene.toml -o out");
  const std::vector<Row> rows = rows_of("out/obstacles.csv");
  ASSERT_EQ(rows.size(), 202u);

  palpate_bundle* bundle = nullptr;
  ASSERT_EQ(palpate_bundle_open_file((folder_ / "box.h5").c_str(), nullptr, &bundle, nullptr), PALPATE_OK);
  palpate_obstacle plate = palpate_default_obstacle();
  plate.kind = PALPATE_OBSTACLE_RECTANGLE, plate.size[0] = 0.1, plate.size[1] = 0.09, plate.friction = 0.3;
  SceneDef def;
  def.collision = PALPATE_COLLISION_DEFORMED, def.contact = PALPATE_CONTACT_POINT, def.max_tools = 1;
  def.obstacles.count = 1, def.obstacles.list = &plate;
  palpate_scene* scene = nullptr;
  ASSERT_EQ(palpate_scene_create(bundle, &def, &scene, nullptr), PALPATE_OK);
  std::vector<double> memory(palpate_contacts_bytes(scene) / sizeof(double) + 1);
  auto* contacts = reinterpret_cast<palpate_contacts*>(memory.data());
  const char* axes[3] = {"x", "y", "z"};
  for (int step = 0; step <= 100; ++step) {
    palpate_pose pose = palpate_default_pose();
    pose.position[0] = 0.03, pose.position[1] = 0.025, pose.position[2] = 0.042 - 0.004 * step / 100;
    pose.orientation[0] = 0, pose.orientation[1] = 1;
    ASSERT_EQ(palpate_scene_set_obstacle_pose(scene, 0, &pose, nullptr), PALPATE_OK);
    palpate_scene_touch(scene, nullptr, 0, 1e-3, contacts, memory.size() * sizeof memory[0]);
    const palpate_obstacle_state& state = *palpate_scene_obstacle_state(scene, 0);
    const Row& row = rows[2 * static_cast<std::size_t>(step)];
    for (int d = 0; d < 3; ++d) {
      // The path is evaluated in another order of roundings: 1e-17 m, over a stiffness of some 1e3 N/m.
      EXPECT_NEAR(number(row, std::string("force_") + axes[d] + "_N"), state.force[d], 1e-9);
      EXPECT_NEAR(number(row, std::string("torque_") + axes[d] + "_Nm"), state.torque[d], 1e-10);
      EXPECT_NEAR(number(row, std::string(axes[d]) + "_m"), pose.position[d], 1e-12);
    }
    EXPECT_EQ(number(row, "nodes"), state.nodes);
  }
  EXPECT_GT(number(rows[200], "force_z_N"), 0.1) << "the box pushes the plate upwards";
  EXPECT_EQ(rows[201].at("obstacle"), "ridge");
  EXPECT_EQ(number(rows[201], "nodes"), 0);
  palpate_scene_destroy(scene);
  palpate_bundle_close(bundle);

  const auto summary = summary_of();
  ASSERT_EQ(summary["obstacles"].size(), 2u);
  EXPECT_EQ(summary["obstacles"][0]["name"], "plate");
  EXPECT_GE(summary["obstacles"][0]["peak_force_N"].get<double>(), number(rows[200], "force_z_N"));
  EXPECT_EQ(summary["obstacles"][1]["most_nodes"], 0);
  EXPECT_THAT(ended.errors, HasSubstr("obstacle \"plate\": largest force"));
  EXPECT_THAT(ended.errors, HasSubstr("obstacle \"ridge\": nothing pressed it"));
  EXPECT_THAT(file_bytes(folder_ / "out/shapes.pvd"), HasSubstr("shapes/obstacles_000000.vtu"));
  EXPECT_EQ(rows_of("out/contacts.csv").at(0).at("tool"), "obstacle");
}

TEST_F(ObstacleScene, PressesWithAMeshThatMoves) {
  write_scene(kFar +
              "[[obstacle]]\nname = \"ridge\"\nkind = \"mesh\"\nfile = \"ridge.obj\"\npath = [[0, 10, 0, -9], [0.1, "
              "10, 0, -6]]\nturn = [[0, 0, 0, 0], [0.1, 0, 0, 0]]\n");
  played("scene.toml -o out");
  const std::vector<Row> rows = rows_of("out/obstacles.csv");
  EXPECT_EQ(number(rows[0], "nodes"), 0);
  EXPECT_LT(number(rows[100], "force_z_N"), -0.01) << "the box pushes the ridge downwards";
}

TEST_F(ObstacleScene, RecordsAndReplaysThem) {
  const std::string turns = "turn = [[0, 0, 0, 0], [0.1, 0, 3, 0]]\ndepth = 6\n";
  write_scene(kFar + kPlate + turns + kRidge);
  expect_replayed({"forces.csv", "obstacles.csv", "contacts.csv"});
  write_scene(kFar + kPlate + kRidge);
  EXPECT_THAT(run("scene.toml --replay run.record").errors, HasSubstr("found another \"obstacle\""));
}

TEST_F(ObstacleScene, LastsAsLongAsTheirPathsAndTurns) {
  const std::string tool = "[[tool]]\nname = \"probe\"\npoints = [[0, 0, 0]]\npath = [[0, 0, 0, 90]]\n";
  write_scene(tool + kPlate);
  played("scene.toml -o out");
  EXPECT_EQ(rows_of("out/obstacles.csv").size(), 101u);
  write_scene(tool + kRidge + "turn = [[0, 0, 0, 0], [0.05, 0, 0, 5]]\n");
  played("scene.toml -o out");
  EXPECT_EQ(rows_of("out/obstacles.csv").size(), 51u);
}

TEST_F(ObstacleScene, ExplainsWhatTheyCost) {
  write_scene(kFar + kPlate);
  EXPECT_THAT(played("scene.toml --explain").out, HasSubstr("touch   obstacles"));
}

TEST_F(ObstacleScene, RefusesAMeshThatCannotBeReadOrIsNotASurface) {
  write_scene(kFar + kRidge);
  std::filesystem::remove(folder_ / "ridge.obj");
  expect_refused("scene.toml -o out", "ridge.obj");
  std::ofstream(folder_ / "ridge.obj") << "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n";
  expect_refused("scene.toml -o out", "ridge.obj");
  // Three triangles at one edge.
  std::ofstream(folder_ / "ridge.obj") << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 -1 0\nf 1 2 3\nf 2 1 4\nf 2 1 5\n";
  expect_refused("scene.toml -o out", "scene.toml:8: obstacle \"ridge\" (ridge.obj): expected each edge in one or two");
}

TEST_F(ObstacleScene, HoldsOffTheOrganThatItNamesInTheWorldsFrame) {
  std::ofstream(folder_ / "scene.toml")
      << "name = \"two\"\nunit = \"mm\"\n[[organ]]\nname = \"one\"\nbundle = \"box.h5\"\n[[organ]]\nname = \"two\"\n"
         "bundle = \"box.h5\"\nposition = [200, 0, 0]\nturn = [0, 0, 90]\n" +
             kFar + "[[obstacle]]\nname = \"plate\"\nkind = \"disc\"\nradius = 90\nnormal = [0, 0, -1]\n" +
             "path = [[0, 175, 30, 42], [0.05, 175, 30, 39]]\n" + kRidge + "organs = [\"one\"]\n";
  played("scene.toml -o out --export out.glb");
  const std::vector<Row> rows = rows_of("out/obstacles.csv");
  ASSERT_EQ(rows.size(), 3 * 101u);
  const Row& last = rows[3 * 100 + 2];
  EXPECT_EQ(rows[0].at("organ"), "one");
  EXPECT_EQ(last.at("organ"), "two");
  EXPECT_EQ(last.at("obstacle"), "plate");
  EXPECT_GT(number(last, "force_z_N"), 0.05);
  EXPECT_EQ(number(rows[3 * 100], "nodes"), 0) << "the first organ is apart";
  EXPECT_EQ(summary_of()["organs"][0]["obstacles"].size(), 2u);
  EXPECT_EQ(summary_of()["organs"][1]["obstacles"].size(), 1u);
  EXPECT_THAT(file_bytes(folder_ / "out.glb"), HasSubstr("\"name\":\"ridge\""));
}

// A node of its own for each, which the animation moves where the obstacle moves.
TEST_F(ObstacleScene, ExportsThemToGltf) {
  write_scene(kFar + kPlate + kRidge);
  played("scene.toml -o out --export out.glb");
  const std::string bytes = file_bytes(folder_ / "out.glb");
  std::uint32_t size = 0;
  std::memcpy(&size, bytes.data() + 12, 4);
  const auto gltf = nlohmann::json::parse(bytes.substr(20, size));
  ASSERT_EQ(gltf["nodes"].size(), 4u) << "the world, the box and two obstacles";
  EXPECT_EQ(gltf["nodes"][2]["name"], "plate");
  EXPECT_EQ(gltf["nodes"][0]["children"].size(), 3u);
  int moved = 0;
  for (const auto& channel : gltf["animations"][0]["channels"]) moved += channel["target"]["node"] == 2;
  EXPECT_EQ(moved, 2) << "its place and its turn";
  for (const auto& channel : gltf["animations"][0]["channels"]) EXPECT_NE(channel["target"]["node"], 3);
}

}  // namespace
}  // namespace palpate
