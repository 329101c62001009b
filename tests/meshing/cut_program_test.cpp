// palpate-cut as users run it: the mesh that it writes, and what it refuses.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <set>

#include "formats/tetrahedral_mesh.h"
#include "meshing/tetrahedra/mesh_quality.h"
#include "tests/support/box_files.h"
#include "tests/support/program_run.h"

namespace palpate {
namespace {

using testing::HasSubstr;
using tests::fresh_folder;
using Triangle = std::array<std::int32_t, 3>;

// A block of 60 x 60 x 60 mm. The blade comes from above and is longer than the block is wide.
class CutProgram : public testing::Test {
 protected:
  CutProgram() : folder_(fresh_folder()) {}

  void write(const TetrahedralMesh& mesh, const std::string& blade) const {
    write_mesh(folder_ / "block.msh", mesh);
    std::ofstream(folder_ / "blade.csv") << blade;
  }
  static TetrahedralMesh block(double jitter) { return box_mesh({6, 6, 6}, {60, 60, 60}, jitter); }
  static std::string down_to(double depth) {
    return "x1,y1,z1,x2,y2,z2\n30,-5,65,30,65,65\n30,-5," + std::to_string(60 - depth) + ",30,65," +
           std::to_string(60 - depth) + "\n";
  }
  tests::ProgramRun run(const std::string& options = "", int code = 0) const {
    const tests::ProgramRun run =
        tests::run_in(folder_, std::string(PALPATE_CUT_PROGRAM) + " block.msh --blade blade.csv -o cut.msh " + options);
    EXPECT_EQ(run.code, code) << run.errors;
    EXPECT_EQ(std::filesystem::exists(folder_ / "cut.msh"), code == 0);
    return run;
  }
  TetrahedralMesh result() const { return read_mesh(folder_ / "cut.msh"); }
  std::string refusal() const { return run("", 2).errors; }

  const std::filesystem::path folder_;
};

double area_of(const TetrahedralMesh& mesh, const std::vector<Triangle>& triangles) {
  double sum = 0;
  for (const Triangle& t : triangles) {
    std::array<std::array<double, 3>, 2> side;
    for (std::size_t i = 0; i < 2; ++i)
      for (std::size_t d = 0; d < 3; ++d)
        side[i][d] = mesh.nodes[static_cast<std::size_t>(t[i + 1])][d] - mesh.nodes[static_cast<std::size_t>(t[0])][d];
    const auto& [a, b] = side;
    sum += std::hypot(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]) / 2;
  }
  return sum;
}

const std::vector<Triangle>& patch(const TetrahedralMesh& mesh, const std::string& name) {
  for (const auto& p : mesh.patches)
    if (p.name == name) return p.triangles;
  throw std::runtime_error("no patch " + name);
}

// Each edge of the surface is part of two triangles, which pass it in opposite directions.
bool is_closed(const TetrahedralMesh& mesh) {
  std::map<std::pair<std::int32_t, std::int32_t>, int> edges;
  for (const Triangle& t : boundary_triangles(mesh))
    for (std::size_t i = 0; i < 3; ++i) ++edges[{t[i], t[(i + 1) % 3]}];
  return std::ranges::all_of(edges, [&](const auto& edge) {
    const auto back = edges.find({edge.first.second, edge.first.first});
    return edge.second == 1 && back != edges.end();
  });
}

TEST_F(CutProgram, HalfWayThroughABlockAlongItsFaces) {
  write(block(0), down_to(30));
  EXPECT_THAT(run().out, HasSubstr("mean 0, worst 0 from the path"));
  const TetrahedralMesh cut = result();
  EXPECT_TRUE(is_closed(cut));
  EXPECT_EQ(cut.nodes.size(), 7u * 7 * 7 + 3 * 7);  // the end of the cut, at half of the depth, stays one
  EXPECT_NEAR(area_of(cut, patch(cut, "cut")), 2 * 30 * 60, 1e-9);
  EXPECT_NEAR(measure_quality(cut).region_volume.at(0), 60 * 60 * 60, 1e-6);
}

TEST_F(CutProgram, LipsOfAnyMeshComeToLieOnThePath) {
  write(block(0.2), "30,-5,65,37,65,65\n27,-5,20,35,65,20\n");
  run();
  const TetrahedralMesh cut = result();
  EXPECT_TRUE(is_closed(cut));
  EXPECT_GE(measure_quality(cut).dihedral.value, std::min(10.0, measure_quality(block(0.2)).dihedral.value));
  EXPECT_NEAR(area_of(cut, patch(cut, "cut")) / 2, 40 * 60.3, 0.15 * 40 * 60.3);
  double sum = 0;
  std::set<std::int32_t> nodes;
  for (const Triangle& t : patch(cut, "cut")) nodes.insert(t.begin(), t.end());
  for (const std::int32_t n : nodes) {
    const auto& p = cut.nodes[static_cast<std::size_t>(n)];
    const double across = 30 + 7 * (p[1] + 5) / 70 - 3 * (65 - p[2]) / 45;  // about, for a path that is hardly twisted
    sum += std::abs(p[0] - across);
  }
  EXPECT_LT(sum / static_cast<double>(nodes.size()), 1);  // mm, of edges of 10 to 17 mm
}

TEST_F(CutProgram, PatchesStayOnTheSurface) {
  const TetrahedralMesh whole = block(0.1);
  write(whole, down_to(30));
  run();
  const TetrahedralMesh cut = result();
  std::set<Triangle> surface;
  const auto sorted = [](Triangle t) {
    std::ranges::sort(t);
    return t;
  };
  for (const Triangle& t : boundary_triangles(cut)) surface.insert(sorted(t));
  for (const auto& before : whole.patches) {
    EXPECT_EQ(patch(cut, before.name).size(), before.triangles.size());
    for (const Triangle& t : patch(cut, before.name)) EXPECT_TRUE(surface.contains(sorted(t))) << before.name;
  }
  EXPECT_NEAR(area_of(cut, patch(cut, "z1")), 60 * 60, 1e-6);
}

TEST_F(CutProgram, APieceThatIsCutOffIsToldOrLeftOut) {
  write(block(0), "20,-5,65,20,65,65\n20,-5,-5,20,65,-5\n");
  EXPECT_THAT(run().errors, HasSubstr("the cut leaves 2 pieces"));
  EXPECT_NEAR(measure_quality(result()).region_volume.at(0), 60 * 60 * 60, 1e-6);
  std::filesystem::remove(folder_ / "cut.msh");
  EXPECT_EQ(run("--largest-piece").errors, "");
  const TetrahedralMesh rest = result();
  EXPECT_TRUE(is_closed(rest));
  EXPECT_NEAR(measure_quality(rest).region_volume.at(0), 40 * 60 * 60, 1e-6);
  EXPECT_EQ(rest.nodes.size(), 5u * 7 * 7);
}

TEST_F(CutProgram, CutsThatCrossAndACutThatGoesBack) {
  write(block(0.1), "30,-5,65,30,65,65\n30,-5,25,30,65,25\n30,-5,65,30,65,65\n-5,30,65,65,30,65\n-5,30,25,65,30,25\n");
  run();
  const TetrahedralMesh cut = result();
  EXPECT_TRUE(is_closed(cut));
  EXPECT_NEAR(measure_quality(cut).region_volume.at(0), 60 * 60 * 60, 1e-6);
}

TEST_F(CutProgram, ABundleIsMadeOfIt) {
  tests::write_box_files(folder_);
  std::ofstream(folder_ / "blade.csv") << "30,-5,45,30,55,45\n30,-5,20,30,55,20\n";
  const tests::ProgramRun run = tests::run_in(
      folder_, std::string(PALPATE_CUT_PROGRAM) + " box.msh --blade blade.csv -o cut.msh && " +
                   PALPATE_PRECOMPUTE_PROGRAM + " cut.msh --organ organ.toml --boundary bc.toml -o cut.h5 && " +
                   PALPATE_BUNDLE_PROGRAM + " verify cut.h5");
  EXPECT_EQ(run.code, 0) << run.errors;
}

TEST_F(CutProgram, RefusesInOneSentenceAndWritesNothing) {
  write(block(0), "30,-5,65,30,65\n");
  EXPECT_THAT(refusal(), HasSubstr("blade.csv:1: expected x, y, z of each point of the blade's edge"));
  write(block(0), "30,-5,65,30,65,65\n30,-5,25,30,65,nan\n");
  EXPECT_THAT(refusal(), HasSubstr("blade.csv:2: expected 6 numbers, as in the first row"));
  write(block(0), "30,-5,65,30,65,65\n");
  EXPECT_THAT(refusal(), HasSubstr("blade.csv: expected two places of the blade or more, a row for each, found 1"));
  write(block(0), "300,-5,65,300,65,65\n300,-5,25,300,65,25\n");
  EXPECT_THAT(refusal(), HasSubstr("block.msh along blade.csv: expected a path that passes through the organ"));
  TetrahedralMesh named = block(0);
  named.patches.front().name = "cut";
  write(named, down_to(30));
  EXPECT_THAT(refusal(), HasSubstr("the patch \"cut\": expected another name"));
}

}  // namespace
}  // namespace palpate
