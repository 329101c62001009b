// The `label` selector: nodes in and near the voxels of a label image, whatever the voxels' axes and the mesh's unit and frame.
#include "precompute/elements/label_nodes.h"

#include <gmock/gmock.h>

#include <cmath>
#include <fstream>

#include "precompute/elements/elastic_body.h"
#include "studies/bodies/box_mesh.h"
#include "tests/support/test_files.h"
#include "tests/support/texts.h"

namespace palpate::tests {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// 4 x 3 x 2 voxels of 2 x 3 x 5 mm; voxel (0, 0, 0) is centred at the origin. Label 7 in (1, 0, 0) and (2, 0, 0), 9 in (0, 2, 1).
LabelImage image() {
  LabelImage result;
  result.grid.size = {4, 3, 2};
  result.grid.axis = {{{2, 0, 0}, {0, 3, 0}, {0, 0, 5}}};
  result.values.assign(24, 0);
  result.values[result.grid.index(1, 0, 0)] = result.values[result.grid.index(2, 0, 0)] = 7;
  result.values[result.grid.index(0, 2, 1)] = 9;
  return result;
}

TEST(LabelNodes, AreInsideAVoxelOrWithinTheDistanceOfItsBox) {
  // Label 7 fills x 1 .. 5, y -1.5 .. 1.5, z -2.5 .. 2.5.
  const std::vector<std::array<double, 3>> points = {{1, 0, 0},   {4.9, 1.4, -2.4}, {0.9, 0, 0}, {6, 0, 0},
                                                     {3, 4.5, 0}, {8, 5.5, 0},      {3, 0, -9},  {-1000, 0, 0}};
  EXPECT_THAT(near_labels(image(), {7}, 0, points), ElementsAre(1, 1, 0, 0, 0, 0, 0, 0));
  EXPECT_THAT(near_labels(image(), {7}, 1, points), ElementsAre(1, 1, 1, 1, 0, 0, 0, 0));
  EXPECT_THAT(near_labels(image(), {7}, 3, points), ElementsAre(1, 1, 1, 1, 1, 0, 0, 0));
  EXPECT_THAT(near_labels(image(), {7}, 4.99, points), ElementsAre(1, 1, 1, 1, 1, 0, 0, 0));
  EXPECT_THAT(near_labels(image(), {7}, 5.01, points), ElementsAre(1, 1, 1, 1, 1, 1, 0, 0));  // (3, 4) off the corner
  EXPECT_THAT(near_labels(image(), {9}, 2, {{-1, 6, 5}, {1, 6, 9}, {4, 6, 5}}), ElementsAre(1, 1, 0));
  EXPECT_THAT(near_labels(image(), {7, 9}, 0, {{1, 0, 0}, {0, 6, 5}}), ElementsAre(1, 1));
}

TEST(LabelNodes, AgreeWithEveryVoxelInTurnInATurnedImage) {
  LabelImage turned = image();
  const double c = std::cos(0.4), s = std::sin(0.4);
  turned.grid.axis = {{{2 * c, 2 * s, 0}, {-3 * s, 3 * c, 0}, {0, 0, -5}}};
  turned.grid.origin = {20, -30, 40};
  std::vector<std::array<double, 3>> points;
  std::vector<char> expected;
  const double distance = 2.7;
  for (int n = 0; n < 500; ++n) {
    const double i = -2 + 0.017 * n, j = 3 * std::sin(0.7 * n), k = 2 * std::cos(0.3 * n);
    points.push_back(turned.grid.point(i, j, k));
    double least = 1e9;
    for (const double at : {1.0, 2.0})
      least = std::min(least, std::hypot(2 * std::max(std::abs(i - at) - 0.5, 0.0),
                                         3 * std::max(std::abs(j) - 0.5, 0.0), 5 * std::max(std::abs(k) - 0.5, 0.0)));
    expected.push_back(least <= distance);
  }
  EXPECT_EQ(near_labels(turned, {7}, distance, points), expected);
  EXPECT_GT(std::count(expected.begin(), expected.end(), 1), 20);
  EXPECT_GT(std::count(expected.begin(), expected.end(), 0), 20);
}

// A box of 40 mm in an image of 5 x 5 x 5 voxels of 10 mm, centred at 0, 10 .. 40 mm; label 3 in the layer of least x, 4 above.
class LabelledBox : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fresh_folder();
    std::ofstream nrrd(folder_ / "labels.nrrd", std::ios::binary);
    nrrd << "NRRD0004\ntype: uint8\ndimension: 3\nspace: left-posterior-superior\nsizes: 5 5 5\n"
            "space directions: (10,0,0) (0,10,0) (0,0,10)\nspace origin: (0,0,0)\nencoding: raw\n\n";
    for (int v = 0; v < 125; ++v) nrrd.put(static_cast<char>(v % 5 == 0 ? 3 : v / 25 == 4 ? 4 : 0));
  }
  std::size_t held(double mesh_size, const LengthUnit& unit, const std::string& frame,
                   const std::filesystem::path& image) {
    TetrahedralMesh mesh = box_mesh({4, 4, 4}, {mesh_size, mesh_size, mesh_size});
    if (frame == "RAS")
      for (auto& p : mesh.nodes) p[0] -= mesh_size, p[1] -= mesh_size;
    OrganConfig organ;
    organ.mesh_unit = unit, organ.frame = frame;
    organ.regions.push_back({"box", {5400, "test"}, {0.3, "test"}, {}});
    BoundaryConfig boundary;
    boundary.fixed.push_back({{true, true, true}, {selector_}, 1});
    const ElasticBody body = make_elastic_body(mesh, organ, boundary, {"box.msh", "organ.toml", "bc.toml", image});
    std::size_t count = 0;
    for (const auto& fixed : body.fixed) count += fixed[0];
    return count;
  }
  std::string refused(const std::filesystem::path& image) {
    return input_error([&] { held(40, {"mm", 1e-3}, "LPS", image); });
  }
  std::filesystem::path folder_;
  Selector selector_ = {.kind = Selector::Kind::label, .labels = {3}, .line = 5};
};

TEST_F(LabelledBox, IsHeldWhereTheLabelIsInAnyUnitAndFrame) {
  const auto image = folder_ / "labels.nrrd";
  EXPECT_EQ(held(40, {"mm", 1e-3}, "LPS", image), 25u);
  EXPECT_EQ(held(0.04, {"m", 1}, "none", image), 25u);
  selector_.number = 5;                                           // the layer ends at 5 mm: the nodes at 0 and at 10 mm
  EXPECT_EQ(held(40, {"mm", 1e-3}, "LPS", image), 25u + 25 - 9);  // 9 of the second layer are inside
  selector_.number = 0.005;
  EXPECT_EQ(held(0.04, {"m", 1}, "LPS", image), 25u + 25 - 9);
  // In RAS, x from -40 to 0 is from the left to the right: the layer of least x in LPS is the one of largest x.
  selector_.number = 0;
  EXPECT_EQ(held(40, {"mm", 1e-3}, "RAS", image), 25u);
  selector_.labels = {3, 4};
  EXPECT_EQ(held(40, {"mm", 1e-3}, "LPS", image), 25u + 20);
}

TEST_F(LabelledBox, TakesTheSelectorsOwnImageFirst) {
  selector_.image = {"labels.nrrd", folder_ / "labels.nrrd"};
  EXPECT_EQ(held(40, {"mm", 1e-3}, "LPS", "/no/such/image.nrrd"), 25u);
}

TEST_F(LabelledBox, RefusalsNameFileLineAndWhatTheImageHas) {
  EXPECT_THAT(refused(""), HasSubstr("bc.toml:5: label: "));
  EXPECT_THAT(refused(folder_ / "none.nrrd"), HasSubstr("bc.toml:5: label: " + (folder_ / "none.nrrd").string()));
  selector_.labels = {3, 12};
  EXPECT_THAT(refused(folder_ / "labels.nrrd"), HasSubstr("label 12 "));
}

}  // namespace
}  // namespace palpate::tests
