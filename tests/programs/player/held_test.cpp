// palpate-run plays links and grasps: what it writes is what the C API says.
#include <gmock/gmock.h>
#include <palpate/palpate_scene_def.hpp>

#include <cmath>

#include "programs/player/held_tissue.h"
#include "programs/player/tool_turn.h"
#include "tests/programs/player/played_scene.h"

namespace palpate {
namespace {

using namespace tests;
using testing::HasSubstr;

double length_of(const Row& row, const std::string& name, const std::string& unit) {
  return std::hypot(number(row, name + "_x_" + unit), number(row, name + "_y_" + unit),
                    number(row, name + "_z_" + unit));
}

// The box is 60 x 50 x 40 mm, held at x = 0. The forceps hold its far face, lift it by 4 mm and turn it by 20 degrees about x.
const std::string kForceps =
    "[[tool]]\nname = \"forceps\"\npath = [[0, 60, 25, 20], [0.1, 60, 25, 24]]\nturn = [[0, 0, 0, 0], [0.1, 20, 0, "
    "0]]\n[tool.grasp]\nnear = [60, 25, 20]\nradius = 12\n";

class HeldScene : public PlayedScene {};

TEST_F(HeldScene, LiftsAndTurnsTheOrganWithAGraspAsTheCApiDoes) {
  write_scene(kForceps);
  const ProgramRun ended = played("scene.toml -o out");
  const std::vector<Row> forces = rows_of("out/forces.csv"), grasps = rows_of("out/grasps.csv");
  ASSERT_EQ(forces.size(), 101u);
  ASSERT_EQ(grasps.size(), 101u);

  palpate_bundle* bundle = nullptr;
  ASSERT_EQ(palpate_bundle_open_file((folder_ / "box.h5").c_str(), nullptr, &bundle, nullptr), PALPATE_OK);
  SceneConfig config;
  config.tools.emplace_back().grasp.emplace();
  config.tools[0].grasp->near = {0.06, 0.025, 0.02}, config.tools[0].grasp->radius = 0.012;
  HeldTissue held(config, bundle);
  SceneDef def;
  def.grasps.grasps = 1, def.max_tools = 1;
  palpate_scene* scene = nullptr;
  ASSERT_EQ(palpate_scene_create(bundle, &def, &scene, nullptr), PALPATE_OK);
  std::vector<double> memory(palpate_contacts_bytes(scene) / sizeof(double) + 1);
  auto* contacts = reinterpret_cast<palpate_contacts*>(memory.data());
  double most_torque = 0;
  for (int step = 0; step <= 100; ++step) {
    const double share = step / 100.0, half = share * M_PI / 18;
    palpate_grasp grasp = *held.grasp(0);
    grasp.position[0] = 0.06, grasp.position[1] = 0.025, grasp.position[2] = 0.02 + share * 0.004;
    grasp.orientation[0] = std::cos(half), grasp.orientation[1] = std::sin(half);
    palpate_tool tool = palpate_default_tool();
    tool.parts = &grasp.part, tool.has_torque = 1;
    std::copy(grasp.position, grasp.position + 3, tool.reference);
    palpate_scene_touch(scene, &tool, 1, 1e-3, contacts, memory.size() * sizeof memory[0]);
    const palpate_tool_state& state = *palpate_contacts_tool(contacts, 0);
    const char* axes[3] = {"x", "y", "z"};
    for (int d = 0; d < 3; ++d) {
      // The path and the turn are evaluated in another order of roundings: 1e-15 of 0.04 m, over a displacement of 4e-5 m.
      EXPECT_NEAR(number(forces[step], std::string("force_") + axes[d] + "_N"), state.force[d], 1e-9);
      EXPECT_NEAR(number(forces[step], std::string("torque_") + axes[d] + "_Nm"), state.torque[d], 1e-11);
      EXPECT_NEAR(number(grasps[step], std::string("torque_") + axes[d] + "_Nm"), state.torque_raw[d], 1e-11);
    }
    EXPECT_EQ(grasps[step].at("condition"), "holds");
    most_torque = std::max(most_torque, std::fabs(state.torque_raw[0]));
  }
  EXPECT_GT(most_torque, 1e-3);  // it turns at all
  palpate_scene_destroy(scene);
  palpate_bundle_close(bundle);

  const auto summary = summary_of();
  EXPECT_EQ(summary["tools"][0]["grasp"]["discs"], 1);
  EXPECT_NEAR(summary["tools"][0]["grasp"]["peak_torque_Nm"].get<double>(), length_of(grasps[100], "torque", "Nm"),
              1e-12);
  EXPECT_THAT(ended.errors, HasSubstr("grasp of tool \"forceps\": "));
  EXPECT_THAT(file_bytes(folder_ / "out/shapes.pvd"), HasSubstr("shapes/held_000000.vtu"));
}

TEST_F(HeldScene, OpensAndClosesJawsWhenItsSceneSaysSo) {
  write_scene(kForceps + "closed = [[0.02, 0.04], [0.06, 0.2]]\n");
  played("scene.toml -o out");
  const std::vector<Row> rows = rows_of("out/grasps.csv");
  const auto condition = [&](int step) { return rows.at(step).at("condition"); };
  const auto force = [&](int step) { return length_of(rows.at(step), "force", "N"); };
  EXPECT_EQ(condition(19), "open");
  EXPECT_EQ(condition(20), "holds");
  EXPECT_LT(force(20), 1e-9) << "it closes without a force";
  EXPECT_GT(force(39), 0.01);
  EXPECT_EQ(condition(40), "open");
  EXPECT_LT(force(60), 1e-9) << "it closes anew";
  EXPECT_GT(force(100), 0.01);
}

TEST_F(HeldScene, SlipsAndLetsGoAndSaysWhen) {
  write_scene(kForceps + "friction = 0.5\nclamp_force = 0.02\n");
  const ProgramRun ended = played("scene.toml -o out");
  const std::vector<Row> rows = rows_of("out/grasps.csv");
  EXPECT_EQ(rows.back().at("condition"), "slips");
  for (const Row& row : rows) EXPECT_LT(length_of(row, "force", "N"), 0.5 * 0.02 * 1.01);
  EXPECT_GT(number(rows.back(), "slipped_m"), 1e-3);
  EXPECT_THAT(ended.errors, HasSubstr("; slipped by"));
}

TEST_F(HeldScene, WarnsOfAGraspThatLetGoAndOfJawsThatAreNotOnOneFold) {
  // It slips as above, by more than the smaller radius.
  std::string small = kForceps + "friction = 0.5\nclamp_force = 0.02\n";
  small.replace(small.find("radius = 12"), 11, "radius = 1");
  write_scene(small);
  const ProgramRun slipped = run("scene.toml -o out --strict");
  EXPECT_EQ(slipped.code, 3);
  EXPECT_THAT(slipped.errors, HasSubstr("warning: the grasp of tool \"forceps\""));
  const auto summary = summary_of();
  EXPECT_THAT(summary["warnings"].dump(), HasSubstr("let go at"));
  write_scene(
      "[[tool]]\nname = \"forceps\"\npath = [[0, 50, 25, 20], [0.01, 50, 25, 20]]\n[tool.grasp]\nnear = [50, 0, 20]\n"
      "opposite = [50, 50, 20]\nradius = 4\n");
  EXPECT_THAT(run("scene.toml -o wide").errors, HasSubstr("warning: the jaws of tool \"forceps\" take hold 50 mm"));
}

// From the far face to a point 40 mm beside it, and a suture across the edge at x = 60, z = 40.
const std::string kLinks =
    "[[link]]\nname = \"ligament\"\nkind = \"spring\"\nplaces = [[60, 25, 20]]\nworld = [100, 25, 20]\nrest_lengths = "
    "[[0, 40], [0.05, 30]]\nstiffness = 20\n"
    "[[link]]\nname = \"suture, of three\"\nkind = \"thread\"\nplaces = [[60, 40, 30], [50, 40, 40], [60, 10, "
    "30]]\nrest_lengths = [[0, 60], [0.05, 40]]\nradius = 5\n";
const std::string kIdle =
    "[[tool]]\nname = \"probe\"\npoints = [[0, 0, 0]]\npath = [[0, 30, 25, 80], [0.1, 30, 25, 80]]\n";

TEST_F(HeldScene, DrawsLinksAsTheSceneSays) {
  write_scene(kIdle + kLinks);
  const ProgramRun ended = played("scene.toml -o out");
  const std::vector<Row> rows = rows_of("out/links.csv");
  ASSERT_EQ(rows.size(), 303u);  // three stretches
  const auto of = [&](int step, int stretch) { return rows.at(3 * step + stretch); };
  // At the begin the spring is as long as at rest, and pulls with what 20 N/m make of the rest.
  EXPECT_NEAR(number(of(0, 0), "tension_N"), 0, 1e-6);
  const Row last = of(100, 0);
  EXPECT_NEAR(number(last, "rest_length_m"), 0.03, 1e-12);
  EXPECT_NEAR(number(last, "tension_N"), 20 * (number(last, "length_m") - 0.03), 2e-4 * number(last, "tension_N"));
  EXPECT_GT(number(last, "tension_N"), 0.02);
  EXPECT_NEAR(number(last, "second_x_m"), 0.1, 1e-12);
  // The thread slides through its middle place: the whole keeps its length, and both parts pull alike.
  const std::string text = file_bytes(folder_ / "out/links.csv");
  EXPECT_THAT(text, HasSubstr("\"suture, of three\",2,taut"));
  const auto summary = summary_of();
  ASSERT_EQ(summary["links"].size(), 3u);
  EXPECT_GT(summary["links"][1]["peak_tension_N"].get<double>(), 0.05);
  // 50 steps after it was drawn the share of the length still settles: 5 % apart here.
  EXPECT_NEAR(number(of(100, 1), "tension_N"), number(of(100, 2), "tension_N"), 8e-2 * number(of(100, 1), "tension_N"));
  EXPECT_NEAR(number(of(100, 1), "rest_length_m") + number(of(100, 2), "rest_length_m"), 0.04, 1e-12);
  EXPECT_THAT(ended.errors, HasSubstr("link \"suture, of three 2\": "));
}

TEST_F(HeldScene, BreaksALinkAndSaysWhen) {
  write_scene(kIdle + kLinks.substr(0, kLinks.find("[[link]]", 1)) + "breaking_force = 0.01\n");
  const ProgramRun ended = played("scene.toml -o out");
  EXPECT_THAT(ended.errors, HasSubstr("1 of 101 touches raised LINK_BROKE"));
  EXPECT_THAT(ended.errors, HasSubstr("; broke at 0.0"));
  EXPECT_EQ(rows_of("out/links.csv").back().at("condition"), "broken");
}

TEST_F(HeldScene, RecordsAndReplaysLinksAndGrasps) {
  write_scene(kForceps + kLinks);
  expect_replayed({"forces.csv", "links.csv", "grasps.csv"});
  write_scene(kForceps + kLinks + "stiffness = 5\n");
  EXPECT_THAT(run("scene.toml --replay run.record").errors, HasSubstr("found another \"link\""));
  write_scene(kForceps + "friction = 1\n" + kLinks);
  EXPECT_THAT(run("scene.toml --replay run.record").errors, HasSubstr("found another \"tool\""));
}

TEST_F(HeldScene, ExplainsWhatLinksCost) {
  write_scene(kForceps + kLinks);
  const ProgramRun ended = played("scene.toml --explain");
  EXPECT_THAT(ended.out, HasSubstr("touch   links"));
  EXPECT_THAT(ended.out, HasSubstr("touch   grasps"));
}

TEST_F(HeldScene, RefusesAPlaceThatIsFarFromTheOrgan) {
  write_scene(kIdle + "[[link]]\nname = \"far\"\nkind = \"thread\"\nplaces = [[60, 25, 20], [9999, 0, 0]]\n");
  expect_refused("scene.toml -o out", "scene.toml:8: link \"far\": places: ");
  write_scene("[[tool]]\nname = \"forceps\"\npath = [[0, 0, 0, 0]]\n[tool.grasp]\nnear = [9999, 0, 0]\nradius = 3\n");
  expect_refused("scene.toml -o out", "scene.toml:7: tool \"forceps\": grasp.near: ");
}

TEST(ToolTurn, IsARotationByTheAngleAboutTheAxis) {
  const std::vector<SceneConfig::KeyFrame> turn = {{0, {0, 0, 0}}, {1, {0, 0, 180}}, {2, {0, 0, 900}}};
  const auto at = [&](double time) { return turned(turn_at(turn, time), {1, 0, 0}); };
  // Sums of a few products of numbers of size 1.
  EXPECT_NEAR(at(0.5)[1], 1, 1e-14);
  EXPECT_NEAR(at(1)[0], -1, 1e-14);
  EXPECT_NEAR(at(1.125)[0], 0, 1e-13);  // 270 degrees
  EXPECT_NEAR(at(1.125)[1], -1, 1e-13);
  EXPECT_EQ(at(0), (SceneConfig::Vector{1, 0, 0}));
  EXPECT_EQ(turn_at({}, 1), kNoTurn);
  // The quaternion turns alike, from each of its four branches.
  for (const SceneConfig::Vector degrees :
       {SceneConfig::Vector{10, 20, 30}, {175, 10, 5}, {10, 175, 5}, {5, 10, 175}, {0, 0, 180}}) {
    const Rotation r = turn_at({{0, degrees}}, 0);
    const auto q = quaternion_of(r);
    for (std::size_t d = 0; d < 3; ++d) {
      double v[3] = {}, out[3];
      v[d] = 1;
      palpate_vector_to_world(q.data(), v, out);
      for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(out[i], r[i][d], 1e-14);
    }
  }
}

}  // namespace
}  // namespace palpate
