// palpate-run plays needles: what it writes obeys the laws of friction and of cutting, and bad input is refused in a sentence.
#include <gmock/gmock.h>

#include <cmath>

#include "tests/programs/player/played_scene.h"
#include "tests/support/box_corridor.h"

namespace palpate {
namespace {

using namespace tests;
using testing::HasSubstr;

DenseBody pierced_box() {
  TinyBox form;
  form.cells = {6, 7, 7}, form.poisson = 0.4;
  return dense_box(form);
}

class PlayedNeedle : public PlayedScene {
 protected:
  void SetUp() override {
    PlayedScene::SetUp();
    const DenseBody dense = pierced_box();
    BundleParts parts = dense_bundle(dense);
    add_whole_corridor(parts, dense);
    write_bundle(folder_ / "pierced.h5", parts);
  }
};

const std::string kHead = "bundle = \"pierced.h5\"\n";
constexpr double kFriction = 1, kPuncture = 0.05, kCutting = 0.02, kSpacing = 0.005;  // N/m, N, N, m
const std::string kNeedle =
    "[tool.needle]\nradius = 0.5\nfriction = 1\npuncture_force = 0.05\ncutting_force = 0.02\nspacing = 5\n";
// The box is 60 x 50 x 40 mm, held at x = 0. The needle goes 30 mm deep into its far face in 0.4 s, and out again in 0.5 s.
const std::string kPlaced =
    "[[tool]]\nname = \"needle\"\nnear = [60, 24, 19]\ndepth = [[0, -2], [0.4, 30], [0.9, -10]]\n";

void write_pierced(const std::filesystem::path& folder, const std::string& tools, const std::string& head = "") {
  std::ofstream(folder / "scene.toml") << "name = \"test\"\nunit = \"mm\"\n" << kHead << head << tools;
}

TEST_F(PlayedNeedle, CutsSlidesAndComesOutByTheLawsOfFrictionAndCutting) {
  write_pierced(folder_, kPlaced + kNeedle);
  played("scene.toml -o out");
  const std::vector<Row> rows = rows_of("out/needles.csv"), forces = rows_of("out/forces.csv");
  ASSERT_EQ(rows.size(), 901u);
  ASSERT_EQ(forces.size(), 901u);
  double most_tip = 0;
  int sliding_in = 0, sliding_out = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Row& row = rows[i];
    const double shaft = number(row, "shaft_force_N"), tip = number(row, "tip_force_N"), depth = number(row, "depth_m");
    most_tip = std::max(most_tip, tip);
    // The needle goes towards -x; forces.csv has the force on the tool, which pushes it back towards +x.
    EXPECT_NEAR(number(row, "force_x_N"), shaft + tip, 1e-9) << i;
    EXPECT_NEAR(number(forces[i], "raw_x_N"), number(row, "force_x_N"), 1e-12) << i;
    if (row.at("condition") == "cuts") {
      EXPECT_NEAR(tip, kCutting, 1e-6) << i;
    }
    const int places = static_cast<int>(number(row, "places"));
    if (places < 2 || number(row, "slipping") != places) continue;
    // Friction acts along the places, the last of which lies up to a spacing, and what one step cuts, behind the tip.
    (shaft > 0 ? sliding_in : sliding_out) += 1;
    EXPECT_LE(std::fabs(shaft), kFriction * depth + (shaft > 0 ? 1e-9 : kFriction * kSpacing)) << i;
    EXPECT_GE(std::fabs(shaft), kFriction * (depth - 1.1 * kSpacing)) << i;
  }
  EXPECT_NEAR(most_tip, kPuncture, 1e-6);
  EXPECT_GT(sliding_in, 100);
  EXPECT_GT(sliding_out, 100);
  EXPECT_EQ(rows.front().at("condition"), "outside");
  EXPECT_EQ(rows.back().at("condition"), "outside");
  for (const char* axis : {"x", "y", "z"}) {
    EXPECT_EQ(number(rows.back(), std::string("force_") + axis + "_N"), 0);
    EXPECT_EQ(number(rows.back(), std::string("torque_") + axis + "_Nm"), 0);
  }
  EXPECT_THAT(file_bytes(folder_ / "out/contacts.csv"), HasSubstr("0.4,needle,"));
}

TEST_F(PlayedNeedle, TellsDepthAndEvents) {
  write_pierced(folder_, kPlaced + kNeedle);
  const ProgramRun ended = played("scene.toml -o out");
  EXPECT_THAT(ended.errors, HasSubstr("needle of tool \"needle\": pierced"));
  EXPECT_THAT(ended.errors, HasSubstr("; out at 0.7"));
  const auto needle = summary_of()["tools"][0]["needle"];
  double deepest = 0;
  for (const Row& row : rows_of("out/needles.csv")) deepest = std::max(deepest, number(row, "depth_m"));
  EXPECT_NEAR(needle["deepest_m"].get<double>(), deepest, 1e-12);
  // The tissue in front of the tip gives way: the way in the tissue is shorter than that of the tip.
  EXPECT_GT(deepest, 0.02);
  EXPECT_LT(deepest, 0.03);
  EXPECT_NEAR(needle["deepest_s"].get<double>(), 0.4, 2e-3);
  EXPECT_NEAR(needle["peak_tip_force_N"].get<double>(), kPuncture, 1e-6);
  EXPECT_EQ(needle["stuck_s"], nullptr);
  EXPECT_THAT(file_bytes(folder_ / "out/shapes.pvd"), HasSubstr("shapes/held_000000.vtu"));
}

TEST_F(PlayedNeedle, TakesAPathAndADirectionAsItTakesAPlace) {
  write_pierced(folder_, kPlaced + kNeedle);
  played("scene.toml -o placed");
  write_pierced(folder_,
                "[[tool]]\nname = \"needle\"\npath = [[0, 62, 24, 19], [0.4, 30, 24, 19], [0.9, 70, 24, 19]]\n" +
                    kNeedle + "entry = [60, 24, 19]\ndirection = [-3, 0, 0]\n");
  played("scene.toml -o path");
  const std::vector<Row> placed = rows_of("placed/needles.csv"), path = rows_of("path/needles.csv");
  ASSERT_EQ(placed.size(), path.size());
  for (std::size_t i = 0; i < placed.size(); ++i)
    EXPECT_NEAR(number(placed[i], "force_x_N"), number(path[i], "force_x_N"), 1e-6) << i;
}

TEST_F(PlayedNeedle, EntersAnewAfterTheToolWasAway) {
  write_pierced(folder_,
                "[[tool]]\nname = \"needle\"\nnear = [60, 24, 19]\ndepth = [[0, -2], [0.3, 20], [0.6, -8], [0.7, -2], "
                "[1, 20]]\naway = [[0.6, 0.7]]\n" +
                    kNeedle);
  played("scene.toml -o out");
  const std::vector<Row> rows = rows_of("out/needles.csv");
  EXPECT_EQ(rows.at(599).at("condition"), "outside");
  EXPECT_EQ(rows.at(650).at("condition"), "none");
  EXPECT_EQ(rows.back().at("condition"), "cuts");
  EXPECT_EQ(summary_of()["tools"][0]["needle"]["out_s"], nullptr);
}

TEST_F(PlayedNeedle, SaysWhereItIsStuckAndWhy) {
  // The face x = 0 is held, and no corridor reaches it.
  const std::string deep = "[[tool]]\nname = \"needle\"\nnear = [60, 24, 19]\ndepth = [[0, -2], [0.5, 59]]\n";
  write_pierced(folder_, deep + kNeedle);
  ProgramRun ended = played("scene.toml -o out");
  EXPECT_THAT(ended.errors, HasSubstr("; stuck at 0.4"));
  EXPECT_THAT(ended.errors, HasSubstr("leave the corridor"));
  EXPECT_THAT(ended.errors, HasSubstr("raised NOT_TOUCHABLE"));
  EXPECT_EQ(rows_of("out/needles.csv").back().at("condition"), "stuck");
  write_pierced(folder_, deep + kNeedle, "[limits]\nneedle_places = 3\n");
  ended = played("scene.toml -o out");
  EXPECT_THAT(ended.errors, HasSubstr("for want of needle_places"));
  EXPECT_THAT(ended.errors, HasSubstr("raised CONTACTS_DROPPED"));
  BundleParts parts = dense_bundle(pierced_box());
  add_corridor(parts, pierced_box(), {pierced_box().body.surface_nodes});
  write_bundle(folder_ / "pierced.h5", parts);
  ended = played("scene.toml -o out");
  EXPECT_THAT(ended.errors, HasSubstr("did not pierce"));
  EXPECT_THAT(ended.errors, HasSubstr("no corridor"));
}

TEST_F(PlayedNeedle, RefusesABundleWithoutACorridorAndAPlaceFarAway) {
  write_scene(kPlaced + kNeedle);
  expect_refused("scene.toml -o out", "corridor/nodes");
  write_pierced(folder_, "[[tool]]\nname = \"needle\"\npath = [[0, 0, 0, 0]]\n" + kNeedle + "entry = [9999, 0, 0]\n");
  expect_refused("scene.toml -o out", "scene.toml:7: tool \"needle\": needle.entry: ");
}

TEST_F(PlayedNeedle, RecordsAndReplaysTheSameBits) {
  const std::string placed = "near = [60.3, 24, 19]\ndepth = [[0, -2], [0.1, 12]]\n",
                    path = "path = [[0, 62, 24, 19], [0.1, 50, 24, 19]]\n";
  for (const std::string& place : {placed + kNeedle, path + kNeedle + "entry = [60.3, 24, 19]\n"}) {
    write_pierced(folder_, "[[tool]]\nname = \"needle\"\n" + place + "direction = [-1, 0.2, 0.1]\n",
                  "[limits]\nneedle_places = 8\n");
    expect_replayed({"forces.csv", "needles.csv"});
  }
}

TEST_F(PlayedNeedle, PlaysAgainstTheClockInTwoThreads) {
  write_pierced(folder_, kPlaced + kNeedle);
  const ProgramRun ended = played("scene.toml -o out --realtime --seconds 0.5 --rate 1000");
  EXPECT_THAT(ended.errors + ended.out, testing::Not(HasSubstr("STALE")));
}

TEST_F(PlayedNeedle, ExplainsWhatItCosts) {
  write_pierced(folder_, kPlaced + kNeedle);
  const ProgramRun ended = played("scene.toml --explain");
  const std::size_t at = ended.out.find("touch   needles");
  ASSERT_NE(at, std::string::npos) << ended.out;
  const std::string line = ended.out.substr(at, ended.out.find('\n', at) - at);
  EXPECT_THAT(line, HasSubstr("corridor/compliance"));
  EXPECT_THAT(line, HasSubstr("kB"));
  EXPECT_THAT(line, HasSubstr(" us"));
}

// The pierced box lies turned beside another box; the needle enters it as it does alone.
TEST_F(PlayedNeedle, PiercesOneOfSeveralOrgans) {
  write_pierced(folder_, kPlaced + kNeedle);
  played("scene.toml -o alone");
  std::ofstream(folder_ / "scene.toml")
      << "name = \"test\"\nunit = \"mm\"\n[[organ]]\nname = \"other\"\nbundle = \"box.h5\"\nposition = [300, 0, 0]\n"
      << "[[organ]]\nname = \"pierced\"\nbundle = \"pierced.h5\"\nposition = [10, 20, 30]\nturn = [0, 0, 90]\n"
      << kPlaced << "organ = \"pierced\"\n"
      << kNeedle;
  const ProgramRun ended = played("scene.toml -o out");
  const std::vector<Row> alone = rows_of("alone/needles.csv"), rows = rows_of("out/needles.csv");
  ASSERT_EQ(rows.size(), alone.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    EXPECT_EQ(rows[i].at("organ"), "pierced");
    // Turned by 90 degrees about z, x of the organ is y of the world. The path takes other roundings there.
    EXPECT_NEAR(number(rows[i], "force_y_N"), number(alone[i], "force_x_N"), 1e-6) << i;
    EXPECT_NEAR(number(rows[i], "depth_m"), number(alone[i], "depth_m"), 1e-6) << i;
  }
  EXPECT_THAT(ended.errors, HasSubstr("needle of tool \"needle\": pierced"));
}

}  // namespace
}  // namespace palpate
