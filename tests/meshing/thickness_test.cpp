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
  return local_thickness(select_voxels(labels_of(image), {}, 0, "image"), share);
}

// Balls have their centres in voxels' centres, and the search goes down by 15 % a step: never too large, and too small by a voxel
// (its longest side) and one step at most.
void expect_thickness(double found, double true_one, double voxel) {
  EXPECT_LE(found, true_one);
  EXPECT_GE(found, 0.85 * (true_one - voxel));
}

TEST(Thickness, OfAPlateIsItsOwn) {
  const auto plate = [](const Point& p) { return std::abs(p[2]) < 6 && std::abs(p[0]) < 40 && std::abs(p[1]) < 40; };
  expect_thickness(thickness_of({1, 1, 1}, plate), 12, 1);
  expect_thickness(thickness_of({1, 1, 2}, plate), 12, 2);
}

TEST(Thickness, OfARodIsItsDiameter) {
  const auto rod = [](const Point& p) { return std::hypot(p[0], p[1]) < 8 && std::abs(p[2]) < 42; };
  expect_thickness(thickness_of({1, 1, 1}, rod), 16, 1);
}

TEST(Thickness, OfACapsuleInCoarseVoxelsIsItsDiameter) {
  const auto capsule = [](const Point& p) { return std::hypot(p[0], p[1], std::max(0.0, std::abs(p[2]) - 12)) < 25; };
  expect_thickness(thickness_of({3, 3, 3}, capsule), 50, 3);
}

TEST(Thickness, LeavesOutThinPartsOfASmallShareOnly) {
  // A ball of 50 mm with a plate of 4 mm: the plate has 12 % of the volume.
  const auto both = [](const Point& p) {
    return std::hypot(p[0], p[1], p[2]) < 25 || (std::abs(p[2]) < 2 && std::abs(p[0]) < 40 && std::abs(p[1]) < 25);
  };
  expect_thickness(thickness_of({1, 1, 1}, both, 0.8), 50, 1);
  expect_thickness(thickness_of({1, 1, 1}, both, 0.95), 4, 1);
}

TEST(Thickness, OfOneVoxelIsTheMeanOfItsSides) {
  const auto one = [](const Point& p) { return std::hypot(p[0] - 1.5, p[1], p[2] - 2.5) < 0.9; };  // a voxel's centre
  EXPECT_DOUBLE_EQ(thickness_of({3, 2, 5}, one), 10.0 / 3);
}

}  // namespace
}  // namespace palpate
