#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>

#include "formats/errors.h"
#include "formats/tetrahedral_mesh.h"
#include "meshing/tetrahedra/mesh_quality.h"
#include "meshing/tetrahedra/tetrahedra_from_surfaces.h"
#include "studies/bodies/box_mesh.h"
#include "tests/meshing/run_tetrahedra.h"
#include "tests/support/closed_surfaces.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using tests::box_surface;
using tests::fresh_folder;
using tests::run_tetrahedra;
using tests::sphere_surface;

TEST(MeasureQuality, KnowsTheRegularTetrahedron) {
  TetrahedralMesh mesh;
  mesh.nodes = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
  mesh.tetrahedra = {{0, 2, 1, 3}};
  mesh.region = {0};
  mesh.region_names = {"one"};
  if (measure_quality(mesh).volume.value < 0) std::swap(mesh.tetrahedra[0][0], mesh.tetrahedra[0][1]);
  const MeshQuality quality = measure_quality(mesh);
  // the rounding of a dozen operations on numbers of order one
  EXPECT_NEAR(quality.volume.value, 8.0 / 3, 1e-14);
  EXPECT_NEAR(quality.radius_ratio.value, 1, 1e-14);
  EXPECT_NEAR(quality.dihedral.value, std::acos(1.0 / 3) * 180 / std::numbers::pi, 1e-12);
  EXPECT_NEAR(quality.largest_dihedral.value, quality.dihedral.value, 1e-12);
}

TEST(MeasureQuality, KnowsTheCornerOfACube) {
  TetrahedralMesh mesh;
  mesh.nodes = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.tetrahedra = {{0, 1, 2, 3}};
  mesh.region = {0};
  mesh.region_names = {"one"};
  const MeshQuality quality = measure_quality(mesh);
  EXPECT_NEAR(quality.largest_dihedral.value, 90, 1e-12);
  EXPECT_NEAR(quality.dihedral.value, std::acos(1 / std::sqrt(3.0)) * 180 / std::numbers::pi, 1e-12);
  // r_in = 1 / (3 + sqrt 3), r_circ = sqrt 3 / 2
  EXPECT_NEAR(quality.radius_ratio.value, 3 / (3 + std::sqrt(3.0)) / (std::sqrt(3.0) / 2), 1e-14);
}

TEST(PassGate, NamesTheWorstElement) {
  TetrahedralMesh mesh = box_mesh({2, 2, 2}, {2, 2, 2});
  const auto sentence = [&](const QualityGate& gate) -> std::string {
    try {
      pass_gate(mesh, measure_quality(mesh), gate);
    } catch (const VerificationError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(sentence({30, 0.1}), "");
  // Moves the middle node almost into a face of its neighbours' cells.
  mesh.nodes[13] = {1.98, 1, 1};
  const std::size_t worst = measure_quality(mesh).dihedral.tetrahedron;
  EXPECT_THAT(sentence({30, 0}), AllOf(HasSubstr("tetrahedron " + std::to_string(worst) + " "), HasSubstr("\"box\""),
                                       HasSubstr("--min-dihedral")));
  EXPECT_THAT(sentence({0, 0.6}), HasSubstr("--min-radius-ratio"));
  // The limits that the sentence offers let the mesh pass: both of them, rounded down.
  const MeshQuality poor = measure_quality(mesh);
  const std::string both = sentence({30, 0.6});
  const auto offered = [&](const std::string& option) {
    const std::size_t at = both.find("accept it with"), value = both.find(option, at);
    EXPECT_NE(value, std::string::npos) << both;
    return std::stod(both.substr(value + option.size()));
  };
  EXPECT_EQ(sentence({offered("--min-dihedral "), offered("--min-radius-ratio ")}), "");
  EXPECT_NEAR(offered("--min-dihedral "), poor.dihedral.value, 0.1);
  EXPECT_NEAR(offered("--min-radius-ratio "), poor.radius_ratio.value, 0.001);
  mesh.nodes[13] = {3, 1, 1};  // outside the box, so elements are inverted
  EXPECT_THAT(sentence({0, 0}), HasSubstr("positive"));
}

TEST(PalpateTetrahedra, MeshesASurfaceAndReports) {
  const auto folder = fresh_folder();
  tests::write_off(folder / "liver.off", sphere_surface(3, 50));
  tests::write_off(folder / "tumour.off", sphere_surface(2, 10));
  const auto run = run_tetrahedra(
      folder,
      "liver.off tumour.off --region liver=liver.off --region lesion=tumour.off -o body.msh --report body.json");
  EXPECT_THAT(run.out, HasSubstr("surface triangles 1600 kept of 1600"));
  const auto report = nlohmann::json::parse(tests::file_bytes(folder / "body.json"));
  EXPECT_EQ(report["regions"][1]["name"], "lesion");
  EXPECT_EQ(report["surface_triangles"]["kept"], 1600);
  const TetrahedralMesh mesh = read_mesh(folder / "body.msh");
  EXPECT_EQ(mesh.nodes.size(), report["vertices"]);
  EXPECT_EQ(mesh.region_names, (std::vector<std::string>{"liver", "lesion"}));
  // A second run from another folder and with another environment gives the same bytes.
  fs::create_directories(folder / "elsewhere/with a longer name");
  for (const char* file : {"liver.off", "tumour.off"}) fs::copy(folder / file, folder / "elsewhere/with a longer name");
  const auto again =
      run_tetrahedra(folder,
                     "'elsewhere/with a longer name/liver.off' 'elsewhere/with a longer name/tumour.off' "
                     "--region liver --region lesion -o again.msh");
  EXPECT_EQ(tests::file_bytes(folder / "body.msh"), tests::file_bytes(folder / "again.msh"));
}

TEST(PalpateTetrahedra, ImprovesTheWorstElementsAndSaysSo) {
  const auto folder = fresh_folder();
  tests::write_off(folder / "sphere.off", sphere_surface(3, 50));
  const auto report_of = [&](const std::string& options) {
    run_tetrahedra(folder, "sphere.off --optimize-below 0 --min-dihedral 0 --min-radius-ratio 0 --report r.json " +
                               options + " -o sphere.msh");
    return nlohmann::json::parse(tests::file_bytes(folder / "r.json"));
  };
  const auto as_filled = report_of("--goal 0"), improved = report_of("--goal 20");
  EXPECT_EQ(as_filled["improvement"]["vertices_moved"], 0);
  EXPECT_GT(improved["improvement"]["vertices_moved"], 0);
  EXPECT_LT(improved["improvement"]["below_after"], improved["improvement"]["below_before"]);
  EXPECT_GT(improved["min_dihedral_degrees"]["value"], as_filled["min_dihedral_degrees"]["value"]);
  EXPECT_EQ(improved["surface_triangles"]["kept"], 1280);
  EXPECT_EQ(improved["tetrahedra"], as_filled["tetrahedra"]);
}

// Expects one sentence, the exit code and no output file.
void expect_refusal(const fs::path& folder, const std::string& arguments, int exit_code, const std::string& says) {
  SCOPED_TRACE(arguments);
  const auto run = run_tetrahedra(folder, arguments + " -o refused.msh", exit_code);
  EXPECT_THAT(run.errors, HasSubstr(says));
  EXPECT_FALSE(fs::exists(folder / "refused.msh"));
  EXPECT_FALSE(fs::exists(folder / "refused.msh.part"));
}

TEST(PalpateTetrahedra, TheGateFailsWithExitCodeThreeAndWritesNothing) {
  const auto folder = fresh_folder();
  tests::write_off(folder / "sphere.off", sphere_surface(2, 50));
  expect_refusal(folder, "sphere.off --min-dihedral 60", 3, "has a dihedral angle of");
  expect_refusal(folder, "sphere.off --min-radius-ratio 0.99", 3, "has a radius ratio of");
}

// A ball of slices: 400 needles around each pole, with angles of 0.9 degrees.
TriangleSurface needles() {
  const int around = 400, down = 5;
  TriangleSurface ball;
  ball.points = {{0, 0, 50}, {0, 0, -50}};
  for (int i = 1; i < down; ++i)
    for (int j = 0; j < around; ++j) {
      const double a = std::numbers::pi * i / down, b = 2 * std::numbers::pi * j / around;
      ball.points.push_back({50 * std::sin(a) * std::cos(b), 50 * std::sin(a) * std::sin(b), 50 * std::cos(a)});
    }
  const auto at = [&](int i, int j) { return 2 + (i - 1) * around + j % around; };
  for (int j = 0; j < around; ++j) {
    ball.triangles.push_back({0, at(1, j), at(1, j + 1)});
    for (int i = 1; i + 1 < down; ++i) {
      ball.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      ball.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
    ball.triangles.push_back({1, at(down - 1, j + 1), at(down - 1, j)});
  }
  return ball;
}

// A wedge of 10 by 10 by 1 mm: atan(0.1) = 5.7 degrees at its thin end.
TriangleSurface wedge() {
  return {{{0, 0, 0}, {0, 10, 0}, {0, 0, 1}, {0, 10, 1}, {10, 0, 0}, {10, 10, 0}},
          {{0, 1, 5}, {0, 5, 4}, {0, 2, 3}, {0, 3, 1}, {2, 4, 5}, {2, 5, 3}, {0, 4, 2}, {1, 3, 5}}};
}

TEST(GateObstacle, FindsNeedlesAndSharpEdgesAndNothingElse) {
  EXPECT_EQ(gate_obstacle(sphere_surface(2, 50), {10, 0.05}).found, "");
  EXPECT_EQ(gate_obstacle(box_surface(1, {0, 0, 0}, {10, 10, 10}), {80, 0.05}).found, "");
  EXPECT_THAT(gate_obstacle(box_surface(1, {0, 0, 0}, {10, 10, 10}), {91, 0.05}).found, HasSubstr("inner angle of 90"));
  EXPECT_THAT(gate_obstacle(needles(), {10, 0.05}).found, HasSubstr("radius ratio"));
  EXPECT_EQ(gate_obstacle(needles(), {10, 0}).found, "");
  EXPECT_THAT(gate_obstacle(wedge(), {10, 0}).found, HasSubstr("inner angle of 5.7"));
}

TEST(PalpateTetrahedra, RemeshesASurfaceWhoseOwnTrianglesCannotMeetTheGateUnlessForbidden) {
  const auto folder = fresh_folder();
  const TriangleSurface ball = needles();
  tests::write_off(folder / "needles.off", ball);
  const auto run = run_tetrahedra(folder, "needles.off -o needles.msh --report needles.json");
  EXPECT_THAT(run.errors, AllOf(HasSubstr("needles.off: "), HasSubstr("remeshed evenly"),
                                HasSubstr("--keep-surface forbids this")));
  const auto report = nlohmann::json::parse(tests::file_bytes(folder / "needles.json"));
  EXPECT_TRUE(report["remeshed"].get<bool>());
  // remeshing restores the volume, and sums of 5,000 terms round below 1e-9
  EXPECT_NEAR(report["regions"][0]["volume"].get<double>() / enclosed_volume(ball), 1, 1e-9);
  tests::write_off(folder / "wedge.off", wedge());
  expect_refusal(folder, "wedge.off --keep-surface", 3, "accept it with");
}

TEST(PalpateTetrahedra, AGateThatNoMeshMeetsIsMetAfterItsAdviceIsFollowed) {
  const auto folder = fresh_folder();
  tests::write_off(folder / "sphere.off", sphere_surface(2, 50));
  const auto refused = run_tetrahedra(folder, "sphere.off --min-dihedral 60 --min-radius-ratio 0.9 -o a.msh", 3);
  const std::size_t advice = refused.errors.find("accept it with");
  ASSERT_NE(advice, std::string::npos) << refused.errors;
  const std::string options = refused.errors.substr(advice + 15);
  run_tetrahedra(folder, "sphere.off -o a.msh " + options.substr(0, options.find('\n')));
}

TEST(PalpateTetrahedra, DamagedSurfacesAreRefusedWithOneSentence) {
  const auto folder = fresh_folder();
  TriangleSurface open = sphere_surface(2, 50);
  open.triangles.pop_back();
  tests::write_off(folder / "open.off", open);
  expect_refusal(folder, "open.off", 2, "palpate-surface --wrap closes them");

  TriangleSurface crossing = sphere_surface(2, 50);
  tests::append(crossing, sphere_surface(2, 50, {60, 0, 0}));
  tests::write_off(folder / "crossing.off", crossing);
  expect_refusal(folder, "crossing.off", 2, "palpate-surface --wrap unites what they enclose");

  tests::write_off(folder / "a.off", box_surface(2, {0, 0, 0}, {10, 10, 10}));
  tests::write_off(folder / "b.off", box_surface(2, {10, 0, 0}, {20, 10, 10}));
  expect_refusal(folder, "a.off b.off", 2, "cross or touch");

  TriangleSurface nested = sphere_surface(2, 50);
  tests::append(nested, sphere_surface(1, 20));
  tests::write_off(folder / "nested.off", nested);
  expect_refusal(folder, "nested.off", 2, "cavity");

  const auto refused = [&](const std::string& name, const std::string& text) {
    std::ofstream(folder / name) << text;
    expect_refusal(folder, name, 2, name);
  };
  refused("nan.off", "OFF\n4 4 0\n0 0 nan\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n");
  refused("range.off", "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 9\n3 0 3 2\n");
  refused("huge.off", "OFF\n4000000000 4000000000 0\n0 0 0\n");
  refused("empty.stl", "");
  expect_refusal(folder, "absent.off", 2, "absent.off");
  refused("flat.off", "OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 2 1\n");
}

TEST(PalpateTetrahedra, DamageThatHasOneCureIsRepairedAndReported) {
  const auto folder = fresh_folder();
  // Binary STL repeats its points in each triangle. The header of this file begins as a text file does.
  const TriangleSurface sphere = sphere_surface(2, 50);
  std::string stl(80, ' ');
  stl.replace(0, 5, "solid");
  const auto put = [&](const auto& value) { stl.append(reinterpret_cast<const char*>(&value), sizeof value); };
  put(static_cast<std::uint32_t>(sphere.triangles.size()));
  for (const Triangle& t : sphere.triangles) {
    for (int d = 0; d < 3; ++d) put(0.0f);
    for (const auto v : {t[0], t[2], t[1]})  // inside out
      for (const double x : sphere.points[v]) put(static_cast<float>(x));
    put(std::uint16_t{0});
  }
  std::ofstream(folder / "soup.stl", std::ios::binary) << stl;
  const auto run = run_tetrahedra(folder, "soup.stl -o soup.msh");
  EXPECT_THAT(run.errors, AllOf(HasSubstr("note: soup.stl: 798 points"), HasSubstr("inside out")));
  EXPECT_THAT(run.out, HasSubstr("surface triangles 320 kept of 320"));
}

TEST(PalpateTetrahedra, NestedShellsOfOneFileAreWhatTheOptionsSay) {
  const auto folder = fresh_folder();
  TriangleSurface nested = sphere_surface(2, 50);
  tests::append(nested, sphere_surface(1, 20));
  tests::write_off(folder / "nested.off", nested);
  run_tetrahedra(folder, "nested.off --nested-regions --region liver --region tumour -o two.msh");
  EXPECT_EQ(read_mesh(folder / "two.msh").region_names, (std::vector<std::string>{"liver", "tumour"}));
  run_tetrahedra(folder, "nested.off --cavities keep -o hollow.msh");
  EXPECT_EQ(read_mesh(folder / "hollow.msh").patches.size(), 2u);
  run_tetrahedra(folder, "nested.off --cavities fill -o whole.msh");
  EXPECT_EQ(read_mesh(folder / "whole.msh").patches.size(), 1u);
}

TEST(PalpateTetrahedra, UsageThatWouldBeIgnoredIsRefused) {
  const auto folder = fresh_folder();
  tests::write_off(folder / "sphere.off", sphere_surface(1, 50));
  expect_refusal(folder, "sphere.off --labels 255=liver", 2, "--labels means nothing");
  expect_refusal(folder, "sphere.off --set h=1", 2, "--set means nothing");
  expect_refusal(folder, "sphere.off --region a --region b", 2, "2 regions are named");
  expect_refusal(folder, "sphere.off --region a=other.off", 2, "not among the inputs");
  expect_refusal(folder, "", 2, "INPUT");
  run_tetrahedra(folder, "sphere.off -o sphere.vtu", 2);
  run_tetrahedra(folder, "sphere.off -o nowhere/sphere.msh", 2);
  run_tetrahedra(folder, "--help");
}

}  // namespace
}  // namespace palpate
