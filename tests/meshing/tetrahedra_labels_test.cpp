#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <map>
#include <numbers>
#include <set>

#include "formats/errors.h"
#include "formats/program.h"
#include "formats/tetrahedral_mesh.h"
#include "meshing/tetrahedra/boundary_of_mesh.h"
#include "meshing/tetrahedra/move_to_volumes.h"
#include "meshing/tetrahedra/tetrahedra_from_image.h"
#include "meshing/tetrahedra/triangle_crossings.h"
#include "tests/meshing/run_tetrahedra.h"
#include "tests/support/texts.h"

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

TEST(TetrahedraFromLabels, ATipThatCoarseTrianglesLoseIsWarnedOf) {
  // A ball of two tissues; one of them has a horn of 11 mm length and 4 mm width.
  const std::string image = write_ball(fresh_folder(), [](double x, double y, double z) {
    if (std::hypot(x + 5, y, z) < 8) return x < -5 ? 2 : 1;
    return x > 0 && std::hypot(y, z) < 2 ? 1 : 0;
  });
  const auto warned_of_a_tip = [&](double edge_mm, double smooth_mm) {
    const std::size_t before = warnings().size();
    LabelImageOptions options = options_for({"1=horned", "2=beside"});
    options.edge_mm = edge_mm, options.smooth_mm = smooth_mm, options.facet_distance = edge_mm / 8;
    tetrahedra_from_image({image}, options, {});
    const auto said = warnings();
    return std::any_of(said.begin() + static_cast<std::ptrdiff_t>(before), said.end(), [](const std::string& text) {
      return text.find("tissue \"horned\" (label 1)") == 0 && text.find("a thin tip was lost") != std::string::npos;
    });
  };
  EXPECT_TRUE(warned_of_a_tip(6, 2));
  EXPECT_FALSE(warned_of_a_tip(1.5, 0.5));
}

TEST(TetrahedraFromLabels, TwoTouchingLabelsShareTheirInterfaceExactly) {
  const auto folder = fresh_folder();
  const std::string image = write_ball(folder, [](double x, double, double) { return x < 0 ? 1 : 2; });
  const MeshReport report = tetrahedra_from_image({image}, options_for({"1=left", "2=right"}), {});
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
    EXPECT_NEAR(report.region_volume_of_surface[t] / report.tissue_volumes[t].voxels, 1, 0.02);
}

// A small organ on a large one, meshed with triangles that are far too large for it.
TEST(TetrahedraFromLabels, EveryTissueHasTheVolumeOfItsVoxels) {
  const auto folder = fresh_folder();
  const std::string image =
      write_ball(folder, [](double x, double y, double z) { return (x - 11) * (x - 11) + y * y + z * z < 36 ? 2 : 1; });
  LabelImageOptions options = options_for({"1=liver", "2=gallbladder"});
  options.edge_mm = 10, options.facet_distance = 0, options.smooth_mm = {};
  forget_warnings();
  const MeshReport report = tetrahedra_from_image({image}, options, {});
  EXPECT_TRUE(warnings().empty()) << warnings().front();
  const auto volume = measure_quality(report.mesh).region_volume;
  for (std::size_t t = 0; t < 2; ++t) {
    const TissueVolume& tissue = report.tissue_volumes[t];
    EXPECT_LT(tissue.meshed, 0.975 * tissue.voxels) << t;  // what the triangles lose without the move
    EXPECT_NEAR(volume[t] / tissue.voxels, 1, 1e-6) << t;
    EXPECT_GT(tissue.moved_mm, 0) << t;
  }
  EXPECT_LT(report.tissue_volumes[1].edge, 3);  // a quarter of the gallbladder's size, not 10 mm
  EXPECT_GT(measure_quality(report.mesh).dihedral.value, 5);
}

// Smoothing takes a third of a plate of 4 mm, and triangles as small as voxels can be moved by half a voxel only.
TEST(TetrahedraFromLabels, AVolumeThatIsNotReachedIsWarnedOfWithItsNumbers) {
  const auto folder = fresh_folder();
  const std::string image =
      write_ball(folder, [](double x, double y, double z) { return x * x + y * y < 64 && std::abs(z) < 2 ? 2 : 0; });
  LabelImageOptions options = options_for({"2=plate"});
  options.smooth_mm = 1.75, options.edge_mm = 0.8, options.facet_distance = 0.2;
  forget_warnings();
  const MeshReport report = tetrahedra_from_image({image}, options, {});
  EXPECT_LT(report.region_volume_of_surface[0], 0.98 * report.tissue_volumes[0].voxels);
  EXPECT_GT(report.region_volume_of_surface[0], 1.05 * report.tissue_volumes[0].meshed);  // moved as far as it may
  ASSERT_EQ(warnings().size(), 1u);
  EXPECT_THAT(warnings().front(),
              testing::AllOf(testing::HasSubstr("tissue \"plate\" (label 2)"),
                             testing::HasSubstr("smoothing changed -"), testing::HasSubstr("try to --smooth less")));
}

// Two boxes of 2 x 2 x 1 that share a wall, with a regular grid of triangles.
VolumeBoundary two_boxes() {
  VolumeBoundary boundary;
  boundary.region_names = {"low", "high"};
  std::map<std::array<int, 3>, std::int32_t> number;
  const auto at = [&](int x, int y, int z) {
    const auto [found, fresh] = number.emplace(std::array{x, y, z}, static_cast<std::int32_t>(boundary.points.size()));
    if (fresh) boundary.points.push_back({0.5 * x, 0.5 * y, 0.5 * z});
    return found->second;
  };
  boundary.patches = {{0, VolumeBoundary::kOutside, {}}, {1, VolumeBoundary::kOutside, {}}, {0, 1, {}}};
  // The square whose normal is axis d, at level c, with its corner at (u, v) of the two other axes.
  const auto square = [&](std::size_t patch, int d, int c, int u, int v, bool up) {
    std::array<std::int32_t, 4> corner{};
    for (int i = 0; i < 4; ++i) {
      std::array<int, 3> p{};
      p[d] = c, p[(d + 1) % 3] = u + (i == 1 || i == 2), p[(d + 2) % 3] = v + (i >= 2);
      corner[i] = at(p[0], p[1], p[2]);
    }
    if (!up) std::swap(corner[1], corner[3]);
    boundary.patches[patch].triangles.push_back({corner[0], corner[1], corner[2]});
    boundary.patches[patch].triangles.push_back({corner[0], corner[2], corner[3]});
  };
  for (int u = 0; u < 4; ++u)
    for (int v = 0; v < 4; ++v) {
      square(0, 2, 0, u, v, false);
      square(2, 2, 2, u, v, true);
      square(1, 2, 4, u, v, true);
      for (const int d : {0, 1})
        for (const int c : {0, 4})
          d == 0 ? square(v < 2 ? 0 : 1, 0, c, u, v, c > 0) : square(u < 2 ? 0 : 1, 1, c, u, v, c > 0);
    }
  return boundary;
}

TEST(MoveToVolumes, GivesEachRegionItsVolumeAndKeepsTheSharedWall) {
  VolumeBoundary boundary = two_boxes();
  const auto before = enclosed_volumes(boundary);
  ASSERT_NEAR(before[0], 4, 1e-12);
  ASSERT_NEAR(before[1], 4, 1e-12);
  const VolumeMove move = move_to_volumes(boundary, {4.4, 3.8});
  EXPECT_EQ(move.share, 1);
  const auto after = enclosed_volumes(boundary);
  EXPECT_NEAR(after[0], 4.4, 1e-8);
  EXPECT_NEAR(after[1], 3.8, 1e-8);
  EXPECT_GT(move.distance[0], 0);
  EXPECT_LT(move.distance[1], 0);
  const std::size_t points = two_boxes().points.size();
  EXPECT_EQ(boundary.points.size(), points);  // the wall is still one sheet
}

TEST(MoveToVolumes, StopsBeforeTrianglesCross) {
  VolumeBoundary boundary = two_boxes();
  const VolumeMove move = move_to_volumes(boundary, {0.4, 7.9});
  EXPECT_LT(move.share, 1);
  std::vector<Triangle> all;
  for (const auto& patch : boundary.patches) all.insert(all.end(), patch.triangles.begin(), patch.triangles.end());
  EXPECT_FALSE(first_crossing(boundary.points, all));
  const auto after = enclosed_volumes(boundary);  // the stated share of what was missing
  EXPECT_NEAR(after[0], 4 - 3.6 * move.share, 1e-7);
}

TEST(FirstCrossing, FindsEveryKindOfContactBetweenTriangles) {
  const std::vector<Point> flat = {{0, 0, 0},      {1, 0, 0},     {0, 1, 0},    {1, 1, 0},
                                   {0.2, 0.2, -1}, {0.2, 0.2, 1}, {0.3, 0.6, 1}};
  EXPECT_FALSE(first_crossing(flat, {{0, 1, 2}, {1, 3, 2}}));  // neighbours in a plane
  EXPECT_TRUE(first_crossing(flat, {{0, 1, 2}, {4, 5, 6}}));   // one pierces the other
  EXPECT_TRUE(first_crossing(flat, {{0, 1, 2}, {0, 4, 5}}));   // beyond their shared corner
  EXPECT_FALSE(first_crossing(flat, {{0, 1, 2}, {0, 5, 6}}));  // only in their shared corner
  EXPECT_TRUE(first_crossing({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.5, 0.5, 0}}, {{0, 1, 2}, {1, 0, 3}}));  // folded
  EXPECT_FALSE(first_crossing(flat, {{0, 1, 2}, {0, 1, 5}, {1, 0, 4}}));  // three at one edge, as where tissues meet
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
  const auto sentence = [&](const std::vector<std::string>& tissues) {
    return tests::input_error([&] { tetrahedra_from_image({image}, options_for(tissues), {}); });
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
