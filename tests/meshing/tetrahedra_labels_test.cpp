#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <numbers>
#include <set>

#include "formats/errors.h"
#include "formats/tetrahedral_mesh.h"
#include "meshing/tetrahedra/boundary_of_mesh.h"
#include "meshing/tetrahedra/tetrahedra_from_image.h"
#include "tests/meshing/run_tetrahedra.h"

namespace palpate {
namespace {

using tests::fresh_folder;

constexpr double kRadius = 15, kVoxel = 1;

// A ball of 31 voxels across in an image of 40 x 40 x 40. The position of a voxel decides its label.
std::string write_ball(const std::filesystem::path& folder, const std::function<int(double, double, double)>& label) {
  const int n = 40;
  std::string voxels;
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) {
        const double x = i - (n - 1) / 2.0, y = j - (n - 1) / 2.0, z = k - (n - 1) / 2.0;
        voxels += static_cast<char>(x * x + y * y + z * z <= kRadius * kRadius ? label(x, y, z) : 0);
      }
  const std::filesystem::path file = folder / "ball.nrrd";
  std::ofstream out(file, std::ios::binary);
  out << "NRRD0004\ntype: uint8\ndimension: 3\nspace: left-posterior-superior\nsizes: 40 40 40\n"
      << "space directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\nencoding: raw\n\n"
      << voxels;
  return file.string();
}

LabelImageOptions options_for(const std::vector<std::string>& tissues) {
  LabelImageOptions options;
  options.tissues = parse_tissues(tissues);
  options.edge_mm = 4;
  options.facet_distance = 0.4;
  options.smooth_mm = 1;
  return options;
}

// The border may move by the facet distance and, because of the smoothing, by a quarter of a voxel, over all the area
// of the tissue.
void expect_volume(double volume, double expected, double area) {
  EXPECT_NEAR(volume, expected, area * (0.4 + 0.25 * kVoxel));
}

std::set<std::int32_t> nodes_of_region(const TetrahedralMesh& mesh, std::int32_t region) {
  std::set<std::int32_t> nodes;
  for (std::size_t e = 0; e < mesh.tetrahedra.size(); ++e)
    if (mesh.region[e] == region) nodes.insert(mesh.tetrahedra[e].begin(), mesh.tetrahedra[e].end());
  return nodes;
}

const TetrahedralMesh::Patch& patch(const TetrahedralMesh& mesh, const std::string& name) {
  for (const auto& p : mesh.patches)
    if (p.name == name) return p;
  throw std::out_of_range("no patch " + name);
}

TEST(TetrahedraFromLabels, TwoTouchingLabelsShareTheirInterfaceExactly) {
  const auto folder = fresh_folder();
  const std::string image = write_ball(folder, [](double x, double, double) { return x < 0 ? 1 : 2; });
  for (const auto fill : {LabelImageOptions::Fill::hxt, LabelImageOptions::Fill::mesh_3}) {
    LabelImageOptions options = options_for({"1=left", "2=right"});
    options.fill = fill;
    const MeshReport report = tetrahedra_from_image({image}, options, {});
    const TetrahedralMesh& mesh = report.mesh;
    EXPECT_EQ(mesh.region_names, (std::vector<std::string>{"left", "right"}));
    EXPECT_EQ(report.kept_triangles, report.surface_triangles);
    const auto left = nodes_of_region(mesh, 0), right = nodes_of_region(mesh, 1);
    std::set<std::int32_t> shared, on_interface;
    for (const auto node : left)
      if (right.contains(node)) shared.insert(node);
    for (const auto& t : patch(mesh, "left-right").triangles) on_interface.insert(t.begin(), t.end());
    EXPECT_EQ(shared, on_interface);
    EXPECT_GT(on_interface.size(), 20u);
    const double half_ball = 2 * std::numbers::pi / 3 * std::pow(kRadius, 3),
                 area = 3 * std::numbers::pi * kRadius * kRadius;
    const auto volume = measure_quality(mesh).region_volume;
    expect_volume(volume[0], half_ball, area);
    expect_volume(volume[1], half_ball, area);
    EXPECT_GT(measure_quality(mesh).dihedral.value, 5);
    // Every face of the outside belongs to exactly one of the outer patches.
    EXPECT_EQ(boundary_triangles(mesh).size(),
              patch(mesh, "left-outside").triangles.size() + patch(mesh, "right-outside").triangles.size());
  }
}

TEST(TetrahedraFromLabels, ThreeTissuesMayMeetInALine) {
  const auto folder = fresh_folder();
  const std::string image = write_ball(folder, [](double x, double y, double) { return x < 0 ? 1 : y < 0 ? 2 : 3; });
  const MeshReport report = tetrahedra_from_image({image}, options_for({"1=a", "2=b", "3=c"}), {});
  const double ball = 4 * std::numbers::pi / 3 * std::pow(kRadius, 3), area = 4 * std::numbers::pi * kRadius * kRadius;
  const auto volume = measure_quality(report.mesh).region_volume;
  expect_volume(volume[0], ball / 2, area);
  expect_volume(volume[1], ball / 4, area);
  expect_volume(volume[2], ball / 4, area);
  EXPECT_FALSE(patch(report.mesh, "b-c").triangles.empty());
  EXPECT_TRUE(non_manifold_edges(boundary_of(report.mesh)).places.empty());
}

// Two blocks that touch over a half and part at a small angle over the other half: where the gap opens, it is far
// narrower than a triangle, and surfaces of either side share edges there.
TEST(TetrahedraFromLabels, TissuesThatPartAtASmallAngleHaveAManifoldOutside) {
  const auto folder = fresh_folder();
  const int nx = 60, ny = 60, nz = 40;
  std::string voxels;
  for (int z = 0; z < nz; ++z)
    for (int y = 0; y < ny; ++y)
      for (int x = 0; x < nx; ++x) {
        const bool within = x > 5 && x < 54 && y > 5 && y < 55 && z > 5 && z < 35;
        const double gap = std::max(0.0, 0.1 * (y - 30));
        voxels += static_cast<char>(!within ? 0 : x < 29 ? 1 : x >= 29 + gap ? 2 : 0);
      }
  std::ofstream(folder / "wedge.nrrd", std::ios::binary)
      << "NRRD0004\ntype: uint8\ndimension: 3\nspace: left-posterior-superior\nsizes: 60 60 40\n"
      << "space directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\nencoding: raw\n\n"
      << voxels;
  const MeshReport report = tetrahedra_from_image({(folder / "wedge.nrrd").string()}, options_for({"1=a", "2=b"}), {});
  EXPECT_TRUE(non_manifold_edges(boundary_of(report.mesh)).places.empty());
  // Gaps are filled within an edge of 4 mm of the bad places, where the gap is below 2 mm wide: less than 1 % of either.
  for (std::size_t t = 0; t < 2; ++t)
    EXPECT_NEAR(report.region_volume_of_surface[t] / report.region_volume_of_voxels[t], 1, 0.02);
}

TEST(TetrahedraFromLabels, ATissueInsideAnotherHasNoOutside) {
  const auto folder = fresh_folder();
  const std::string image =
      write_ball(folder, [](double x, double y, double z) { return x * x + y * y + z * z < 49 ? 2 : 1; });
  const MeshReport report = tetrahedra_from_image({image}, options_for({"1=liver", "2=tumour"}), {});
  EXPECT_THROW(patch(report.mesh, "tumour-outside"), std::out_of_range);
  EXPECT_FALSE(patch(report.mesh, "liver-tumour").triangles.empty());
  const double tumour = 4 * std::numbers::pi / 3 * 343;
  expect_volume(measure_quality(report.mesh).region_volume[1], tumour, 4 * std::numbers::pi * 49);
}

TEST(TetrahedraFromLabels, AHoleInATissueIsACavityWhenItIsKept) {
  const auto folder = fresh_folder();
  const std::string image =
      write_ball(folder, [](double x, double y, double z) { return x * x + y * y + z * z < 49 ? 0 : 1; });
  LabelImageOptions options = options_for({"1=liver"});
  options.keep_cavities = true;
  EXPECT_FALSE(patch(tetrahedra_from_image({image}, options, {}).mesh, "liver-cavity").triangles.empty());
  options.keep_cavities = false;
  EXPECT_EQ(tetrahedra_from_image({image}, options, {}).mesh.patches.size(), 1u);
}

TEST(TetrahedraFromLabels, ALabelThatVanishesOrIsAbsentIsNamed) {
  const auto folder = fresh_folder();
  const std::string image = write_ball(
      folder, [](double x, double y, double z) { return std::abs(x) + std::abs(y) + std::abs(z) < 2 ? 7 : 1; });
  const auto sentence = [&](const std::vector<std::string>& tissues) -> std::string {
    try {
      tetrahedra_from_image({image}, options_for(tissues), {});
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(sentence({"1=liver", "7=speck"}), testing::HasSubstr("speck"));
  EXPECT_THAT(sentence({"1=liver", "9=spleen"}), testing::AllOf(testing::HasSubstr("9"), testing::HasSubstr("7")));
}

TEST(TetrahedraFromLabels, GivesTheSameMeshTwice) {
  const auto folder = fresh_folder();
  const std::string image = write_ball(folder, [](double x, double, double) { return x < 0 ? 1 : 2; });
  const auto options = options_for({"1=left", "2=right"});
  const TetrahedralMesh one = tetrahedra_from_image({image}, options, {}).mesh;
  std::vector<std::string> blocks(5000, std::string(100, 'x'));  // changes the addresses in the heap
  const TetrahedralMesh two = tetrahedra_from_image({image}, options, {}).mesh;
  EXPECT_TRUE(one.nodes == two.nodes && one.tetrahedra == two.tetrahedra);
}

TEST(TetrahedraFromLabels, NoiseIsRefusedInBoundedTime) {
  const auto folder = fresh_folder();
  const std::string image = write_ball(folder, [](double x, double y, double z) {
    return (static_cast<int>(x + 40) + static_cast<int>(y + 40) + static_cast<int>(z + 40)) % 2;
  });
  LabelImageOptions options = options_for({"1=noise"});
  options.smooth_mm = 0;
  options.components = "all";
  EXPECT_THROW(tetrahedra_from_image({image}, options, {}), InputError);
}

TEST(ParseTissues, WantsValuesAndNamesOnce) {
  EXPECT_EQ(parse_tissues({"255=liver", "127"})[1].name, "label 127");
  for (const std::vector<std::string>& bad :
       {std::vector<std::string>{"liver"}, {"255="}, {"255=a", "255=b"}, {"1=a", "2=a"}, {"nan=a"}, {"1x=a"}})
    EXPECT_THROW(parse_tissues(bad), InputError) << bad[0];
}

}  // namespace
}  // namespace palpate
