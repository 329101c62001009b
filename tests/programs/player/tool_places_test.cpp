// Tools that are placed by what a person knows: in front, or near a point.
#include "programs/player/tool_places.h"

#include <gmock/gmock.h>

#include "programs/player/player.h"
#include "tests/support/test_files.h"
#include "tests/support/texts.h"
#include "tests/support/tiny_bundle.h"

namespace palpate {
namespace {

using namespace tests;
using testing::HasSubstr;
using Vector = SceneConfig::Vector;
using At = SceneConfig::Place::At;

// The box of 60 x 50 x 40 mm in 3 x 3 x 3 cells, held at x = 0, in a frame of the test's choice.
class ToolPlace : public testing::Test {
 protected:
  std::filesystem::path box_in(const std::string& frame) {
    BundleParts parts = tiny_bundle();
    const std::string none = R"("frame":"none")";
    parts.provenance.replace(parts.provenance.find(none), none.size(), R"("frame":")" + frame + '"');
    write_bundle(folder_ / "box.h5", parts);
    return folder_ / "box.h5";
  }

  SurfacePlace place(const SceneConfig::Place& where, const std::string& frame = "LPS") {
    palpate_bundle* bundle = nullptr;
    EXPECT_EQ(palpate_bundle_open_file(box_in(frame).c_str(), nullptr, &bundle, nullptr), PALPATE_OK);
    const std::unique_ptr<palpate_bundle, void (*)(palpate_bundle*)> open(bundle, palpate_bundle_close);
    SceneConfig::Tool tool;
    tool.name = "finger", tool.line = 4, tool.place = where;
    return find_place(tool, bundle, "scene.toml");
  }

  void expect_refused(const SceneConfig::Place& where, const std::string& frame, const std::string& part) {
    EXPECT_THAT(input_error([&] { place(where, frame); }), HasSubstr("scene.toml:4: tool \"finger\": " + part));
  }

  const std::filesystem::path folder_ = fresh_folder();
};

void expect_vector(const Vector& found, const Vector& expected) {
  for (int d = 0; d < 3; ++d) EXPECT_NEAR(found[d], expected[d], 1e-12) << d;
}

SceneConfig::Place at(At where) {
  return {where, {}, {}};
}
SceneConfig::Place near(const Vector& point) {
  return {{}, point, {}};
}

TEST_F(ToolPlace, ForemostIsAtTheFrontOfThePatientWithTheNormalOutward) {
  // LPS: y grows to the back, so the front face is y = 0; RAS: it is y = 50 mm.
  const SurfacePlace lps = place(at(At::foremost), "LPS"), ras = place(at(At::foremost), "RAS");
  EXPECT_NEAR(lps.point[1], 0, 1e-12);
  expect_vector(lps.normal, {0, -1, 0});
  EXPECT_NEAR(ras.point[1], 0.05, 1e-12);
  expect_vector(ras.normal, {0, 1, 0});
}

TEST_F(ToolPlace, EachWordMeansASideOfThePatient) {
  EXPECT_NEAR(place(at(At::hindmost)).point[1], 0.05, 1e-12);
  EXPECT_NEAR(place(at(At::leftmost)).point[0], 0.06, 1e-12);
  EXPECT_NEAR(place(at(At::uppermost)).point[2], 0.04, 1e-12);
  EXPECT_NEAR(place(at(At::lowest)).point[2], 0, 1e-12);
  EXPECT_NEAR(place(at(At::leftmost), "RAS").point[0], 0.04, 1e-12);  // away from x = 0, which is held
}

TEST_F(ToolPlace, KeepsAwayFromTheHeldNodes) {
  // x = 0 is held, and a node at x = 20 mm has an untouchable one beside it: the first without is at x = 40 mm.
  EXPECT_NEAR(place(at(At::rightmost)).point[0], 0.04, 1e-12);
}

TEST_F(ToolPlace, NearIsTheNearestPointOfTheSurfaceNotANode) {
  const SurfacePlace top = place(near({0.041, 0.026, 0.055}));
  expect_vector(top.point, {0.041, 0.026, 0.04});
  EXPECT_GT(top.normal[2], 0.7);
  // In front of the held face the nearest touchable point is on the border of the triangles that are touchable.
  EXPECT_NEAR(place(near({-0.01, 0.025, 0.0})).point[0], 0.02, 1e-12);
}

TEST_F(ToolPlace, IsRefusedWhereNothingSaysWhereTheFrontIs) {
  expect_refused(at(At::foremost), "none", "at: ");
}

TEST_F(ToolPlace, IsRefusedFarFromTheOrganInTheWrongUnit) {
  expect_refused(near({41, 26, 55}), "LPS", "near: ");
}

TEST_F(ToolPlace, IsRefusedOnAPartThatIsHeldRatherThanMovedToAnotherPart) {
  // The box in 6 x 3 x 3 cells, whose left half is held: the nearest place that can be touched is 40 mm away.
  DenseBody body = dense_box({.cells = {6, 3, 3}});
  for (std::size_t n = 0; n < body.body.mesh.nodes.size(); ++n)
    if (body.body.mesh.nodes[n][0] < 0.035) std::fill_n(body.fixed.begin() + 3 * static_cast<std::ptrdiff_t>(n), 3, 1);
  write_bundle(folder_ / "half.h5", dense_bundle(body));
  palpate_bundle* bundle = nullptr;
  ASSERT_EQ(palpate_bundle_open_file((folder_ / "half.h5").c_str(), nullptr, &bundle, nullptr), PALPATE_OK);
  const std::unique_ptr<palpate_bundle, void (*)(palpate_bundle*)> open(bundle, palpate_bundle_close);
  const PlaceFinder finder(bundle, PlaceFinder::Where::touchable);
  EXPECT_THAT(input_error([&] { finder.nearest({-0.005, 0.025, 0.02}, "near"); }), HasSubstr("found [0, 25, 20] mm"));
  // Beside the border the triangles with a held corner cannot be touched, and the place is the nearest one that can.
  EXPECT_NEAR(finder.nearest({0.036, 0.025, 0.045}, "near").point[0], 0.04,
              0.002);  // nodes are off a grid by a tenth of a cell
}

TEST_F(ToolPlace, MakesThePathOfDepthsAlongTheNormal) {
  const std::filesystem::path scene = folder_ / "scene.toml";
  std::ofstream(scene) << "name = \"press\"\nunit = \"mm\"\n[[tool]]\nname = \"finger\"\npoints = [[0, 0, 0]]\n"
                          "at = \"foremost\"\ndepth = [[0, -10], [1, 4]]\n";
  Player player(read_scene_config(scene), box_in("LPS"));
  EXPECT_DOUBLE_EQ(player.duration(), 1);
  const auto& path = player.scene().tools[0].path;
  EXPECT_NEAR(path[0].position[1], -0.010, 1e-12);
  EXPECT_NEAR(path[1].position[1], 0.004, 1e-12);
  EXPECT_EQ(path[0].position[0], path[1].position[0]);
  double pushed = 0;
  player.play([&](const TouchRecord& touch) { pushed = palpate_contacts_tool(&touch.contacts, 0)->force[1]; }, {});
  EXPECT_LT(pushed, -0.01);  // N; the organ pushes the tool to the front
}

}  // namespace
}  // namespace palpate
