// palpate-fit on small bundles that dense matrices make: forces of known materials come back as these materials.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>

#include "formats/organ_config.h"
#include "programs/fit/large_press.h"
#include "programs/fit/measurements.h"
#include "programs/fit/presses.h"
#include "tests/programs/fit/made_curves.h"
#include "tests/support/grid_body.h"
#include "tests/support/program_run.h"

namespace palpate::fit {
namespace {

namespace fs = std::filesystem;
using namespace tests;
using formats::SectionId;
using testing::HasSubstr;
using testing::Not;
using Json = nlohmann::json;

// A layer of 60 x 60 x 15 mm on a rigid ground, 7 x 7 x 3 nodes: where a wide disc presses it, nu stiffens it more than under a narrow one.
GridBody layer(double young, double poisson) {
  GridBody grid;
  grid.lines = {grid_lines(0, 0.06, 6), grid_lines(0, 0.06, 6), grid_lines(0, 0.015, 2)};
  grid.held = [](std::array<double, 3> p) { return p[2] == 0; };
  grid.young = young, grid.poisson = poisson;
  return grid;
}

// The layer with a region "lump" in the quarter of small x and y, whose modulus is that many times the other's.
BundleParts layer_with_lump(double young, double ratio) {
  DenseBody dense = dense_grid(layer(young, 0.4));
  auto& mesh = dense.body.mesh;
  TetrahedralMesh parts[2] = {mesh, mesh};
  parts[0].tetrahedra.clear(), parts[1].tetrahedra.clear();
  for (std::size_t e = 0; e < mesh.tetrahedra.size(); ++e) {
    double x = 0, y = 0;
    for (const auto node : mesh.tetrahedra[e]) x += mesh.nodes[node][0] / 4, y += mesh.nodes[node][1] / 4;
    mesh.region[e] = x < 0.03 && y < 0.03;
    parts[mesh.region[e]].tetrahedra.push_back(mesh.tetrahedra[e]);
  }
  dense.stiffness = dense_stiffness(parts[0], young, 0.4) + dense_stiffness(parts[1], ratio * young, 0.4);
  BundleParts bundle = dense_bundle(dense);
  bundle.set(SectionId::young, {2}, std::vector<double>{young, ratio * young});
  bundle.set(SectionId::poisson, {2}, std::vector<double>{0.4, 0.4});
  bundle.set_text(SectionId::region_names, "layer\nlump\n");
  return bundle;
}

class FitProgram : public testing::Test {
 protected:
  void SetUp() override { folder_ = fresh_folder(); }
  void TearDown() override { fs::remove_all(folder_); }

  void write_layer(const std::string& name, double young, double poisson) {
    write_bundle(folder_ / name, dense_bundle(dense_grid(layer(young, poisson))));
  }
  void write_text(const std::string& name, const std::string& text) { std::ofstream(folder_ / name) << text; }

  ProgramRun run(const std::string& arguments) {
    return run_in(folder_, std::string("'") + PALPATE_FIT + "' " + arguments);
  }
  Json fitted(const std::string& arguments) {
    const ProgramRun ended = run(arguments + " --json fit.json");
    EXPECT_EQ(ended.code, 0) << ended.errors;
    errors_ = ended.errors, out_ = ended.out;
    std::ifstream stream(folder_ / "fit.json");
    return Json::parse(stream, nullptr, false);
  }
  void expect_refused(const std::string& arguments, const std::string& part) {
    fs::remove(folder_ / "fit.json");
    const ProgramRun ended = run(arguments + " --json fit.json");
    EXPECT_EQ(ended.code, 2) << ended.errors;
    EXPECT_THAT(ended.errors, HasSubstr(part));
    for (const char* name : {"fit.json", "fit.json.part"}) EXPECT_FALSE(fs::exists(folder_ / name)) << name;
  }

  // plot.py draws fit.json with that many pairs of axes.
  void expect_plot(int panels) {
    const ProgramRun drawn =
        run_in(folder_, std::string("/usr/bin/python3 '") + PALPATE_FIT_PLOT + "' fit.json -o plot.svg");
    EXPECT_EQ(drawn.code, 0) << drawn.errors;
    const std::string svg = file_bytes(folder_ / "plot.svg");
    for (int panel = 1; panel <= 3; ++panel)
      EXPECT_EQ(svg.find("id=\"axes_" + std::to_string(panel) + '"') != std::string::npos, panel <= panels) << panel;
  }

  // The rows of played/forces.csv in which the tool touches, those whose number takes(row) wants, as a CSV of presses: at (31, 32, 15) mm, of a disc of
  // 8 mm.
  template <class Takes>
  std::string curve_of_play(const Takes& takes) {
    std::ifstream rows(folder_ / "played/forces.csv");
    std::ostringstream text;
    text.precision(15);
    text << "x_mm,y_mm,z_mm,radius_mm,depth_m,force_N\n";
    std::string line;
    std::getline(rows, line);
    for (int row = 0; std::getline(rows, line); ++row) {
      std::vector<double> cells;
      std::stringstream stream(line);
      for (std::string cell; std::getline(stream, cell, ',');) cells.push_back(std::atof(cell.c_str()));
      if (cells.at(11) > 0 && takes(row)) text << "31,32,15,8," << 0.015 - cells.at(4) << ',' << cells.at(10) << '\n';
    }
    return text.str();
  }

  // A CSV of presses on a bundle at nine places by discs of 4 and 12 mm in turn, three depths each; forces times the factor.
  void write_presses(const std::string& name, const std::string& bundle, double factor) {
    std::vector<Spot> spots;
    for (int i = 0; i < 9; ++i)
      spots.push_back({{0.02 + 0.01 * (i % 3), 0.02 + 0.01 * (i / 3), 0.0152}, i % 2 ? 0.004 : 0.012, i, 0});
    PressedBundle pressed(folder_ / bundle);
    const std::vector<double> stiffness = pressed.stiffness(spots, Press::sticking, "test");
    std::ostringstream text;
    text << "# presses\nx_mm,y_mm,z_mm,radius_mm,depth_mm,force_mN,source\n";
    text.precision(15);
    for (std::size_t s = 0; s < spots.size(); ++s)
      for (const double mm : {0.5, 1.0, 2.0})
        text << 1e3 * spots[s].at[0] << ',' << 1e3 * spots[s].at[1] << ',' << 1e3 * spots[s].at[2] << ','
             << 1e3 * spots[s].radius << ',' << mm << ',' << 1e3 * factor * stiffness[s] * 1e-3 * mm
             << ",\"a bench, \"\"A\"\"\"\n";
    write_text(name, text.str());
  }

  fs::path folder_;
  std::string errors_, out_;
};

// A block of 120 x 120 x 60 mm: nearly a half-space for a ball of 10 mm.
TEST_F(FitProgram, FindsTheModulusFromHertzsForcesOfABall) {
  const double young = 5400, poisson = 0.45, radius = 0.01;
  GridBody block;
  block.lines = {grid_lines(0, 0.12, 8), grid_lines(0, 0.12, 8), grid_lines(0, 0.06, 4)};
  block.held = [](std::array<double, 3> p) { return p[2] == 0; };
  block.young = young, block.poisson = poisson;
  write_bundle(folder_ / "block.h5", dense_bundle(dense_grid(block)));
  std::ostringstream text;
  text << "x_mm,y_mm,z_mm,ball_radius_mm,depth_mm,force_N\n";
  for (const auto& [x, y] : {std::pair{60, 60}, {50, 60}, {60, 50}, {70, 60}, {60, 70}, {70, 70}})
    for (const double depth : {0.1e-3, 0.2e-3})
      text << x << ',' << y << ",60,10," << 1e3 * depth << ','
           << 4.0 / 3 * young / (1 - poisson * poisson) * std::sqrt(radius * depth) * depth << '\n';
  write_text("ball.csv", text.str());
  const Json fit = fitted("block.h5 ball.csv --law sliding");
  // The contact is at most 1.4 mm wide. What the coarse block has more than the half-space's compliance under a disc of 10 mm, half of
  // it at most, counts at two thirds of 1.4 / 10 of the depth; Sneddon's ball differs from Hertz's by d / R = 2 %.
  EXPECT_NEAR(fit["regions"][0]["young_Pa"]["value"].get<double>() / young, 1, 0.07);
  expect_refused("block.h5 ball.csv", "without friction");
  expect_refused("block.h5 ball.csv --law sliding --initial-slope", "--initial-slope");
  write_text("both.csv", "x_mm,y_mm,z_mm,radius_mm,ball_radius_mm,depth_mm,force_N\n60,60,60,5,5,1,1\n");
  expect_refused("block.h5 both.csv --law sliding", "found both a radius");
}

// Another program, another way to touch (a path of many steps from above), the same force.
TEST_F(FitProgram, FindsTheModulusOfTheBundleFromForcesThatPalpateRunPlays) {
  write_layer("layer.h5", 5400, 0.45);
  write_text("scene.toml",
             "name = \"press\"\nunit = \"mm\"\n[[tool]]\nname = \"finger\"\npoints = [[0, 0, 0]]\ndisc_radius = 8\n"
             "path = [[0, 31, 32, 16], [0.3, 31, 32, 13]]\n");
  ASSERT_EQ(run_in(folder_, std::string("'") + PALPATE_RUN + "' scene.toml --bundle layer.h5 -o played").code, 0);
  write_text("forces.csv", curve_of_play([](int) { return true; }));
  const Json fit = fitted("layer.h5 forces.csv");
  // Both programs have the same columns in f32; a normal between vertices is rounded to 1e-7 in f32 by one of them.
  EXPECT_NEAR(fit["regions"][0]["young_Pa"]["value"].get<double>(), 5400, 1e-6 * 5400);
  EXPECT_LT(fit["residual_N"].get<double>(), 1e-6 * fit["largest_force_N"].get<double>());
  EXPECT_THAT(errors_, HasSubstr("since 1 place"));
}

TEST_F(FitProgram, WritesLinesOfOrganTomlThatTheOrganFilesReaderTakes) {
  write_layer("layer.h5", 5400, 0.45);
  write_presses("forces.csv", "layer.h5", 2.5);
  const Json fit = fitted("layer.h5 forces.csv --organ lines.toml");
  EXPECT_THAT(out_, HasSubstr("box: 13.5 kPa"));
  EXPECT_EQ(fit["drawn"], "places");
  EXPECT_EQ(errors_, "");
  write_text("organ.toml", "name = \"layer\"\nmesh_unit = \"mm\"\nframe = \"none\"\nelement = \"p1\"\n\n" +
                               file_bytes(folder_ / "lines.toml"));
  const OrganConfig organ = read_organ_config(folder_ / "organ.toml");
  ASSERT_EQ(organ.regions.size(), 1u);
  EXPECT_EQ(organ.regions[0].name, "box");
  EXPECT_NEAR(organ.regions[0].young.value, 13500, 5);  // four digits
  EXPECT_EQ(organ.regions[0].poisson.value, 0.45);
  EXPECT_THAT(organ.regions[0].young.source,
              HasSubstr("forces.csv (sha256 " + fit["measurements_sha256"].get<std::string>()));
  EXPECT_THAT(organ.regions[0].young.source, HasSubstr("95 % interval 13.5 to 13.5 kPa; a bench, \"A\""));
  expect_plot(2);
  // A file of that name may be the user's own organ.toml.
  expect_refused("layer.h5 forces.csv --organ organ.toml", "new file");
  EXPECT_EQ(read_organ_config(folder_ / "organ.toml"), organ);
}

TEST_F(FitProgram, FindsPoissonsRatioBetweenBundles) {
  for (const auto& [name, nu] : {std::pair{"a.h5", 0.3}, {"b.h5", 0.4}, {"c.h5", 0.45}, {"truth.h5", 0.42}})
    write_layer(name, 4000, nu);
  write_presses("forces.csv", "truth.h5", 1.5);
  const Json fit = fitted("c.h5 a.h5 b.h5 forces.csv");
  EXPECT_EQ(fit["parameter"]["name"], "poisson");
  // Parabolas in the compliance of these three bundles miss that of the fourth one by less than 2e-3.
  EXPECT_NEAR(fit["parameter"]["fitted"]["value"].get<double>(), 0.42, 0.003);
  EXPECT_NEAR(fit["regions"][0]["young_Pa"]["value"].get<double>(), 6000, 0.01 * 6000);
  EXPECT_THAT(out_, HasSubstr("0.3, 0.4, 0.45"));
  EXPECT_THAT(out_, HasSubstr("poisson = { value = 0.42"));
  expect_plot(3);
}

TEST_F(FitProgram, FindsTheRatioOfTwoRegionsModuli) {
  for (const auto& [name, ratio] : {std::pair{"a.h5", 1.0}, {"b.h5", 3.0}, {"c.h5", 9.0}, {"truth.h5", 4.0}})
    write_bundle(folder_ / name, layer_with_lump(2000, ratio));
  write_presses("forces.csv", "truth.h5", 1.25);
  const Json fit = fitted("a.h5 b.h5 c.h5 forces.csv");
  EXPECT_EQ(fit["parameter"]["meaning"], "modulus of lump over that of layer");
  // A factor of 9 in three bundles, by parabolas in the logarithm of the ratio: the compliance between them is met to 1 %.
  EXPECT_NEAR(fit["parameter"]["fitted"]["value"].get<double>(), 4, 0.05 * 4);
  EXPECT_NEAR(fit["regions"][0]["young_Pa"]["value"].get<double>(), 2500, 0.01 * 2500);
  EXPECT_NEAR(fit["regions"][1]["young_Pa"]["value"].get<double>(), 10000, 0.05 * 10000);
  // Beyond the last bundle it tells that it does not know.
  const Json edge = fitted("a.h5 b.h5 forces.csv");
  EXPECT_EQ(edge["parameter"]["at_edge"], true);
  EXPECT_THAT(errors_, HasSubstr("last bundle"));
}

// A prism of the cylinder's section and height: its force under a plate depends on its section's area alone, E A x / h.
BundleParts prism(double poisson = 0.45, int cells = 3) {
  const double side = std::sqrt(std::numbers::pi) * 0.015;
  GridBody grid;
  grid.lines = {grid_lines(0, side, cells), grid_lines(0, side, cells), grid_lines(0, 0.013, cells)};
  grid.young = 1000, grid.poisson = poisson;
  DenseBody dense = dense_grid(grid);
  std::fill(dense.fixed.begin(), dense.fixed.end(), 0);
  const auto& nodes = dense.body.mesh.nodes;
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    dense.fixed[3 * n + 2] = nodes[n][2] == 0;
    if (nodes[n] == std::array<double, 3>{0, 0, 0}) dense.fixed[3 * n] = dense.fixed[3 * n + 1] = 1;
    if (nodes[n] == std::array<double, 3>{grid.lines[0].back(), 0, 0}) dense.fixed[3 * n + 1] = 1;
  }
  // [touchable]: the top alone, as in pipelines/brain-cylinder.
  BundleParts all = dense_bundle(dense);
  const auto touchable = all.get<std::int32_t>(SectionId::touchable);
  const auto force = all.get<double>(SectionId::force);
  const auto surface = all.get<float>(SectionId::displacement_surface);
  const std::size_t row = surface.size() / touchable.size();
  std::vector<std::int32_t> top;
  std::vector<double> top_force;
  std::vector<float> top_surface;
  for (std::size_t k = 0; k < touchable.size(); ++k) {
    if (nodes[touchable[k]][2] < grid.lines[2].back()) continue;
    top.push_back(touchable[k]);
    top_force.insert(top_force.end(), force.begin() + 9 * k, force.begin() + 9 * (k + 1));
    top_surface.insert(top_surface.end(), surface.begin() + row * k, surface.begin() + row * (k + 1));
  }
  const std::size_t s = top.size();
  all.set(SectionId::touchable, {s}, top);
  all.set(SectionId::force, {s, 3, 3}, top_force);
  all.set(SectionId::displacement_surface, {s, 3, row / 9, 3}, top_surface);
  all.set(SectionId::residual, {s, 3}, std::vector<double>(3 * s, 1e-15));
  all.set(SectionId::iterations, {s, 3}, std::vector<std::int32_t>(3 * s, 1));
  return all;
}

TEST_F(FitProgram, FindsTheSmallStrainModulusOfThePublishedCurveOfBrain) {
  write_bundle(folder_ / "prism.h5", prism());
  const std::string curve = std::string("'") + PALPATE_CURVES + "/swine-brain-at-once.csv'";
  const Json fit =
      fitted("prism.h5 " + curve + " --plate --initial-slope --most-depth 0.26 --source 'Miller and Chinzei 1997'");
  // 6 (C100 + C010) = 6 (263 + 263) Pa. To 2 % strain the curve's cubic term takes the parabola's slope 0.25 % below.
  EXPECT_NEAR(fit["regions"][0]["young_Pa"]["value"].get<double>(), 3156, 0.005 * 3156);
  EXPECT_EQ(fit["press"], "plate");
  EXPECT_THAT(errors_, Not(HasSubstr("deeper")));
  EXPECT_THAT(errors_, HasSubstr("radial_mm"));
  EXPECT_THAT(out_, HasSubstr("Miller and Chinzei 1997"));
  // The whole curve is far from linear: 9.2 kPa by a straight line (least squares of the file's rows), and the program says so.
  const Json whole = fitted("prism.h5 " + curve + " --plate");
  EXPECT_NEAR(whole["regions"][0]["young_Pa"]["value"].get<double>(), 9196.8, 0.1);
  EXPECT_THAT(errors_, HasSubstr("65 of 78 rows"));
  expect_refused("prism.h5 " + curve + " --plate --initial-slope", "forces that grow");
}

constexpr double kIncompressible = 0.4999, kPrismHeight = 0.013, kPrismArea = std::numbers::pi * 0.015 * 0.015;

// Curves of a cylinder between sliding plates: each specimen has its factor.
std::string plate_curves(const LawForm& law, double young, double most_strain, const std::vector<double>& factors) {
  std::ostringstream text;
  text.precision(12);
  text << "specimen,depth_mm,force_N\n";
  for (std::size_t s = 0; s < factors.size(); ++s)
    for (int i = 1; i <= 10; ++i) {
      const double strain = most_strain * i / 10;
      text << 'S' << s + 1 << ',' << 1e3 * strain * kPrismHeight << ','
           << factors[s] * young / (2 * (1 + kIncompressible)) * kPrismArea * plate_stress(law, strain) << '\n';
    }
  return text.str();
}

// Tissue of 6.2 kPa that stiffens: a straight line through its whole curve gives twice the modulus, the slope of a parabola a sixth of it.
TEST_F(FitProgram, FindsModulusAndStiffeningOfACurveOnWhichLinearFitsAreFarOff) {
  write_bundle(folder_ / "prism.h5", prism(kIncompressible, 1));
  write_text("curves.csv", plate_curves(LawForm(5), 6200, 0.2, {0.96, 0.98, 1.0, 1.02, 1.04, 0.99, 1.01}));
  const auto young = [](const Json& fit) { return fit["regions"][0]["young_Pa"]["value"].get<double>(); };
  EXPECT_GT(young(fitted("prism.h5 curves.csv --plate")), 11800);
  EXPECT_LT(young(fitted("prism.h5 curves.csv --plate --initial-slope")), 1300);
  const Json fit = fitted("prism.h5 curves.csv --plate --large stiffening --organ lines.toml");
  // Of 0.4999 for an incompressible body: 3e-4 of the force. The specimens' geometric mean is 0.9998.
  EXPECT_NEAR(young(fit), 6200, 0.002 * 6200);
  EXPECT_NEAR(fit["constants"][0]["fitted"]["value"].get<double>(), 5, 0.01 * 5);
  EXPECT_LT(fit["regions"][0]["young_Pa"]["low"].get<double>(), 6200);
  EXPECT_GT(fit["regions"][0]["young_Pa"]["high"].get<double>(), 6200);
  EXPECT_EQ(fit["interval"], "bootstrap");
  EXPECT_THAT(out_, HasSubstr("bootstrap over 7 specimens"));
  EXPECT_EQ(errors_, "");
  write_text("organ.toml", "name = \"prism\"\nmesh_unit = \"mm\"\nframe = \"none\"\nelement = \"p1\"\n\n" +
                               file_bytes(folder_ / "lines.toml"));
  const OrganConfig organ = read_organ_config(folder_ / "organ.toml");
  EXPECT_NEAR(organ.regions[0].stiffening->value, 5, 0.01 * 5);
  expect_plot(2);
  // Where the plate sticks, the same curve is that of softer tissue.
  write_bundle(folder_ / "wide.h5", prism(0.45, 1));
  EXPECT_LT(young(fitted("wide.h5 curves.csv --plate --law sticking --large stiffening")), 0.95 * 6200);
}

TEST_F(FitProgram, PredictsSpecimensThatAreHeldOutUnderLargeStrain) {
  write_bundle(folder_ / "prism.h5", prism(kIncompressible, 1));
  write_text("curves.csv", plate_curves(LawForm::yeoh(0.2, 0.3), 9000, 0.5, {0.98, 1.0, 1.02, 1.1, 1.06}));
  const Json fit = fitted("prism.h5 curves.csv --plate --large yeoh --holdout S4,S5");
  // Of the three others, mean 1.
  EXPECT_NEAR(fit["regions"][0]["young_Pa"]["value"].get<double>(), 9000, 0.002 * 9000);
  ASSERT_EQ(fit["held_out"].size(), 2u);
  EXPECT_NEAR(fit["held_out"][0]["median"].get<double>(), 1 - 1 / 1.1, 0.002);
  EXPECT_NEAR(fit["held_out"][1]["worst"].get<double>(), 1 / 1.06 - 1, 0.003);
  EXPECT_THAT(out_, HasSubstr("S4: 7 rows, force off by 9.1 %"));
  EXPECT_EQ(fit["interval"], "jackknife");
  EXPECT_THAT(out_, HasSubstr("yeoh = { c2 = "));
  // A law that cannot follow these curves says so by its residual and by the law's own error in the interval.
  const Json stiff = fitted("prism.h5 curves.csv --plate --large neo-hookean");
  EXPECT_GT(stiff["law_error"].get<double>(), 0.05);
  EXPECT_GT(stiff["shear_Pa"]["high"].get<double>() / stiff["shear_Pa"]["low"].get<double>(), 1.1);
  // The stiffening of a curve of small strains is not told.
  write_text("noisy.csv", "depth_mm,force_N\n0.1,0.0345\n0.2,0.072\n0.3,0.103\n0.4,0.145\n0.5,0.178\n0.6,0.221\n");
  fitted("prism.h5 noisy.csv --plate --large stiffening");
  EXPECT_THAT(errors_, HasSubstr("cannot tell b"));
  EXPECT_THAT(errors_, HasSubstr("that of one place"));
}

// A ball of a kilometre is a plate. It presses in the middle, where the interpolated normal is that of the face.
TEST_F(FitProgram, ABallPressesAsAPlateWhereItIsFlat) {
  write_bundle(folder_ / "prism.h5", prism(kIncompressible, 1));
  std::ostringstream text;
  text << "x_mm,y_mm,z_mm,ball_radius_mm,depth_mm,force_N\n";
  std::istringstream rows(plate_curves(LawForm(2), 6200, 0.3, {1}));
  std::string line;
  for (std::getline(rows, line); std::getline(rows, line);)
    text << "13.2934038818,13.2934038818,13,1e6," << line.substr(3) << '\n';
  write_text("ball.csv", text.str());
  const Json fit = fitted("prism.h5 ball.csv --law sliding --large stiffening");
  EXPECT_NEAR(fit["regions"][0]["young_Pa"]["value"].get<double>(), 6200, 0.003 * 6200);
  EXPECT_NEAR(fit["constants"][0]["fitted"]["value"].get<double>(), 2, 0.02 * 2);
  expect_refused("prism.h5 ball.csv --large stiffening", "without friction");
}

// The layer, with a law; a ball of 25 mm presses its middle and two other places to 6 mm.
TEST_F(FitProgram, FindsTheConstantsOfALawFromForcesOfABall) {
  write_layer("layer.h5", 5400, 0.45);
  std::ostringstream rows;
  rows << "x_mm,y_mm,z_mm,ball_radius_mm,depth_mm,force_N\n";
  for (const char* at : {"31,32", "22,30", "38,41"})
    for (const double depth : {2.0, 3.0, 4.0, 5.0, 6.0}) rows << at << ",15,25," << depth << ",1\n";
  write_text("ball.csv", rows.str());
  ReadOptions curves;
  curves.curves = true;
  const Measurements presses = read_measurements(folder_ / "ball.csv", curves);
  PressedBundle bundle(folder_ / "layer.h5");
  const LargePress press(bundle, presses, Press::sliding);
  const double shear = 7200 / (2 * (1 + 0.45));
  const Eigen::VectorXd of_neo = shear * press.forces({LawForm()}).front();
  const Eigen::VectorXd of_law = shear * press.forces({LawForm(4)}).front();
  std::istringstream lines(rows.str());
  std::string line, text;
  std::getline(lines, text), text += '\n';
  for (Eigen::Index row = 0; std::getline(lines, line); ++row) {
    EXPECT_GT(of_law[row], of_neo[row]);
    text += line.substr(0, line.rfind(',') + 1) + fmt::format("{:.12g}\n", of_law[row]);
  }
  write_text("ball.csv", text);
  const Json fit = fitted("layer.h5 ball.csv --law sliding --large stiffening");
  EXPECT_NEAR(fit["regions"][0]["young_Pa"]["value"].get<double>(), 7200, 0.002 * 7200);
  EXPECT_NEAR(fit["constants"][0]["fitted"]["value"].get<double>(), 4, 0.01 * 4);
  EXPECT_THAT(errors_, HasSubstr("the ball touches"));
}

// The runtime plays the disc under large deformation; the fit solves the same body by Newton's method.
TEST_F(FitProgram, FindsTheLawOfABundleFromForcesThatPalpateRunPlaysUnderLargeDeformation) {
  BundleParts parts = dense_bundle(dense_grid(layer(5400, 0.45)));
  add_large_deformation(parts, {3});
  write_bundle(folder_ / "layer.h5", parts);
  write_text("scene.toml",
             "name = \"press\"\nunit = \"mm\"\n[effects]\ncontact = \"patch\"\ndeformation = \"large\"\n[[tool]]\nname "
             "= \"finger\"\n"
             "points = [[0, 0, 0]]\ndisc_radius = 8\npath = [[0, 31, 32, 16], [0.3, 31, 32, 10], [0.4, 31, 32, 10]]\n");
  const ProgramRun played =
      run_in(folder_, std::string("'") + PALPATE_RUN + "' scene.toml --bundle layer.h5 -o played");
  ASSERT_EQ(played.code, 0) << played.errors;
  write_text("forces.csv", curve_of_play([](int row) { return row % 20 == 0 && row <= 300; }));
  const Json fit = fitted("layer.h5 forces.csv --large stiffening");
  // The runtime goes on with a state that is solved to a percent of its energy's root.
  EXPECT_NEAR(fit["regions"][0]["young_Pa"]["value"].get<double>(), 5400, 0.02 * 5400);
  EXPECT_NEAR(fit["constants"][0]["fitted"]["value"].get<double>(), 3, 0.1 * 3);
}

TEST_F(FitProgram, RefusesWhatCannotBeFittedUnderLargeStrain) {
  write_bundle(folder_ / "prism.h5", prism(kIncompressible, 1));
  write_text("curves.csv", plate_curves(LawForm(2), 6200, 0.3, {1, 1.02}));
  const std::string plate = "prism.h5 curves.csv --plate ", large = plate + "--large stiffening ";
  expect_refused(plate + "--large rubber", "rubber");
  expect_refused(plate + "--hold b=1", "--hold");
  expect_refused(plate + "--holdout S1", "--holdout");
  expect_refused(large + "--hold b", "NAME=VALUE");
  expect_refused(large + "--hold exponent=3", "exponent");
  expect_refused(large + "--holdout S3", "S3");
  expect_refused(large + "--holdout S1,S2", "left to fit");
  expect_refused(large + "--initial-slope", "--initial-slope");
  expect_refused("prism.h5 prism.h5 curves.csv --plate --large stiffening", "one bundle");
  expect_refused(large + "--most-depth 0.8", "3 depths");
  write_text("deep.csv", "depth_mm,force_N\n1,0.1\n2,0.2\n13.5,1\n");
  expect_refused("prism.h5 deep.csv --plate --large neo-hookean", "13.5 mm");
  write_text("pulled.csv", "depth_mm,force_N\n1,-0.1\n2,-0.2\n");
  expect_refused("prism.h5 pulled.csv --plate --large neo-hookean", "pulled.csv");
  BundleParts parts = prism();
  parts.provenance.replace(parts.provenance.find("\"p1\""), 4, "\"p2-p0\"");
  write_bundle(folder_ / "quadratic.h5", parts);
  expect_refused("quadratic.h5 curves.csv --plate --large stiffening", "p2-p0");
  parts = prism();
  parts.provenance.pop_back();
  parts.provenance += ",\"foundation diaphragm\":\"normal 50 N/m^3\"}";
  write_bundle(folder_ / "soft.h5", parts);
  expect_refused("soft.h5 curves.csv --plate --large stiffening", "--large-deformation");
}

TEST_F(FitProgram, WarnsOfDeepRowsAndOfAPlaceThatDoesNotFit) {
  write_layer("layer.h5", 5400, 0.45);
  write_presses("forces.csv", "layer.h5", 1);
  std::ofstream(folder_ / "forces.csv", std::ios::app) << "25,25,15,4,3.7,1,bench\n";
  fitted("layer.h5 forces.csv");
  EXPECT_THAT(errors_, HasSubstr("1 of 28 rows"));
  EXPECT_THAT(errors_, HasSubstr("place (25, 25, 15) mm"));
  fitted("layer.h5 forces.csv --initial-slope");
  EXPECT_THAT(errors_, Not(HasSubstr("deeper")));
  // The bundle's own figure counts before the rule of thumb.
  BundleParts parts = dense_bundle(dense_grid(layer(5400, 0.45)));
  parts.provenance.pop_back();
  parts.provenance += ",\"accuracy_linear_limit_mm\":1.5}";
  write_bundle(folder_ / "stated.h5", parts);
  fitted("stated.h5 forces.csv");
  EXPECT_THAT(errors_, HasSubstr("10 of 28 rows"));
  fitted("layer.h5 forces.csv --most-depth 2");
  EXPECT_EQ(errors_, "");
  EXPECT_THAT(out_, HasSubstr("  1 rows"));
}

TEST_F(FitProgram, WarnsThatSoftSupportsDoNotScaleWithTheModulus) {
  write_layer("layer.h5", 5400, 0.45);
  BundleParts parts = dense_bundle(dense_grid(layer(5400, 0.45)));
  parts.provenance.pop_back();
  parts.provenance += ",\"foundation diaphragm\":\"normal 50 N/m^3\"}";
  write_bundle(folder_ / "soft.h5", parts);
  write_presses("forces.csv", "soft.h5", 2);
  fitted("soft.h5 forces.csv");
  EXPECT_THAT(errors_, HasSubstr("soft.h5: it has foundations"));
  write_presses("forces.csv", "soft.h5", 1.01);
  fitted("soft.h5 forces.csv");
  EXPECT_EQ(errors_, "");
  expect_refused("layer.h5 soft.h5 forces.csv", "found others (the supports)");
}

TEST_F(FitProgram, RefusesWhatCannotBeFitted) {
  write_layer("layer.h5", 5400, 0.45);
  write_presses("forces.csv", "layer.h5", 1);
  const std::string header = "x_mm,y_mm,z_mm,radius_mm,depth_mm,force_N\n";
  write_text("far.csv", header + "30,30,15,5,1,0.1\n130,30,15,5,1,0.1\n");
  expect_refused("layer.h5 far.csv", "far.csv:3: ");
  for (const char* place :
       {"30,30,0", "0.03,0.03,0.015"}) {  // the ground; metres under a title in mm, near a held corner
    write_text("held.csv", header + place + ",5,1,0.1\n");
    expect_refused("layer.h5 held.csv", "held.csv:2: ");
  }
  expect_refused("layer.h5 layer.h5 forces.csv", "differ in one thing");
  write_bundle(folder_ / "box.h5", tiny_bundle());
  expect_refused("layer.h5 box.h5 forces.csv", "(the mesh)");
  expect_refused("forces.csv layer.h5", "layer.h5:1: ");
  expect_refused("layer.h5 forces.csv --plate", "forces.csv:2: ");
  expect_refused("layer.h5 forces.csv --organ missing/lines.toml", "missing");
  write_text("plate.csv", "depth_mm,force_N\n1,0.1\n");
  expect_refused("layer.h5 plate.csv --plate", "--plate: ");
  EXPECT_EQ(run("layer.h5 forces.csv -o plot.png").code, 2);
}

}  // namespace
}  // namespace palpate::fit
