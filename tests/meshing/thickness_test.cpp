// The thickness of bodies of known thickness, in voxels.
#include "meshing/image/thickness.h"

#include <gtest/gtest.h>

#include "tests/meshing/surface_images.h"

namespace palpate {
namespace {

using namespace tests;

double thickness_of(const Point& voxel, const std::function<int(const Point&)>& shape, double share = 0.95) {
  const std::array<int, 3> size = {static_cast<int>(90 / voxel[0]), static_cast<int>(90 / voxel[1]),
                                   static_cast<int>(90 / voxel[2])};
  const ShapeImage image = shape_image(size, {{{voxel[0], 0, 0}, {0, voxel[1], 0}, {0, 0, voxel[2]}}}, {}, shape);
  return local_thickness(select_voxels({image.grid, {image.values.begin(), image.values.end()}, {}}, {}, 0, "image"),
                         share);
}

// A ball has its centre in a voxel's centre, and the voxels' steps hide up to one voxel more.
TEST(Thickness, OfAPlateIsItsOwn) {
  const auto plate = [](const Point& p) { return std::abs(p[2]) < 6 && std::abs(p[0]) < 40 && std::abs(p[1]) < 40; };
  EXPECT_NEAR(thickness_of({1, 1, 1}, plate), 12, 1.5);
  EXPECT_NEAR(thickness_of({1, 1, 2}, plate), 12, 2);
}

TEST(Thickness, OfARodIsItsDiameter) {
  const auto rod = [](const Point& p) { return std::hypot(p[0], p[1]) < 8 && std::abs(p[2]) < 42; };
  EXPECT_NEAR(thickness_of({1, 1, 1}, rod), 16, 2);
}

TEST(Thickness, OfAnEllipsoidInCoarseVoxelsIsNearItsShortestAxis) {
  // In voxels of 3 mm a quarter of them lie at the border. A ball of radius 20 mm fits everywhere but in the tips, whose
  // radius of curvature is 18 mm.
  const auto ellipsoid_of_an_organ = ellipsoid(27.5, 30, 44);
  EXPECT_NEAR(thickness_of({3, 3, 3}, ellipsoid_of_an_organ), 45, 10);
}

TEST(Thickness, LeavesOutThinPartsOfASmallShareOnly) {
  // A ball of 50 mm with a plate of 4 mm: the plate has 12 % of the volume.
  const auto both = [](const Point& p) {
    return std::hypot(p[0], p[1], p[2]) < 25 || (std::abs(p[2]) < 2 && std::abs(p[0]) < 40 && std::abs(p[1]) < 25);
  };
  EXPECT_GT(thickness_of({1, 1, 1}, both, 0.8), 40);
  EXPECT_LT(thickness_of({1, 1, 1}, both, 0.95), 8);  // 4 mm, 15 % and the voxels' steps
}

TEST(Thickness, OfOneVoxelIsTheMeanOfItsSides) {
  const auto one = [](const Point& p) { return std::hypot(p[0] - 1.5, p[1], p[2] - 2.5) < 0.9; };  // a voxel's centre
  EXPECT_DOUBLE_EQ(thickness_of({3, 2, 5}, one), 10.0 / 3);
}

}  // namespace
}  // namespace palpate
