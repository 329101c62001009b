// A surface against itself: palpate_scene_crossings finds the pairs of triangles that all pairs and exact signs find, and no others.
#include <palpate/palpate_complete.h>

#include <cmath>
#include <limits>
#include <random>

#include "tests/runtime/large/large_scene.h"
#include "tests/runtime/touched_box.h"
#include "tests/support/crossed_triangles.h"
#include "tests/support/grid_body.h"

namespace palpate::tests {
namespace {

using Eigen::Vector3d;

// A slab of 600 surface nodes and 1,200 triangles, 120 x 30 x 12 mm.
const TouchedBody& slab() {
  static const TouchedBody shared([] {
    GridBody grid;
    grid.lines = {grid_lines(0, 0.12, 24), grid_lines(0, 0.03, 6), grid_lines(0, 0.012, 3)};
    return dense_grid(grid);
  }());
  return shared;
}

SceneDef crossings_def(std::int32_t calls = 1, std::int32_t operations = 1'000'000'000) {
  SceneDef def = unlimited_def();
  def.crossings.crossings = PALPATE_CROSSINGS_ON;
  def.crossings.crossings_calls = calls, def.crossings.crossings_operations = operations;
  return def;
}

struct Told {
  palpate_step_flags flags = 0;
  palpate_crossings_out out = palpate_default_crossings_out();
  std::vector<palpate_crossing> found;
};

palpate_shape_out shape_of(std::vector<float>& positions) {
  palpate_shape_out shape = palpate_default_shape_out();
  shape.positions = positions.data(), shape.node_capacity = static_cast<std::int32_t>(positions.size() / 3);
  shape.node_count = shape.node_capacity;
  return shape;
}

Told ask(palpate_scene* scene, std::vector<float> positions, std::int32_t capacity = 64) {
  Told told;
  told.found.resize(static_cast<std::size_t>(capacity));
  told.out.capacity = capacity, told.out.crossings = told.found.data();
  const palpate_shape_out shape = shape_of(positions);
  told.flags = palpate_scene_crossings(scene, &shape, &told.out);
  told.found.resize(static_cast<std::size_t>(told.out.count));
  return told;
}

std::vector<float> moved(const TouchedBody& body, const std::function<Vector3d(Vector3d)>& way) {
  std::vector<float> positions;
  for (std::int32_t n = 0; n < body.body.surface_nodes; ++n) {
    const Vector3d p = way(body.node(n));
    for (int d = 0; d < 3; ++d) positions.push_back(static_cast<float>(p[d]));
  }
  return positions;
}

// Bends the slab round: `turn` radians over its length. Beyond a full turn its ends lie in one another.
std::vector<float> bent(double turn, double twist = 0) {
  return moved(slab(), [=](Vector3d p) {
    const double radius = 0.12 / turn, angle = p[0] / radius, out = radius - p[2];
    return Vector3d(out * std::sin(angle), p[1] + twist * p[0], radius - out * std::cos(angle));
  });
}

TEST(Crossings, OfASlabThatIsBentRoundAreThoseOfAllPairs) {
  const ScenePointer scene = slab().scene(crossings_def());
  std::size_t crossed = 0;
  for (const double turn : {0.5, 3.0, 6.0, 6.2, 6.5, 7.0, 9.0})
    for (const double twist : {0.0, 0.05, 0.2}) {
      const std::vector<float> positions = bent(turn, twist);
      const auto truth = crossed_triangles(positions, slab().body.triangles);
      const Told told = ask(scene.get(), positions);
      ASSERT_EQ(told.out.pairs, static_cast<std::int32_t>(truth.size())) << turn << " rad, " << twist;
      EXPECT_EQ(told.flags, truth.empty() ? 0u : palpate_step_flags{PALPATE_STEP_SURFACE_CROSSES});
      EXPECT_EQ(told.out.count, std::min(told.out.pairs, 64));
      for (const palpate_crossing& each : told.found) EXPECT_TRUE(truth.contains({each.triangle[0], each.triangle[1]}));
      crossed += truth.empty() ? 0 : 1;
    }
  EXPECT_GT(crossed, 3u);
  EXPECT_LT(crossed, 21u) << "some are not bent so far";
}

// Of p: its weights of the corners 1 and 2, and m from the triangle's plane.
Vector3d place_in(const Vector3d& p, const Vector3d corner[3]) {
  Eigen::Matrix3d edges;
  edges << corner[1] - corner[0], corner[2] - corner[0],
      (corner[1] - corner[0]).cross(corner[2] - corner[0]).normalized();
  return edges.inverse() * (p - corner[0]);
}

TEST(Crossings, HaveTheirPlaceOnBothTrianglesNowAndAtRest) {
  const ScenePointer scene = slab().scene(crossings_def());
  const std::vector<float> positions = bent(6.7, 0.1);
  const Told told = ask(scene.get(), positions);
  ASSERT_GT(told.found.size(), 10u);
  for (const palpate_crossing& each : told.found)
    for (int side = 0; side < 2; ++side) {
      Vector3d now[3], rest[3];
      for (int v = 0; v < 3; ++v) {
        const std::int32_t node = slab().body.triangles[each.triangle[side]][v];
        now[v] = Eigen::Map<const Eigen::Vector3f>(&positions[3 * node]).cast<double>(), rest[v] = slab().node(node);
      }
      const Vector3d k = place_in(Vector3d(each.place), now), k_rest = place_in(Vector3d(each.rest[side]), rest);
      // The rounding of doubles, at rest that of the bundle's single precision; and the same place of the triangle in both.
      EXPECT_LT(std::fabs(k[2]), 1e-12);
      EXPECT_LT(std::fabs(k_rest[2]), 1e-8);
      EXPECT_GE(std::min({k[0], k[1], 1 - k[0] - k[1]}), -1e-9);
      EXPECT_LT((k - k_rest).head<2>().norm(), 1e-5) << k.transpose() << " and " << k_rest.transpose();
    }
}

TEST(Crossings, OfRandomFoldsAreThoseOfAllPairs) {
  const TouchedBody& body = tiny_box();
  const ScenePointer scene = body.scene(crossings_def());
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  int crossed = 0;
  for (int fold = 0; fold < 300; ++fold) {
    // Waves of 20 to 60 mm and, each third time, vertices that move alone, so that neighbours fold over their shared vertices.
    Eigen::Matrix3d wave, way;
    for (int i = 0; i < 9; ++i) wave(i) = 60 * normal(random), way(i) = 0.02 * normal(random);
    const double alone = fold % 3 == 0 ? 0.01 : 0;
    const std::vector<float> positions = moved(body, [&](Vector3d p) {
      const Vector3d jitter(normal(random), normal(random), normal(random));
      return Vector3d(p + way * (wave * p).array().sin().matrix() + alone * jitter);
    });
    const auto truth = crossed_triangles(positions, body.body.triangles);
    const Told told = ask(scene.get(), positions);
    ASSERT_EQ(told.out.pairs, static_cast<std::int32_t>(truth.size())) << fold;
    crossed += !truth.empty();
  }
  EXPECT_GT(crossed, 100);
  EXPECT_LT(crossed, 300);
}

TEST(Crossings, AreNoneOnABodyThatIsOnlyTouched) {
  for (const palpate_deformation_model deformation : {PALPATE_DEFORMATION_LINEAR, PALPATE_DEFORMATION_LARGE}) {
    const TouchedBody body = large_body(false);
    SceneDef def = crossings_def();
    if (deformation != PALPATE_DEFORMATION_LINEAR)
      def = large_def(PALPATE_CONTACT_PATCH), def.crossings = crossings_def().crossings;
    def.collision = PALPATE_COLLISION_DEFORMED, def.large.deformation = deformation;
    TouchedScene scene(body, def);
    std::mt19937_64 random(11);
    std::uniform_real_distribution<double> uniform(0.2, 0.8);
    std::vector<float> positions(3 * static_cast<std::size_t>(body.body.surface_nodes));
    palpate_shape_out shape = shape_of(positions);
    double deepest = 0;
    for (int press = 0; press < 20; ++press) {
      const Vector3d top(0.06 * uniform(random), 0.05 * uniform(random), 0.041);
      const double depth = 0.004 * uniform(random);
      for (int s = 0; s < 20; ++s) {
        scene.press(top - Vector3d(0, 0, 0.001 + depth * s / 19), 0.005, 0.3);
        palpate_scene_shape(scene.get(), scene.contacts, &shape);
        const auto truth = crossed_triangles(positions, body.body.triangles);
        EXPECT_EQ(ask(scene.get(), positions).out.pairs, static_cast<std::int32_t>(truth.size()));
        EXPECT_TRUE(truth.empty()) << press << ", step " << s;
      }
      deepest = std::max(deepest, depth);
      scene.touch();
    }
    EXPECT_GT(deepest, 0.002);
  }
}

TEST(Crossings, OfSurfacesThatTouchAreNone) {
  // Both ends of the slab in one plane: their faces lie on one another, with the same vertices.
  const ScenePointer scene = slab().scene(crossings_def());
  const std::vector<float> flat = moved(slab(), [](Vector3d p) { return Vector3d(p[0], p[1], 0); });
  EXPECT_EQ(ask(scene.get(), flat).out.pairs, 0);
  EXPECT_EQ(ask(scene.get(), moved(slab(), [](Vector3d) { return Vector3d(0.01, 0.02, 0.03); })).out.pairs, 0);
}

TEST(Crossings, AreSpreadOverCallsAndBelongToOneShape) {
  constexpr std::int32_t kCalls = 50, kOperations = 3000;
  const ScenePointer scene = slab().scene(crossings_def(kCalls, kOperations));
  const std::vector<float> crossed = bent(6.7), apart = bent(3);
  const auto truth = crossed_triangles(crossed, slab().body.triangles);
  // The first check begins with the first call, and knows its shape alone.
  Told told = ask(scene.get(), crossed);
  EXPECT_EQ(told.out.checks, 0u) << "so much does not fit into a call";
  EXPECT_EQ(told.flags, 0u) << "nothing is known yet";
  int calls = 1;
  for (; told.out.checks == 0 && calls < 100000; ++calls) told = ask(scene.get(), apart);
  EXPECT_GT(calls, 3);
  EXPECT_EQ(told.out.pairs, static_cast<std::int32_t>(truth.size()));
  EXPECT_EQ(told.flags, PALPATE_STEP_SURFACE_CROSSES);
  // It stays told until the next one ends, which begins kCalls calls after the first one, or where that has ended.
  const int second = std::max(calls, static_cast<int>(kCalls));
  for (; told.out.checks == 1 && calls < 100000; ++calls) {
    EXPECT_EQ(told.flags, PALPATE_STEP_SURFACE_CROSSES);
    told = ask(scene.get(), apart);
  }
  EXPECT_GT(calls, second);
  EXPECT_EQ(told.flags, 0u);
  EXPECT_EQ(told.out.pairs, 0);
}

TEST(Crossings, OfAShapeThatIsNotFiniteAreNotAsked) {
  const ScenePointer scene = slab().scene(crossings_def());
  std::vector<float> positions = bent(6.7);
  positions[100] = std::numeric_limits<float>::quiet_NaN();
  const Told told = ask(scene.get(), positions);
  EXPECT_EQ(told.flags, PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(told.out.checks, 0u);
  EXPECT_EQ(ask(scene.get(), bent(6.7)).flags, PALPATE_STEP_SURFACE_CROSSES) << "the next shape is checked";
}

TEST(Crossings, NeedTheirEffectAShapeAndRoom) {
  const ScenePointer without = slab().scene(unlimited_def());
  std::vector<float> positions = bent(6.7);
  EXPECT_EQ(ask(without.get(), positions).flags, PALPATE_STEP_BAD_INPUT);
  const ScenePointer scene = slab().scene(crossings_def());
  palpate_shape_out shape = shape_of(positions);
  EXPECT_EQ(palpate_scene_crossings(scene.get(), nullptr, nullptr), PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(palpate_scene_crossings(nullptr, &shape, nullptr), PALPATE_STEP_BAD_INPUT);
  shape.node_count -= 1;
  EXPECT_EQ(palpate_scene_crossings(scene.get(), &shape, nullptr), PALPATE_STEP_BAD_INPUT);
  shape.node_count += 1, shape.positions = nullptr;
  EXPECT_EQ(palpate_scene_crossings(scene.get(), &shape, nullptr), PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(ask(scene.get(), positions, 1).out.count, 1);
  EXPECT_GT(ask(scene.get(), positions, 1).out.pairs, 1);
  SceneDef forces_alone = crossings_def();
  forces_alone.shape = PALPATE_SHAPE_OFF;
  palpate_scene* refused = nullptr;
  palpate_error error = {};
  EXPECT_EQ(palpate_scene_create(slab().bundle(), &forces_alone, &refused, &error), PALPATE_ERROR_ARGUMENT);
  EXPECT_NE(std::string(error.text).find("shape"), std::string::npos) << error.text;
}

}  // namespace
}  // namespace palpate::tests
