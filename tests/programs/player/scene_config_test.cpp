#include "formats/scene_config.h"

#include <gmock/gmock.h>

#include <fstream>

#include "formats/errors.h"
#include "formats/scene_holds.h"
#include "programs/player/organ_motions.h"
#include "tests/support/test_files.h"
#include "tests/support/texts.h"

namespace palpate {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

class SceneFile : public testing::Test {
 protected:
  void SetUp() override { folder_ = tests::fresh_folder(); }

  std::filesystem::path write(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }

  // A scene with one tool whose lines are given.
  SceneConfig read(const std::string& tool, const std::string& head = "") {
    return read_scene_config(
        write("scene.toml", "name = \"s\"\nunit = \"mm\"\n" + head + "[[tool]]\nname = \"t\"\n" + tool));
  }

  std::string refusal_of(const std::string& tool) {
    return tests::input_error([&] { read(tool); });
  }
  void expect_refused(const std::string& tool, const std::string& head, const std::string& part_of_sentence) {
    EXPECT_THAT(tests::input_error([&] { read(tool, head); }),
                AllOf(HasSubstr("scene.toml:"), HasSubstr(part_of_sentence)));
  }
  void expect_file_refused(const std::string& text, const std::string& part_of_sentence) {
    EXPECT_THAT(tests::input_error([&] { read_scene_config(write("scene.toml", text)); }), HasSubstr(part_of_sentence));
  }

  std::filesystem::path folder_;
};

const std::string kPoint = "points = [[0, 0, 0]]\n";
const std::string kPath = "path = [[0, 1, 2, 3]]\n";

TEST_F(SceneFile, GivesEveryLengthInMetres) {
  const SceneConfig scene = read(
      "points = [[1, 0, 0]]\npath = [[0, 0, 0, 5], [2, 0, 0, 7]]\ncapsule = { radius = 4, length = 10, axis = [0, 3, "
      "0], "
      "samples = 9 }\n[[tool.grip]]\nnearest = [1, 2, 3]\naxes = \"zx\"\n",
      "bundle = \"b/x.h5\"\n");
  const auto& tool = scene.tools.at(0);
  EXPECT_EQ(scene.bundle, folder_ / "b/x.h5");
  EXPECT_DOUBLE_EQ(tool.points.at(0)[0], 0.001);
  EXPECT_DOUBLE_EQ(tool.path.at(1).position[2], 0.007);
  EXPECT_DOUBLE_EQ(tool.path.at(1).time, 2);
  EXPECT_DOUBLE_EQ(tool.capsule->radius, 0.004);
  EXPECT_THAT(tool.capsule->axis, ElementsAre(0, 1, 0));
  EXPECT_EQ(tool.grips.at(0).axes, 5u);
  EXPECT_DOUBLE_EQ((*tool.grips.at(0).nearest)[1], 0.002);
}

TEST_F(SceneFile, HasTheRuntimesDefaults) {
  const SceneConfig scene = read(kPoint + kPath);
  EXPECT_EQ(scene.def.collision, PALPATE_COLLISION_REST);
  EXPECT_EQ(scene.def.contact, PALPATE_CONTACT_POINT);
  EXPECT_EQ(scene.def.shape, PALPATE_SHAPE_SURFACE);
  EXPECT_EQ(scene.touch_hz, 1000);
}

TEST_F(SceneFile, MakesAPatchOfAToolWithARadius) {
  const SceneConfig scene =
      read(kPoint + kPath + "disc_radius = 3\nfriction = 0.2\n", "[effects]\nlaw = \"coulomb\"\n");
  EXPECT_EQ(scene.def.contact, PALPATE_CONTACT_PATCH);
  EXPECT_EQ(scene.def.law, PALPATE_LAW_COULOMB);
  EXPECT_DOUBLE_EQ(scene.tools.at(0).disc_radius, 0.003);
  EXPECT_DOUBLE_EQ(scene.tools.at(0).friction, 0.2);
  expect_refused(kPoint + kPath + "disc_radius = 0\n", "", "scene.toml:7: [[tool]] 1: disc_radius: ");
  expect_refused(kPoint + kPath + "disc_radius = 1001\n", "", "a length of at most 1 m");
  expect_refused(kPoint + kPath + "disc_radius = 3\n", "[effects]\ncontact = \"point\"\n", "contact = \"patch\"");
  expect_refused(kPoint + kPath + "friction = 0.2\n", "", "law = \"coulomb\" in [effects], since tool \"t\"");
  expect_refused(kPoint + kPath + "friction = -1\n", "[effects]\nlaw = \"coulomb\"\n", "a coefficient of 0 to 100");
}

TEST_F(SceneFile, TakesAGraspAndTheTurnOfATool) {
  const SceneConfig scene = read(kPath +
                                 "turn = [[0, 0, 0, 0], [2, 0, 0, 90]]\n[tool.grasp]\nnear = [1, 2, 3]\nopposite = [1, "
                                 "2, 9]\nradius = 5\nclosing = [[0, 0], [1, 2]]\nfriction = 0.4\nclosed = [[0, 1], [1, "
                                 "2]]\n");
  EXPECT_EQ(scene.def.contact, PALPATE_CONTACT_PATCH);
  const SceneConfig::Tool& tool = scene.tools.at(0);
  EXPECT_THAT(tool.turn.at(1).position, ElementsAre(0, 0, 90));
  EXPECT_DOUBLE_EQ(tool.grasp->near[2], 0.003);
  EXPECT_DOUBLE_EQ((*tool.grasp->opposite)[2], 0.009);
  EXPECT_DOUBLE_EQ(tool.grasp->radius, 0.005);
  EXPECT_DOUBLE_EQ(tool.grasp->closing.at(1)[1], 0.002);
  EXPECT_DOUBLE_EQ(*tool.grasp->friction, 0.4);
  EXPECT_EQ(tool.grasp->closed.size(), 2u);
}

TEST_F(SceneFile, RefusesAGraspThatCannotHoldWithLineAndKey) {
  const std::string grasp = kPath + "[tool.grasp]\nnear = [1, 2, 3]\n";
  const auto refused = [&](const std::string& keys, const std::string& sentence) {
    expect_refused(grasp + keys, "", sentence);
  };
  refused("", "grasp: the key \"radius\"");
  refused("radius = 0\n", "scene.toml:8: [[tool]] 1.grasp: radius: ");
  refused("radius = 1001\n", "a length of at most 1 m");
  refused("radius = 5\nclosing = [[0, 1]]\n", "opposite = ");
  refused("radius = 5\nopposite = [0, 0, 0]\nclosing = [[0, -1]]\n", "closing[0]: ");
  refused("radius = 5\nopposite = [0, 0, 0]\nclosing = [[1, 1], [1, 2]]\n", "closing[1]: ");
  refused("radius = 5\nfriction = -0.1\n", "a coefficient of 0 to 100");
  refused("radius = 5\nclamp_force = 2\n", "friction as well");
  refused("radius = 5\nfriction = 1\nclamp_force = -2\n", "a force of at least 0 N");
  refused("radius = 5\nfriction = 1\nclamp_force = 2\nopposite = [0, 0, 0]\n", "clamp_force beside opposite");
  refused("radius = 5\nclosed = [[1, 1]]\n", "closed[0]: ");
  refused("radius = 5\ncolour = 1\n", "unknown key \"colour\"");
  expect_refused(grasp + "radius = 5\n", "[effects]\ncontact = \"point\"\n", "contact = \"patch\"");
  expect_refused(kPoint + kPath + "turn = [[1, 0, 0, 0], [0, 0, 0, 0]]\n", "", "turn[1]: expected a time");
  expect_refused(kPoint + kPath + "turn = [[0, 0, 0, 1e7]]\n", "", "turn[0]: ");
}

TEST_F(SceneFile, TakesANeedle) {
  const SceneConfig scene = read(kPath +
                                     "[tool.needle]\nentry = [1, 2, 3]\ndirection = [0, 0, -2]\nradius = 0.6\n"
                                     "friction = 20\npuncture_force = 0.5\ncutting_force = 0.2\nspacing = 2\n",
                                 "[limits]\nneedle_places = 12\n");
  EXPECT_EQ(scene.def.needles.needle_places, 12);
  const SceneConfig::Needle& needle = *scene.tools.at(0).needle;
  EXPECT_DOUBLE_EQ((*needle.entry)[2], 0.003);
  EXPECT_THAT(*needle.direction, ElementsAre(0, 0, -2));
  EXPECT_DOUBLE_EQ(needle.radius, 0.0006);
  EXPECT_DOUBLE_EQ(needle.friction, 20);
  EXPECT_DOUBLE_EQ(needle.puncture_force, 0.5);
  EXPECT_DOUBLE_EQ(needle.cutting_force, 0.2);
  EXPECT_DOUBLE_EQ(needle.spacing, 0.002);
  const SceneConfig placed = read("near = [1, 2, 3]\ndepth = [[0, 0]]\n[tool.needle]\nradius = 0.6\n");
  EXPECT_FALSE(placed.tools.at(0).needle->entry);
  EXPECT_DOUBLE_EQ(placed.tools.at(0).needle->spacing, 0.005);
}

TEST_F(SceneFile, RefusesANeedleThatCannotPierceWithLineAndKey) {
  const std::string needle = kPath + "[tool.needle]\nentry = [1, 2, 3]\n";
  const auto refused = [&](const std::string& keys, const std::string& sentence) {
    expect_refused(needle + keys, "", sentence);
  };
  refused("", "needle: the key \"radius\"");
  refused("radius = 0\n", "scene.toml:8: [[tool]] 1.needle: radius: ");
  refused("radius = 10.5\n", "a length of at most 10 mm");
  refused("radius = 1\ndirection = [0, 0, 0]\n", "a direction that is not zero");
  refused("radius = 1\nfriction = -1\n", "a friction of 0 to 1e6 N/m");
  refused("radius = 1\npuncture_force = 1e7\n", "puncture_force: ");
  refused("radius = 1\ncutting_force = -1\n", "cutting_force: ");
  refused("radius = 1\nspacing = 0.05\n", "a length of 0.1 mm to 1 m");
  refused("radius = 1\ncolour = 1\n", "unknown key \"colour\"");
  expect_refused(needle + "radius = 1\n", "[limits]\nneedle_places = 65\n", "a whole number of 2 to 64");
  expect_refused(kPath + "[tool.needle]\nradius = 1\n", "", "entry: ");
  expect_refused("near = [1, 2, 3]\ndepth = [[0, 0]]\n[tool.needle]\nradius = 1\nentry = [0, 0, 0]\n", "", "no entry");
}

TEST_F(SceneFile, TakesLinksOfEachKind) {
  const SceneConfig scene =
      read(kPoint + kPath +
           "[[link]]\nname = \"suture\"\nkind = \"thread\"\nplaces = [[1, 2, 3], [4, 5, 6], [7, 8, "
           "9]]\nrest_lengths = [[0, 12], [1, 6]]\nbreaking_force = 5\nradius = 2\n"
           "[[link]]\nname = \"ligament\"\nkind = \"spring\"\nplaces = [[1, 2, 3]]\nworld = [0, 0, "
           "50]\nrest_length = 40\nstiffnesses = [[0, 50], [1, 5]]\n"
           "[[link]]\nname = \"clip\"\nkind = \"clip\"\nplaces = [[1, 2, 3], [4, 5, 6]]\nstiffness "
           "= 300\n");
  EXPECT_EQ(scene.def.contact, PALPATE_CONTACT_PATCH);  // of the radius
  ASSERT_EQ(scene.links.size(), 3u);
  const SceneConfig::Link &suture = scene.links[0], &ligament = scene.links[1], &clip = scene.links[2];
  EXPECT_DOUBLE_EQ(suture.places.at(2)[0], 0.007);
  EXPECT_DOUBLE_EQ(suture.rest_length.at(1)[1], 0.006);
  EXPECT_EQ(*suture.breaking_force, 5);
  EXPECT_DOUBLE_EQ(suture.radius, 0.002);
  EXPECT_DOUBLE_EQ((*ligament.world)[2], 0.05);
  EXPECT_DOUBLE_EQ(ligament.rest_length.at(0)[1], 0.04);
  EXPECT_EQ(ligament.stiffness.at(1)[1], 5);
  EXPECT_EQ(clip.kind, SceneConfig::Link::Kind::clip);
  EXPECT_EQ(clip.stiffness.at(0)[1], 300);
}

TEST_F(SceneFile, TakesMotionsOfEachKindOfAmount) {
  std::ofstream(folder_ / "breath.csv") << "time,amount\n0,0\r\n# in\n1.5, 8\n3,0\n";
  const SceneConfig scene = read(kPoint + kPath +
                                 "[[motion]]\nname = \"diaphragm\"\nsine = { amplitude = 5, period = 4, mean = 2 }\n"
                                 "[[motion]]\nname = \"tilt\"\namounts = [[0, -3], [2, 3]]\n"
                                 "[[motion]]\nname = \"filling\"\namounts_csv = \"breath.csv\"\n");
  EXPECT_EQ(scene.def.collision, PALPATE_COLLISION_DEFORMED);  // of the motions
  ASSERT_EQ(scene.motions.size(), 3u);
  EXPECT_DOUBLE_EQ(amount_at(scene.motions[0], 1), 7);
  EXPECT_NEAR(amount_at(scene.motions[0], 4 * 250 + 3), -3, 1e-9);
  EXPECT_DOUBLE_EQ(amount_at(scene.motions[1], 0.5), -1.5);
  EXPECT_DOUBLE_EQ(amount_at(scene.motions[1], 9), 3);
  EXPECT_DOUBLE_EQ(amount_at(scene.motions[2], 0.75), 4);
}

TEST_F(SceneFile, TakesLoadsOfEachKind) {
  const SceneConfig scene = read(kPoint + kPath +
                                 "[[load]]\nname = \"swab\"\nnear = [1, 2, 3]\nradius = 4\nforce = [0, 0, -0.5]\n"
                                 "[[load]]\nname = \"blade\"\nat = \"foremost\"\nradius = 5\nframe = \"organ\"\n"
                                 "tractions = [[0, 0, 0, 0], [2, 0, 300, 0]]\n");
  EXPECT_EQ(scene.def.collision, PALPATE_COLLISION_DEFORMED);  // of the loads
  ASSERT_EQ(scene.loads.size(), 2u);
  const SceneConfig::Load &swab = scene.loads[0], &blade = scene.loads[1];
  EXPECT_DOUBLE_EQ((*swab.near)[2], 0.003);
  EXPECT_DOUBLE_EQ(swab.radius, 0.004);
  EXPECT_TRUE(swab.in_world && !swab.per_area && !swab.at);
  ASSERT_EQ(swab.vectors.size(), 1u);
  EXPECT_EQ(swab.vectors[0].position[2], -0.5) << "newtons have no unit of length";
  EXPECT_EQ(*blade.at, SceneConfig::Place::At::foremost);
  EXPECT_TRUE(blade.per_area && !blade.in_world);
  ASSERT_EQ(blade.vectors.size(), 2u);
  EXPECT_EQ(blade.vectors[1].position[1], 300);
}

TEST_F(SceneFile, TakesAToolThatPressesWithAForceAndRefusesOneThatCannotBe) {
  const std::string begin = kPoint + kPath + "[tool.given_force]\n";
  const SceneConfig scene = read(begin + "forces = [[0, 0, 0, 0], [2, 1, 0, -3]]\nspeed = 50\n");
  const SceneConfig::GivenForce& given = *scene.tools.at(0).given_force;
  ASSERT_EQ(given.forces.size(), 2u);
  EXPECT_EQ(given.forces[1].position[2], -3);
  EXPECT_DOUBLE_EQ(*given.speed, 0.05);
  EXPECT_EQ(read(begin + "force = [0, 1, 0]\n").tools.at(0).given_force->forces.at(0).position[1], 1);
  const auto refused = [&](const std::string& keys, const std::string& sentence) {
    expect_refused(begin + keys, "", sentence);
  };
  refused("", "force: ");
  refused("force = [0, 0, 1]\nforces = [[0, 0, 0, 1]]\n", "forces: ");
  refused("forces = []\n", "forces: ");
  refused("forces = [[1, 0, 0, 0], [0, 0, 0, 0]]\n", "forces[1]: ");
  refused("force = [0, 0, 2e6]\n", "force: ");
  refused("force = [0, 0, 1]\nspeed = 0\n", "speed: ");
  refused("force = [0, 0, 1]\ncolour = 1\n", "unknown key \"colour\"");
  refused("force = [0, 0, 1]\n[tool.grasp]\nnear = [0, 0, 0]\nradius = 3\n", "given_force: ");
}

TEST_F(SceneFile, RefusesALoadThatCannotBeWithLineAndKey) {
  const auto refused = [&](const std::string& keys, const std::string& sentence, const std::string& head = "") {
    expect_refused(kPoint + kPath + "[[load]]\nname = \"swab\"\n" + keys, head, sentence);
  };
  const std::string near = "near = [0, 0, 0]\n", radius = "radius = 3\n", force = "force = [0, 0, 1]\n";
  refused(radius + force, "at: ");
  refused(near + "at = \"foremost\"\n" + radius + force, "near: ");
  refused("at = \"top\"\n" + radius + force, "at: ");
  refused(near + force, "the key \"radius\"");
  refused(near + "radius = 0\n" + force, "radius: ");
  refused(near + "radius = 1001\n" + force, "radius: ");
  refused(near + radius, "force: ");
  refused(near + radius + force + "traction = [0, 0, 1]\n", "traction: ");
  refused(near + radius + "force = [0, 0, inf]\n", "force");
  refused(near + radius + "forces = [[1, 0, 0, 0], [1, 0, 0, 0]]\n", "forces[1]: ");
  refused(near + radius + "forces = []\n", "forces: ");
  refused(near + radius + force + "frame = \"patient\"\n", "frame: ");
  refused(near + radius + force + "colour = 1\n", "unknown key \"colour\"");
  const std::string whole = near + radius + force;
  refused(whole, "since the scene has loads", "[effects]\ncollision = \"rest\"\n");
  refused(whole + "[[load]]\nname = \"swab\"\n" + whole, "found \"swab\"");
  std::string five = whole;
  for (const char* name : {"b", "c", "d", "e"}) five += std::string("[[load]]\nname = \"") + name + "\"\n" + whole;
  refused(five, "at most 4 loads on an organ");
}

TEST_F(SceneFile, TakesObstaclesOfEachShape) {
  std::ofstream(folder_ / "way.csv") << "time,x,y,z\n0,1,2,3\n2,4,5,6\n";
  const SceneConfig scene =
      read(kPoint + kPath + "[[obstacle]]\nname = \"table\"\nkind = \"rectangle\"\nsize = [300, 200]\n" +
           "normal = [0, -2, 0]\nposition = [1, 2, 3]\nfriction = 0.4\n"
           "[[obstacle]]\nname = \"plate\"\nkind = \"disc\"\nradius = 15\ndepth = 5\npath_csv = \"way.csv\"\n"
           "turn = [[0, 0, 0, 0], [3, 0, 0, 90]]\n"
           "[[obstacle]]\nname = \"rib\"\nkind = \"mesh\"\nfile = \"rib.stl\"\n");
  EXPECT_EQ(scene.def.collision, PALPATE_COLLISION_DEFORMED);  // of the obstacles
  ASSERT_EQ(scene.obstacles.size(), 3u);
  using Kind = SceneConfig::Obstacle::Kind;
  const SceneConfig::Obstacle &table = scene.obstacles[0], &plate = scene.obstacles[1], &rib = scene.obstacles[2];
  EXPECT_EQ(table.kind, Kind::rectangle);
  EXPECT_DOUBLE_EQ(table.size[1], 0.2);
  EXPECT_EQ(table.normal[1], -2);
  EXPECT_EQ(table.friction, 0.4);
  ASSERT_EQ(table.path.size(), 1u);
  EXPECT_DOUBLE_EQ(table.path[0].position[2], 0.003);
  EXPECT_EQ(plate.kind, Kind::disc);
  EXPECT_DOUBLE_EQ(plate.size[0], 0.015);
  EXPECT_DOUBLE_EQ(*plate.depth, 0.005);
  ASSERT_EQ(plate.path.size(), 2u);
  EXPECT_DOUBLE_EQ(plate.path[1].position[0], 0.004);
  EXPECT_EQ(plate.turn[1].position[2], 90);
  EXPECT_EQ(rib.kind, Kind::mesh);
  EXPECT_EQ(rib.surface->file, folder_ / "rib.stl");
  EXPECT_EQ(rib.surface->metres_per_unit, 1e-3) << "the scene's unit";
}

TEST_F(SceneFile, RefusesAnObstacleThatCannotBeWithLineAndKey) {
  const auto refused = [&](const std::string& keys, const std::string& sentence, const std::string& head = "") {
    expect_refused(kPoint + kPath + "[[obstacle]]\nname = \"table\"\n" + keys, head, sentence);
  };
  const std::string disc = "kind = \"disc\"\nradius = 5\n", mesh = "kind = \"mesh\"\nfile = \"a.stl\"\n";
  refused("", "the key \"kind\"");
  refused("kind = \"disk\"\nradius = 5\n", "did you mean \"disc\"");
  refused("kind = \"disc\"\n", "the key \"radius\"");
  refused("kind = \"disc\"\nradius = 0\n", "radius: ");
  refused("kind = \"rectangle\"\n", "the key \"size\"");
  refused("kind = \"rectangle\"\nsize = [3, 0]\n", "size: ");
  refused("kind = \"rectangle\"\nsize = [3, 4, 5]\n", "size: ");
  refused("kind = \"mesh\"\n", "the key \"file\"");
  refused(disc + "size = [3, 4]\n", "size: ");
  refused(disc + "file = \"a.stl\"\n", "file: ");
  refused(disc + "unit = \"mm\"\n", "unit: ");
  refused(mesh + "unit = \"inch\"\n", "unit: ");
  refused(mesh + "normal = [0, 0, 1]\n", "normal: ");
  refused(disc + "normal = [0, 0, 0]\n", "normal: ");
  refused(disc + "position = [0, 0, 0]\npath = [[0, 0, 0, 0]]\n", "path: ");
  refused(disc + "path = []\n", "path: ");
  refused(disc + "path = [[1, 0, 0, 0], [0, 0, 0, 0]]\n", "path[1]: ");
  refused(disc + "path = [[0, 0, 0, 0]]\npath_csv = \"way.csv\"\n", "path: ");
  refused(disc + "turn = [[0, 0, 0, 2e6]]\n", "turn[0]: ");
  refused(disc + "friction = -1\n", "friction: ");
  refused(disc + "depth = 0\n", "depth: ");
  refused(disc + "organs = [\"liver\"]\n", "organs: ");
  refused(disc + "fricton = 1\n", "did you mean \"friction\"");
  refused(disc, "meets a surface that has moved", "[effects]\ncollision = \"rest\"\n");
  refused(disc + "[[obstacle]]\nname = \"table\"\n" + disc, "found \"table\"");
  std::string many = disc;
  for (int i = 0; i < 16; ++i) many += "[[obstacle]]\nname = \"" + std::to_string(i) + "\"\n" + disc;
  refused(many, "at most 16 obstacles");
}

TEST_F(SceneFile, GivesEachOrganTheObstaclesThatHoldItOff) {
  const std::string disc = "kind = \"disc\"\nradius = 5\n";
  const std::string organs = "[[organ]]\nname = \"liver\"\n[[organ]]\nname = \"kidney\"\n";
  const SceneConfig scene = read(kPoint + kPath + "[[obstacle]]\nname = \"table\"\n" + disc +
                                     "[[obstacle]]\nname = \"rib\"\norgans = [\"kidney\"]\n" + disc,
                                 organs);
  EXPECT_EQ(organ_scene(scene, 0).obstacles.size(), 1u);
  EXPECT_EQ(organ_scene(scene, 1).obstacles.size(), 2u);
  EXPECT_EQ(scene.organs[0].effects.def.collision, PALPATE_COLLISION_DEFORMED);
  expect_refused(kPoint + kPath + "[[obstacle]]\nname = \"rib\"\norgans = [\"lever\"]\n" + disc, organs, "organs: ");
}

TEST_F(SceneFile, TakesBladesAndRemovals) {
  std::ofstream(folder_ / "way.csv") << "time,x,y,z\n0,1,2,3\n2,4,5,6\n";
  const SceneConfig scene =
      read(kPoint + kPath + "[[blade]]\nname = \"scalpel\"\nedge = [[0, 0, 0], [0, 0, -20]]\npath_csv = \"way.csv\"\n" +
               "turn = [[0, 0, 0, 0], [1, 0, 0, 30]]\ncuts = [[0.5, 1], [1.2, 2]]\n" +
               "[[blade]]\nname = \"knife\"\nedge = [[0, 0, 0], [1, 0, 0], [1, 1, 0]]\ntoughness = 300\ndirection = "
               "[0, 0, -2]\nfriction = 500\nwidth = 10\n" +
               "[[removal]]\nname = \"hook\"\nradius = 3\npath = [[0, 1, 0, 0], [1, 2, 0, 0]]\ntimes = [[0.2, "
               "0.4]]\nevery = 0.05\ncontact_time = 0.1\n"
               "[[removal]]\nname = \"suction\"\nradius = 4\nposition = [0, 0, 9]\ntime = 1.5\n",
           "[limits]\ncut_rank = 200\n");
  EXPECT_EQ(scene.def.cut.cut, PALPATE_CUT_ON) << "of the blades";
  EXPECT_EQ(scene.def.collision, PALPATE_COLLISION_DEFORMED) << "of the cut";
  EXPECT_EQ(scene.def.cut.cut_rank, 200);
  ASSERT_EQ(scene.blades.size(), 2u);
  const SceneConfig::Blade& scalpel = scene.blades[0];
  EXPECT_DOUBLE_EQ(scalpel.edge.at(1)[2], -0.02);
  EXPECT_DOUBLE_EQ(scalpel.path.at(1).position[0], 0.004);
  EXPECT_EQ(scalpel.turn.at(1).position[2], 30);
  EXPECT_EQ(scalpel.cuts, (std::vector<std::array<double, 2>>{{0.5, 1}, {1.2, 2}}));
  EXPECT_EQ(scalpel.toughness, 0);
  EXPECT_EQ(scene.blades[1].path.size(), 1u) << "it stays at the origin";
  EXPECT_EQ(scene.blades[1].toughness, 300);
  EXPECT_EQ(scene.blades[1].direction, (SceneConfig::Vector{0, 0, -2}));
  EXPECT_EQ(scene.blades[1].friction, 500);
  EXPECT_DOUBLE_EQ(scene.blades[1].width, 0.01);
  ASSERT_EQ(scene.removals.size(), 2u);
  EXPECT_DOUBLE_EQ(scene.removals[0].radius, 0.003);
  EXPECT_EQ(scene.removals[0].every, 0.05);
  EXPECT_EQ(scene.removals[0].contact_time, 0.1);
  EXPECT_EQ(scene.removals[1].times, (std::vector<std::array<double, 2>>{{1.5, 1.5}})) << "once";
  EXPECT_EQ(scene.removals[1].every, 0.02);
  EXPECT_EQ(read(kPoint + kPath).def.cut.cut, PALPATE_CUT_OFF);
  EXPECT_EQ(read(kPoint + kPath, "[effects]\ncut = true\n").def.collision, PALPATE_COLLISION_DEFORMED);
}

TEST_F(SceneFile, RefusesBladesAndRemovalsThatCannotBeWithLineAndKey) {
  const std::string edge = "edge = [[0, 0, 0], [0, 0, -20]]\n", head = "[[blade]]\nname = \"scalpel\"\n";
  const auto refused = [&](const std::string& keys, const std::string& sentence, const std::string& effects = "") {
    expect_refused(kPoint + kPath + head + keys, effects, sentence);
  };
  refused("", "the key \"edge\"");
  refused("edge = [[0, 0, 0]]\n", "edge: expected 2 to 16 points");
  refused("edge = [[0, 0, 0], [1, 0, 0], [1, 0, 0]]\n", "edge: expected points that each differ");
  std::string long_edge = "edge = [";
  for (int i = 0; i < 17; ++i) long_edge += "[" + std::to_string(i) + ", 0, 0], ";
  refused(long_edge + "]\n", "edge: expected 2 to 16 points");
  refused(edge + "position = [0, 0, 0]\npath = [[0, 0, 0, 0]]\n", "path: ");
  refused(edge + "path = []\n", "path: ");
  EXPECT_THAT(refusal_of(kPoint + kPath + head + edge + "path_csv = \"missing.csv\"\n"), HasSubstr("missing.csv"));
  refused(edge + "turn = [[0, 0, 0, 2e6]]\n", "turn[0]: ");
  refused(edge + "cuts = [[1, 0.5]]\n", "cuts[0]: ");
  refused(edge + "cut = [[0, 1]]\n", "did you mean \"cuts\"");
  refused(edge + "organ = \"liver\"\n", "organ: ");
  refused(edge + "toughness = 300\n", "the key \"direction\"");
  refused(edge + "direction = [0, 0, 1]\n", "direction: expected toughness");
  refused(edge + "toughness = 0\ndirection = [0, 0, 1]\n", "toughness: ");
  refused(edge + "toughness = 300\ndirection = [0, 0, 0]\n", "direction: ");
  const std::string felt = "toughness = 300\ndirection = [0, 0, 1]\n";
  refused(edge + "friction = 500\nwidth = 10\n", "friction: expected toughness");
  refused(edge + felt + "friction = 500\n", "the key \"width\"");
  refused(edge + felt + "width = 10\n", "width: expected friction");
  refused(edge + felt + "friction = -1\nwidth = 10\n", "friction: expected a shear stress");
  refused(edge + felt + "friction = 500\nwidth = 2000\n", "width: expected a length");
  refused(edge + head + edge, "no other [[blade]] has");
  refused(edge, "cut = true in [effects]", "[effects]\ncut = false\n");
  refused(edge, "collision = \"deformed\" beside cut", "[effects]\ncollision = \"rest\"\n");
  std::string five = edge;
  for (int i = 0; i < 4; ++i) five += "[[blade]]\nname = \"" + std::to_string(i) + "\"\n" + edge;
  refused(five, "at most 4 blades of an organ");
  refused(edge, "cut_rank: ", "[limits]\ncut_rank = 8\n");

  const auto removal_refused = [&](const std::string& keys, const std::string& sentence) {
    expect_refused(kPoint + kPath + "[[removal]]\nname = \"hook\"\n" + keys, "", sentence);
  };
  const std::string place = "position = [0, 0, 0]\n", radius = "radius = 3\n";
  removal_refused(place, "the key \"radius\"");
  removal_refused(place + "radius = 0\n", "radius: ");
  removal_refused(radius, "position: ");
  removal_refused(radius + place, "time: expected either time = t or times");
  removal_refused(radius + place + "time = 1\ntimes = [[0, 1]]\n", "times: ");
  removal_refused(radius + place + "time = -1\n", "time: ");
  removal_refused(radius + place + "times = []\n", "times: ");
  removal_refused(radius + place + "times = [[1, 1]]\n", "times[0]: ");
  removal_refused(radius + place + "time = 1\nevery = 0\n", "every: ");
  removal_refused(radius + place + "times = [[0, 1]]\ncontact_time = -1\n", "contact_time: expected a time");
  removal_refused(radius + place + "time = 1\ncontact_time = 0.1\n", "contact_time: expected times");
}

TEST_F(SceneFile, GivesEachOrganItsBlades) {
  const std::string organs = "[[organ]]\nname = \"liver\"\n[[organ]]\nname = \"kidney\"\n";
  const std::string blade = "[[blade]]\nname = \"scalpel\"\nedge = [[0, 0, 0], [0, 0, -20]]\n";
  const SceneConfig scene = read(kPoint + kPath + blade + "organ = \"kidney\"\n", organs);
  EXPECT_EQ(organ_scene(scene, 0).blades.size(), 0u);
  EXPECT_EQ(organ_scene(scene, 1).blades.size(), 1u);
  EXPECT_EQ(scene.organs[0].effects.def.cut.cut, PALPATE_CUT_OFF);
  EXPECT_EQ(scene.organs[1].effects.def.cut.cut, PALPATE_CUT_ON);
  expect_refused(kPoint + kPath + blade, organs, "the key \"organ\"");
}

TEST_F(SceneFile, RefusesAMotionThatCannotBeWithLineAndKey) {
  const auto refused = [&](const std::string& keys, const std::string& sentence, const std::string& head = "") {
    expect_refused(kPoint + kPath + "[[motion]]\nname = \"diaphragm\"\n" + keys, head, sentence);
  };
  const std::string sine = "sine = { amplitude = 5, period = 4 }\n";
  refused("", "exactly one of sine");
  refused(sine + "amounts = [[0, 1]]\n", "exactly one of sine");
  refused("sine = { amplitude = 5 }\n", "the key \"period\"");
  refused("sine = { amplitude = 5, period = 0 }\n", "period: ");
  refused("sine = { amplitude = nan, period = 1 }\n", "amplitude: ");
  refused("amounts = [[1, 0], [1, 2]]\n", "amounts[1]: ");
  refused("amounts = [[-1, 0]]\n", "amounts[0]: ");
  refused("amounts = [[0, inf]]\n", "amounts");
  refused(sine + "colour = 1\n", "unknown key \"colour\"");
  refused(sine, "collision = \"deformed\" or \"off\"", "[effects]\ncollision = \"rest\"\n");
  refused(sine + "[[motion]]\nname = \"diaphragm\"\n" + sine, "found \"diaphragm\"");
  const auto of_csv = [&](const std::string& csv) {
    return refusal_of(kPoint + kPath + "[[motion]]\nname = \"a\"\namounts_csv = \"" + csv + "\"\n");
  };
  EXPECT_THAT(of_csv("none.csv"), HasSubstr("none.csv: "));
  for (const char* rows : {"0,a\n1,2\n", "0\n1,2\n", "nan,nan\n1,2\n", "a,b\nc,d\n", "0,1\n0,2\n", "0,1,2\n3,4,5\n",
                           "0;1\n1;2\n", "-1,0\n"}) {
    write("bad.csv", rows);
    EXPECT_THAT(of_csv("bad.csv"), HasSubstr("bad.csv:")) << rows;
  }
  write("bad.csv", "# none\n");
  EXPECT_THAT(of_csv("bad.csv"), HasSubstr("bad.csv: "));
}

TEST_F(SceneFile, RefusesALinkThatCannotBeWithLineAndKey) {
  const auto refused = [&](const std::string& keys, const std::string& sentence, const std::string& head = "") {
    expect_refused(kPoint + kPath + "[[link]]\nname = \"suture\"\n" + keys, head, sentence);
  };
  const std::string two = "places = [[0, 0, 0], [1, 0, 0]]\n", three = "places = [[0, 0, 0], [1, 0, 0], [2, 0, 0]]\n",
                    thread = "kind = \"thread\"\n";
  refused(two, "[[link]] 1: the key \"kind\"");
  refused("kind = \"glue\"\n" + two, "scene.toml:9: [[link]] 1: kind: ");
  refused(thread, "the key \"places\"");
  refused(thread + "places = [[0, 0, 0]]\n", "places: ");
  refused("kind = \"spring\"\n" + three, "only a thread");
  refused("kind = \"clip\"\n" + two + "world = [0, 0, 0]\n", "only a thread");
  refused("kind = \"clip\"\n" + two + "rest_length = 3\n", "rest_length: ");
  refused(thread + two + "rest_length = -3\n", "found -3");
  refused(thread + two + "rest_length = 3\nrest_lengths = [[0, 3]]\n", "rest_length or rest_lengths");
  refused(thread + two + "rest_lengths = [[1, 3], [0, 3]]\n", "rest_lengths[1]: ");
  refused(thread + two + "stiffness = 0\n", "stiffness: ");
  refused(thread + two + "stiffnesses = [[0, 0]]\n", "stiffnesses[0]: ");
  refused(thread + two + "breaking_force = 0\n", "a force above 0 N");
  refused(thread + two + "radius = 2000\n", "a length of at most 1 m");
  refused(thread + two + "radius = 2\n", "link \"suture\"", "[effects]\ncontact = \"node\"\n");
  refused(thread + two + "from = [0, 0, 0]\n", "unknown key \"from\"");
  std::string many = thread + "places = [";
  for (int i = 0; i < 1001; ++i) many += "[0, 0, 0],";
  refused(many + "]\n", "at most 1000 places");
  refused(many + "]\nworld = [0, 0, 0]\n", "at most 1000 places");
  std::string twice;  // 999 stretches each
  for (const std::string name : {"a", "b"})
    twice += "[[link]]\nname = \"" + name + "\"\n" + many.substr(0, many.size() - 10) + "]\n";
  expect_refused(kPoint + kPath + twice, "", "at most 1000 stretches");
}

TEST_F(SceneFile, TakesTheTermsOfARelaxation) {
  const auto with = [](const std::string& terms) {
    return "[relaxation]\nterms = " + terms + "\nsource = \"a paper\"\n";
  };
  const SceneConfig scene = read(kPoint + kPath, with("[[0.45, 0.5], [0.365, 50]]"));
  ASSERT_EQ(scene.def.relaxation.terms, 2);
  EXPECT_EQ(scene.def.relaxation.share[1], 0.365);
  EXPECT_EQ(scene.def.relaxation.time[1], 50);
  expect_refused(kPoint + kPath, with("[[0.5, 1], [0.5, 2]]"), "all together below 1");
  expect_refused(kPoint + kPath, with("[[0.5, 0]]"), "a time above 0 s");
  expect_refused(kPoint + kPath, "[relaxation]\nterms = [[0.5, 1]]\n", "source");
}

TEST_F(SceneFile, TakesAPathFromCsvWithCommentsAndAHeader) {
  write("p.csv", "# where the probe goes\ntime_s,x,y,z\r\n0, 1, 2, 3\r\n\n0.5,4,5,6\n");
  const auto path = read(kPoint + "path_csv = \"p.csv\"\n").tools.at(0).path;
  ASSERT_EQ(path.size(), 2u);
  EXPECT_DOUBLE_EQ(path[1].time, 0.5);
  EXPECT_DOUBLE_EQ(path[1].position[2], 0.006);
}

TEST_F(SceneFile, NamesTheLineOfABadCsvRow) {
  const auto refused = [&](const std::string& csv, const std::string& sentence) {
    write("p.csv", csv);
    EXPECT_THAT(refusal_of(kPoint + "path_csv = \"p.csv\"\n"), HasSubstr(sentence)) << csv;
  };
  refused("0,1,2,3\n1,2,3\n", "p.csv:2: expected four numbers");
  refused("0,1,2,3\n1,2,3,nan\n", "p.csv:2: expected four numbers");
  refused("0,1,2,3\n1,2,3,4,5\n", "p.csv:2: expected four numbers");
  refused("t,x,y,z\nt,x,y,z\n0,1,2,3\n", "p.csv:2: expected four numbers");
  refused("1,1,2,3\n1,2,3,4\n", "p.csv:2: expected a time");
  refused("-1,1,2,3\n", "p.csv:1: expected a time");
  refused("# nothing\n", "p.csv: expected rows");
  // The first line is no heading where it is a row with a fault.
  for (const char* row : {"0,1,2", "0,1,2,x", "0,1,2,3,4", "time,1,2,3", "0;1;2;3", "nan,nan,nan,nan", "inf,1,2,3",
                          ",,,", "o,1,2,3", "\"0\",\"1\",\"2\",\"3\"", "0,1,2,", "x,y,z,.5", "t,x,-,z"})
    refused(std::string("# a\n\n") + row + "\n1,2,3,4\n", "p.csv:3: expected four numbers");
  refused(std::string("0,1,2,3\0,4\n", 11), "p.csv:1: expected four numbers");
  refused("\xff\xfe" + std::string("0\0,\0", 4), "UTF-16");
}

// As spreadsheets write CSV files, and some editors TOML files.
TEST_F(SceneFile, ReadsFilesThatBeginWithAByteOrderMark) {
  const std::string mark = "\xef\xbb\xbf";
  for (const std::string rows : {"0,1,2,3\n1,2,3,4\n", "time,x,y,z\n0,1,2,3\n1,2,3,4\n", "# a\n0,1,2,3\n1,2,3,4\n"}) {
    write("p.csv", mark + rows);
    const auto scene = write("marked.toml", mark + "name = \"s\"\nunit = \"mm\"\n[[tool]]\nname = \"t\"\n" + kPoint +
                                                "path_csv = \"p.csv\"\n");
    const auto path = read_scene_config(scene).tools.at(0).path;
    ASSERT_EQ(path.size(), 2u) << rows;
    EXPECT_EQ(path[0].time, 0);
    EXPECT_DOUBLE_EQ(path[0].position[2], 0.003);
  }
  write("a.csv", mark + "0,5\n1,6\n");
  const SceneConfig scene = read(kPoint + kPath + "[[motion]]\nname = \"a\"\namounts_csv = \"a.csv\"\n");
  EXPECT_DOUBLE_EQ(amount_at(scene.motions.at(0), 0), 5);
}

TEST_F(SceneFile, RefusesAMissingCsv) {
  for (const char* file : {"none.csv", "."})
    EXPECT_NE(refusal_of(kPoint + "path_csv = \"" + file + "\"\n"), "") << file;
}

TEST_F(SceneFile, RefusesWhatItDoesNotKnowWithLineAndKey) {
  expect_refused(kPoint + kPath + "colour = 1\n", "", "scene.toml:7: [[tool]] 1: unknown key \"colour\"");
  expect_refused(kPoint + kPath, "[effects]\nshape = \"deep\"\n", "scene.toml:4: effects: shape: ");
  expect_refused(kPoint + kPath, "[effects]\nrealtime = true\n", "unknown key \"realtime\"");
  expect_refused(kPoint + kPath, "realtime = true\n", "unknown key \"realtime\"");
}

TEST_F(SceneFile, NamesTheLineOfTheKeyAndDumpsNoTable) {
  // The value, or the place in it, that is wrong may stand below its key.
  expect_refused("points = [\n  [0, 0, 0],\n  [0, \"a\", 0],\n]\n" + kPath, "", "scene.toml:7: [[tool]] 1: points: ");
  expect_refused(kPoint + kPath, "[effects]\nshape =\t\"deep\"\n", "scene.toml:4: effects: shape: ");
  expect_refused(kPoint + kPath, "[effects]\nshape = \"\"\"de\nep\"\"\"\n", "found \"de ep\"");
  expect_refused(kPoint + kPath, "[tools]\nname = \"t\"\nlimits = { force = 3, speed = 4 }\n",
                 "scene.toml:3: unknown key \"tools\"");
  // A heading of a sub-table is the only line on which its parent stands.
  expect_refused(kPoint + kPath, "[limit.force]\nvalue = 3\n", "scene.toml:3: unknown key \"limit\"");
  expect_refused(kPoint + kPath, "[limits]\nforce = { newton = 3, more = \"a\" }\n", "found a table");
  expect_refused(kPoint + kPath, "[limits]\nforce = { value = 3, unit = \"N\" }\n", "found 3 N");
  expect_refused(kPoint + kPath, "[[effects]]\nshape = \"off\"\n", "scene.toml:3: effects: ");
  expect_file_refused("name = \"s\"\nunit = \"mm\"\n[tool]\nname = \"t\"\n" + kPoint + kPath, "scene.toml:3: tool: ");
}

TEST_F(SceneFile, ShowsALineThatWouldDoForAMissingKeyOrAValueOfAnotherType) {
  expect_refused(kPath + "capsule = { length = 1, samples = 3 }\n", "", "radius = 4  #");
  expect_refused(kPath + "capsule = 4\n", "", "capsule = { radius = 4, length = 60, samples = 40 }");
  expect_refused(kPoint + kPath, "[relaxation]\nsource = \"a\"\n", "terms = [[0.45, 0.5]]");
  expect_file_refused("name = \"s\"\n", "unit = \"mm\"");
}

TEST_F(SceneFile, RefusesValuesOutOfRange) {
  expect_refused(kPoint + kPath, "[rate]\ntouch = 0\n", "rate: touch");
  expect_refused(kPoint + kPath, "[rate]\ntouch = 10\nshape = 60\n", "rate: shape");
  expect_refused(kPoint + kPath, "[limits]\npoints = 0\n", "limits: points");
  expect_refused(kPoint + kPath, "[limits]\nforce = -1\n", "limits: force");
  expect_refused(kPoint + kPath, "[limits]\ndisplacement = 0\n", "limits: displacement: ");
  expect_refused(kPoint + "path = [[1, 0, 0, 0], [1, 0, 0, 1]]\n", "", "path[1]");
  expect_refused(kPoint + "path = [[0, 0, 0, inf]]\n", "", "path");
  expect_refused(kPoint + "path = [[0, 0, 0]]\n", "", "path[0]");
  expect_refused(kPoint + "path = []\n", "", "path");
  expect_refused(kPath + "capsule = { radius = 0, length = 1, samples = 3 }\n", "", "radius");
  expect_refused(kPath + "capsule = { radius = 1, length = 1, samples = 1 }\n", "", "samples");
  expect_refused(kPath + "capsule = { radius = 1, length = 1, samples = 3, axis = [0, 0, 0] }\n", "", "axis");
  expect_refused(kPath + "[[tool.grip]]\nnearest = [0, 0, 0]\naxes = \"xx\"\n", "", "axes");
  expect_refused(kPath + "[[tool.grip]]\nbox = { min = [0, 0, 1], max = [1, 1, 0] }\n", "", "max");
  expect_refused(kPath + "[[tool.grip]]\naxes = \"x\"\n", "", "nearest");
}

TEST_F(SceneFile, TakesTimesAtWhichAToolIsAway) {
  const auto tool = read(kPoint + kPath + "away = [[0, 0.25], [0.5, 0.75]]\n").tools.at(0);
  EXPECT_EQ(tool.away, (std::vector<std::array<double, 2>>{{0, 0.25}, {0.5, 0.75}}));
  for (const char* rows : {"[[0.5, 0.25]]", "[[-1, 1]]", "[[0, 1], [0.5, 2]]"})
    expect_refused(kPoint + kPath + "away = " + rows + "\n", "", "two ascending times");
}

TEST_F(SceneFile, PlacesAToolByAWordOrAPointWithDepths) {
  const auto word = read(kPoint + "at = \"foremost\"\ndepth = [[0, -10], [1, 8]]\n").tools.at(0);
  ASSERT_TRUE(word.place);
  EXPECT_EQ(word.place->at, SceneConfig::Place::At::foremost);
  EXPECT_DOUBLE_EQ(word.place->depth.at(1)[1], 0.008);
  EXPECT_DOUBLE_EQ(word.path.at(1).time, 1);
  const auto point = read(kPoint + "near = [1, 2, 3]\ndepth = [[0, -10]]\n").tools.at(0);
  EXPECT_FALSE(point.place->at);
  EXPECT_DOUBLE_EQ(point.place->near->at(2), 0.003);
}

TEST_F(SceneFile, RefusesWhatIsMissingOrGivenTwice) {
  expect_refused(kPath, "", "points");
  expect_refused(kPoint, "", "path");
  expect_refused(kPoint + kPath + "path_csv = \"p.csv\"\n", "", "not both");
  const std::string depth = "depth = [[0, -10], [1, 8]]\n";
  expect_refused(kPoint + depth, "", "at = \"foremost\" or near");
  expect_refused(kPoint + depth + "at = \"lowest\"\nnear = [1, 2, 3]\n", "", "not both");
  expect_refused(kPoint + "at = \"lowest\"\n", "", "depth");
  expect_refused(kPoint + "at = \"anterior\"\n" + depth, "", "one of foremost, hindmost");
  expect_refused(kPoint + "at = \"formost\"\n" + depth, "", "did you mean \"foremost\"?");
  expect_refused(kPoint + kPath + "dics_radius = 3\n", "", "did you mean \"disc_radius\"?");
  expect_refused(kPoint + kPath + depth + "at = \"lowest\"\n", "", "the tool's place");
  expect_refused(kPoint + "at = \"lowest\"\ndepth = [[1, 0], [1, 2]]\n", "", "after the row before");
  std::string nine_tools;
  for (int i = 0; i < 8; ++i) nine_tools += "[[tool]]\nname = \"more\"\n" + kPoint + kPath;
  expect_refused(kPoint + kPath + nine_tools, "", "at most 8 tools");
}

TEST_F(SceneFile, RefusesAFileThatIsNotTomlOrNotThere) {
  EXPECT_THROW(read_scene_config(folder_ / "none.toml"), InputError);
  EXPECT_THROW(read_scene_config(folder_), InputError);
  EXPECT_THROW(read_scene_config(write("bad.toml", "name = \n")), InputError);
}

}  // namespace
}  // namespace palpate
