// palpate-run plays scenes of several organs: what it writes is what the C API says, and one organ gives the bits of its scene.
#include <gmock/gmock.h>
#include <palpate/palpate_world.h>

#include <regex>

#include "tests/programs/player/played_scene.h"

namespace palpate {
namespace {

using namespace tests;
using nlohmann::json;
using testing::HasSubstr;

class PlayedOrgans : public PlayedScene {
 protected:
  void write_organs(const std::string& organs, const std::string& tools, const std::string& head = "") {
    std::ofstream(folder_ / "scene.toml") << "name = \"test\"\nunit = \"mm\"\n" << head << organs << tools;
  }
};

std::string organ(const std::string& name, const std::string& more = "") {
  return "[[organ]]\nname = \"" + name + "\"\nbundle = \"box.h5\"\n" + more;
}

// Without a column of the file, which the other file does not have.
std::string without_column(const std::string& csv, const std::string& cell) {
  return std::regex_replace(csv, std::regex("(^|\n)([^,\n]*),(organ|" + cell + "),"), "$1$2,");
}

TEST_F(PlayedOrgans, OneOrganGivesTheBitsOfItsScene) {
  const std::string effects = "[effects]\ncollision = \"deformed\"\nlaw = \"unilateral\"\n";
  const std::string grip = "[[tool]]\nname = \"clamp\"\npath = [[0, 60, 25, 20], [0.1, 63, 25, 20]]\n";
  const std::string held = "[[tool.grip]]\nnearest = [60, 25, 20]\n";
  write_scene(kProbe + grip + held, effects);
  played("scene.toml -o alone");
  write_organs(organ("box"), kProbe + grip + held, effects);
  played("scene.toml -o out");
  EXPECT_EQ(file_bytes(folder_ / "out/forces.csv"), file_bytes(folder_ / "alone/forces.csv"));
  EXPECT_EQ(without_column(file_bytes(folder_ / "out/contacts.csv"), "box"),
            file_bytes(folder_ / "alone/contacts.csv"));
  EXPECT_EQ(file_bytes(folder_ / "out/shapes/organ_box_000003.vtu"),
            file_bytes(folder_ / "alone/shapes/organ_000003.vtu"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out/pairs.csv"));
  const json summary = summary_of(), alone = summary_of("alone");
  EXPECT_EQ(summary["tools"], alone["tools"]);
  EXPECT_EQ(summary["warnings"].size(), alone["warnings"].size());
  EXPECT_EQ(summary["organs"][0]["largest_displacement_m"], alone["largest_displacement_m"]);
  EXPECT_EQ(summary["organs"][0]["provenance"], alone["provenance"]);
}

// The second box stands turned on the first one; a finger is placed on its upper face, which a turn about x has made its lower one.
TEST_F(PlayedOrgans, OrgansAreWhereTheirPosesPutThemAndPressOneAnother) {
  const std::string organs = "[world]\npairs = 60\nfriction = 0.2\n" + organ("below") +
                             organ("above", "position = [0, 50, 80.5]\nturn = [180, 0, 0]\n") +
                             organ("aside", "position = [200, 0, 0]\n");
  const std::string finger =
      "[[tool]]\nname = \"finger\"\norgan = \"above\"\npoints = [[0, 0, 0]]\nnear = [45, 25, 0]\n"
      "depth = [[0, -4], [0.1, 4]]\n";
  write_organs(organs, finger);
  const ProgramRun ended = played("scene.toml -o out --export out.glb");

  // It comes from above, since the lower face of the bundle is now the upper one, at z = 80.5 mm.
  const std::vector<Row> forces = rows_of("out/forces.csv");
  // The normal there leans by up to 6 degrees, since the surface counts as smooth: 0.4 of 4 mm.
  EXPECT_NEAR(number(forces.front(), "x_m"), 0.045, 4e-4);
  EXPECT_NEAR(number(forces.front(), "y_m"), 0.025, 4e-4);
  EXPECT_NEAR(number(forces.front(), "z_m"), 0.0845, 4e-4);
  EXPECT_GT(number(forces.back(), "force_z_N"), 0.01);

  const std::vector<Row> states = rows_of("out/organs.csv");
  ASSERT_EQ(states.size(), 3 * 101u);
  const Row &below = states[300], &above = states[301], &aside = states[302];
  EXPECT_EQ(below.at("organ"), "below");
  EXPECT_LT(number(below, "pressed_z_N"), -0.001);
  EXPECT_NEAR(number(below, "pressed_z_N"), -number(above, "pressed_z_N"), 1e-12);
  EXPECT_NEAR(number(above, "force_z_N"), -number(forces.back(), "raw_z_N"), 1e-9);
  EXPECT_EQ(number(aside, "force_z_N"), 0);
  EXPECT_EQ(aside.at("near_tools"), "0");
  double pressed = 0;
  for (const Row& pair : rows_of("out/pairs.csv")) {
    if (number(pair, "time_s") < 0.0995) continue;
    EXPECT_GT(number(pair, "pressure_Pa"), 0);
    pressed += (pair.at("organ") == "above" ? 1 : -1) * number(pair, "force_z_N");
  }
  EXPECT_NEAR(pressed, number(above, "pressed_z_N"), 1e-9);

  const json summary = summary_of();
  EXPECT_EQ(summary["organs"].size(), 3u);
  EXPECT_NEAR(summary["organs"][1]["peak_pressed_N"].get<double>(), number(above, "pressed_z_N"),
              0.2 * number(above, "pressed_z_N"));
  EXPECT_EQ(summary["organs"][2]["largest_displacement_m"], 0);
  EXPECT_THAT(ended.errors, HasSubstr("organ \"below\": other organs press with up to"));
  const std::string pvd = file_bytes(folder_ / "out/shapes.pvd");
  for (const char* part : {"tools_000000", "organ_below_000000", "organ_above_000000", "organ_aside_000000"})
    EXPECT_THAT(pvd, HasSubstr(part));
  EXPECT_THAT(file_bytes(folder_ / "out.glb"), HasSubstr("\"name\":\"aside\""));
}

// The far face of the second box looks at that of the first one, 15 mm away.
TEST_F(PlayedOrgans, LinksJoinOrgans) {
  const std::string organs = organ("one") + organ("other", "position = [135, 50, 0]\nturn = [0, 0, 180]\n");
  const std::string finger =
      "[[tool]]\nname = \"finger\"\norgan = \"one\"\npath = [[0, 60, 25, 60], [0.05, 60, 25, 60]]\npoints = [[0, 0, "
      "0]]\n";
  const std::string links =
      "[[link]]\nname = \"ligament\"\nkind = \"spring\"\norgans = [\"one\", \"other\"]\n"
      "places = [[60, 24, 19], [60, 26, 19]]\nrest_length = 5\nstiffnesses = [[0, 10], [0.05, 40]]\n"
      "[[link]]\nname = \"suture\"\nkind = \"thread\"\norgans = [\"one\", \"other\"]\n"
      "places = [[60, 10, 10], [60, 40, 10]]\nbreaking_force = 0.01\nrest_length = 10\n";
  write_organs(organs, finger + links);
  const ProgramRun ended = played("scene.toml -o out");
  const std::vector<Row> rows = rows_of("out/links.csv");
  ASSERT_EQ(rows.size(), 2 * 51u);
  const Row &first = rows.front(), &last = rows[rows.size() - 2];
  EXPECT_EQ(last.at("organ"), "one+other");
  EXPECT_EQ(last.at("link"), "ligament");
  EXPECT_EQ(last.at("condition"), "taut");
  EXPECT_GT(number(last, "tension_N"), number(first, "tension_N")) << "it becomes stiffer";
  EXPECT_NEAR(number(last, "length_m"), 0.005 + number(last, "tension_N") / 40, 1e-6);
  // In the world the first organ is drawn along x.
  EXPECT_GT(number(last, "force_x_N"), 0.01);
  EXPECT_GT(number(last, "first_x_m"), 0.06);
  EXPECT_LT(number(last, "second_x_m"), 0.075);
  EXPECT_EQ(rows.back().at("condition"), "broken");
  const json summary = summary_of();
  ASSERT_EQ(summary["links"].size(), 2u);
  EXPECT_EQ(summary["links"][0]["organs"], "one+other");
  EXPECT_NEAR(summary["links"][0]["peak_tension_N"].get<double>(), number(last, "tension_N"), 1e-3);
  EXPECT_TRUE(summary["links"][1]["broken_s"].is_number());
  EXPECT_EQ(summary["links"][1]["events"].back()["became"], "broken");
  EXPECT_EQ(summary["links"][1]["events"].back()["time_s"], summary["links"][1]["broken_s"]);
  EXPECT_EQ(summary["links"][0]["events"], json::parse(R"([{"time_s": 0.0, "became": "taut"}])"));
  EXPECT_EQ(summary["touches_with_flag"]["LINK_BROKE"], 1);
  EXPECT_THAT(file_bytes(folder_ / "out/shapes.pvd"), HasSubstr("shapes/links_000000.vtu"));
  EXPECT_THAT(file_bytes(folder_ / "out/shapes/links_000000.vtu"), HasSubstr("Name=\"tension\""));
  EXPECT_THAT(ended.errors, HasSubstr("link \"ligament\" of one+other: largest tension"));
  const ProgramRun explained = played("scene.toml --explain");
  EXPECT_THAT(explained.out, HasSubstr("world: links"));

  const auto refusal = [&](const std::string& link) {
    write_organs(organs, finger + "[[link]]\nname = \"ligament\"\nkind = \"spring\"\n" + link);
    const ProgramRun refused = run("scene.toml -o refused");
    EXPECT_NE(refused.code, 0);
    return refused.errors;
  };
  const std::string places = "places = [[60, 24, 19], [60, 26, 19]]\n";
  EXPECT_THAT(refusal("organs = [\"one\"]\n" + places), HasSubstr("as many names as places: 2"));
  EXPECT_THAT(refusal("organs = [\"one\", \"third\"]\n" + places), HasSubstr("\"one\", \"other\""));
  EXPECT_THAT(refusal("organ = \"one\"\norgans = [\"one\", \"other\"]\n" + places),
              HasSubstr("no organ beside organs"));
  EXPECT_THAT(refusal("organs = [\"one\", \"other\"]\nradius = 3\n" + places), HasSubstr("contact = \"patch\""));
}

// The lines of the plan between the line of an organ, or of the world, and the next such line.
std::string part_of_plan(const std::string& output, const std::string& of) {
  std::istringstream lines(output);
  std::string part;
  bool inside = false;
  for (std::string line; std::getline(lines, line);) {
    if (line.ends_with(':')) inside = line == of + ":";
    if (inside && line.starts_with("touch")) part += line + "\n";
  }
  return part;
}

// The measured time of a pass, us, from its line of the plan; -1: there is none.
double measured_us(const std::string& part, const std::string& pass) {
  std::smatch found;
  const std::regex line("touch +" + pass + " .* us +([0-9.]+) us");
  return std::regex_search(part, found, line) ? std::stod(found[1]) : -1;
}

TEST_F(PlayedOrgans, ExplainsTheSearchOfPairsTheJointSolveAndEachOrgan) {
  const std::string organs = organ("below") + organ("above", "position = [0, 50, 80]\nturn = [180, 0, 0]\n");
  const std::string finger =
      "[[tool]]\nname = \"finger\"\norgan = \"above\"\npoints = [[0, 0, 0]]\nnear = [45, 25, 0]\n"
      "depth = [[0, -1], [0.1, 4]]\n";
  write_organs(organs, finger, "[world]\npairs = 60\n");
  const ProgramRun ended = played("scene.toml -o out --explain");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
  for (const char* name : {"organ \"below\"", "organ \"above\""}) {
    const std::string part = part_of_plan(ended.out, name);
    EXPECT_GE(measured_us(part, "collision: deformed"), 0) << ended.out;
    EXPECT_THAT(part, HasSubstr("tensors/displacement_surface"));
  }
  const std::string world = part_of_plan(ended.out, "the world");
  // Whatever the machine does meanwhile: they are not measured as nothing.
  for (const char* pass : {"world: search of pairs", "world: joint solve"})
    EXPECT_GT(measured_us(world, pass), 0.01) << ended.out;
  // Both have memory of their own, which the table states.
  EXPECT_THAT(world, testing::ContainsRegex("joint solve +- +[0-9.]+ [kM]B"));
  EXPECT_THAT(ended.out, testing::ContainsRegex("with [1-9][0-9]* pairs, [1-9][0-9]* rows of organs that touch"));
  EXPECT_THAT(ended.out, HasSubstr("operations of all organs"));
  EXPECT_THAT(ended.out, HasSubstr("\norgan \"above\": scene: "));

  // Organs that pass through one another have neither.
  write_organs(organs, finger);
  const ProgramRun apart = played("scene.toml -o out --explain");
  EXPECT_THAT(part_of_plan(apart.out, "the world"), testing::Not(HasSubstr("pairs")));
  EXPECT_GE(measured_us(part_of_plan(apart.out, "the world"), "world: input"), 0) << apart.out;
}

TEST_F(PlayedOrgans, BundlesAreGivenByTheNamesOfTheOrgans) {
  std::filesystem::rename(folder_ / "box.h5", folder_ / "a=b.h5");
  write_organs("[[organ]]\nname = \"one\"\n[[organ]]\nname = \"two\"\nposition = [0, 0, 90]\n", kProbe);
  expect_refused("scene.toml -o out", "scene.toml:3: organ \"one\"");
  expect_refused("scene.toml -o out --bundle three=a=b.h5", "(\"one\", \"two\")");
  expect_refused("scene.toml -o out --bundle one=missing.h5 --bundle two=a=b.h5", "missing.h5");
  played("scene.toml -o out --bundle one=a=b.h5 --bundle two=a=b.h5");
}

TEST_F(PlayedOrgans, RefusesWhatOneOrganAloneCanDo) {
  write_organs(organ("one"), kProbe);
  for (const char* option : {"--realtime", "--record run.txt"})
    expect_refused(std::string("scene.toml -o out ") + option, "one organ here");
  write_scene(kProbe);
  expect_refused("scene.toml -o out --bundle box.h5 --bundle box.h5", "one bundle");
}

TEST_F(PlayedOrgans, RefusesOrgansThatDoNotFitTogether) {
  const auto refused = [&](const std::string& organs, const std::string& tools, const std::string& sentence,
                           const std::string& head = "") {
    write_organs(organs, tools, head);
    expect_refused("scene.toml -o out", sentence);
  };
  const std::string placed =
      "[[tool]]\nname = \"finger\"\npoints = [[0, 0, 0]]\nnear = [45, 25, 0]\ndepth = [[0, -4]]\n";
  refused(organ("one") + organ("one"), kProbe, "no other [[organ]]");
  refused(organ("one two"), kProbe, "letters, digits");
  refused(organ("one") + organ("two"), placed, "the key \"organ\"");
  refused(organ("one") + organ("two"), placed + "organ = \"three\"\n", "\"one\", \"two\"");
  refused("", kProbe + "organ = \"one\"\n", "no organ, since", "bundle = \"box.h5\"\n");
  refused("[world]\npairs = 5\n", kProbe, "[[organ]] tables beside it", "bundle = \"box.h5\"\n");
  refused("[world]\nfriction = 0.1\n" + organ("one"), kProbe, "pairs above 0 beside it");
  refused("[world]\npairs = 5\n" + organ("one", "[organ.effects]\ncollision = \"rest\"\n"), kProbe,
          "organ \"one\" collision = \"deformed\"");
  refused(organ("one"), kProbe, "no bundle here", "bundle = \"box.h5\"\n");
  refused(organ("one") + organ("two"), kProbe + "[[motion]]\nname = \"breath\"\namounts = [[0, 0]]\n",
          "the key \"organ\"");
  refused(organ("one"), kProbe + "[[motion]]\nname = \"breath\"\norgan = \"one\"\namounts = [[0, 0]]\n",
          "motions (none)");
}

}  // namespace
}  // namespace palpate
