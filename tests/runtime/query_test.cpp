// Rays, nearest points, distances and normals against every triangle of bodies at rest, pressed and opened.
#include <random>
#include <thread>

#include "tests/runtime/asked_scene.h"
#include "tests/runtime/played_box.h"
#include "tests/support/deformed_truth.h"
#include "tests/support/grid_body.h"

namespace palpate::tests {
namespace {

// m: the reference reads displacements of up to 10 mm that were summed in single precision.
constexpr double kStored = 1e-7;

SceneDef query_def() {
  return unlimited_def(PALPATE_CONTACT_POINT, PALPATE_QUERIES_ON);
}

// A scene under contacts, and its surface as the reference sees it.
struct Queried : TouchedScene {
  explicit Queried(const TouchedBody& touched, const SceneDef& def = query_def())
      : TouchedScene(touched, def), body(touched), truth(body.body) {}

  void touch(const std::vector<palpate_grip>& grips) {
    hold(grips);
    truth.move(shape());
  }
  palpate_surface_hit ray(const Eigen::Vector3d& origin, const Eigen::Vector3d& along, double longest = INFINITY) {
    palpate_surface_hit hit = palpate_default_surface_hit();
    flags = palpate_scene_cast_ray(scene.get(), contacts, origin.data(), along.data(), longest, &hit);
    return hit;
  }
  palpate_surface_hit closest(const Eigen::Vector3d& p, double farthest = INFINITY) {
    palpate_surface_hit hit = palpate_default_surface_hit();
    flags = palpate_scene_closest_point(scene.get(), contacts, p.data(), farthest, &hit);
    return hit;
  }
  double distance(const Eigen::Vector3d& p) {
    double distance = NAN;
    flags = palpate_scene_signed_distance(scene.get(), contacts, p.data(), &distance);
    return distance;
  }

  const TouchedBody& body;
  DeformedTruth truth;
};

Eigen::Vector3d vector(const double* x) {
  return Eigen::Vector3d(x);
}

struct Random {
  std::mt19937 engine{7};
  double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine); }
  Eigen::Vector3d in(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
    return {between(low[0], high[0]), between(low[1], high[1]), between(low[2], high[2])};
  }
  Eigen::Vector3d direction() { return in(Eigen::Vector3d::Constant(-1), Eigen::Vector3d::Constant(1)); }
};

struct Bounds {
  explicit Bounds(const TouchedBody& body) : low(body.node(0)), high(low) {
    for (std::int32_t n = 0; n < body.body.surface_nodes; ++n)
      low = low.cwiseMin(body.node(n)), high = high.cwiseMax(body.node(n));
  }
  Eigen::Vector3d low, high;
};

// What the hit says must be true of the triangle that it names.
void expect_on_surface(const palpate_surface_hit& hit, const DeformedTruth& truth) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double weights = 0;
  for (int v = 0; v < 3; ++v) {
    sum += hit.barycentric[v] * truth.corner(hit.triangle, v), weights += hit.barycentric[v];
    EXPECT_GE(hit.barycentric[v], -1e-12);
  }
  EXPECT_NEAR(weights, 1, 1e-12);
  EXPECT_LT((sum - vector(hit.point)).norm(), 2 * kStored);
  // Triangles are millimetres large, so corners that are off by kStored turn the normal by about 1e-4.
  EXPECT_LT((vector(hit.normal) - truth.outward(hit.triangle)).norm(), 2e-4);
}

struct Counts {
  int rays = 0, hits = 0, left = 0, inside = 0, near = 0;
};

void ask_at_random(Queried& queried, Random& random, int times, Counts* counts) {
  const Bounds box(queried.body);
  const Eigen::Vector3d size = box.high - box.low;
  for (int i = 0; i < times; ++i) {
    const Eigen::Vector3d p = random.in(box.low - 0.4 * size, box.high + 0.4 * size);
    const Eigen::Vector3d along = random.direction().normalized();
    const double longest = i % 3 == 0 ? INFINITY : random.between(0.001, 0.08);
    const palpate_surface_hit met = queried.ray(p, 3.7 * along, longest);
    ASSERT_EQ(queried.flags, 0u);
    const DeformedTruth::Crossing first = queried.truth.first_crossing(p, along, longest);
    // The reference decides edges and the ray's end by rounding, the query exactly.
    const double doubtful = kStored / std::max(1e-3, std::abs(first.slope));
    ++counts->rays, counts->hits += met.hit, counts->left += met.hit && vector(met.normal).dot(along) > 0;
    ASSERT_EQ(met.hit, first.triangle >= 0) << i;
    if (met.hit) {
      EXPECT_NEAR(met.distance, first.distance, doubtful) << i;
      EXPECT_LT((p + met.distance * along - vector(met.point)).norm(), 1e-12);
      expect_on_surface(met, queried.truth);
    }
    const double expected = queried.truth.signed_distance(p), distance = queried.distance(p);
    ASSERT_EQ(queried.flags, 0u);
    EXPECT_NEAR(distance, expected, kStored) << i;
    counts->inside += distance < 0;
    const double farthest = i % 2 == 0 ? INFINITY : random.between(0.0005, 0.01);
    const palpate_surface_hit near = queried.closest(p, farthest);
    ASSERT_EQ(near.hit, std::abs(expected) < farthest) << i;
    counts->near += near.hit;
    if (near.hit) {
      EXPECT_EQ(near.distance, std::abs(distance)) << i;
      EXPECT_NEAR((p - vector(near.point)).norm(), near.distance, 1e-12) << i;
      expect_on_surface(near, queried.truth);
    }
  }
}

TEST(Query, AgreesWithEveryTriangleAtRestPressedAndOpened) {
  const TouchedBody block(slotted_block()), slab(clamped_slab());
  const TouchedBox box({.cells = {5, 4, 3}});
  Random random;
  Counts counts;
  for (const TouchedBody* body : {&block, &slab, static_cast<const TouchedBody*>(&box)}) {
    Queried queried(*body);
    queried.touch({});
    ask_at_random(queried, random, 150, &counts);
    std::vector<std::int32_t> nodes = body->touchable;
    for (int scene = 0; scene < 12; ++scene) {
      // The rim of the slot and random nodes, drawn by up to 8 mm; some grips stay as they were and some are new.
      std::shuffle(nodes.begin() + 2, nodes.end(), random.engine);
      std::vector<palpate_grip> grips;
      for (int g = 0; g < 1 + scene % 6; ++g) grips.push_back(grip_at_node(nodes[g], .008 * random.direction()));
      queried.touch(grips);
      ask_at_random(queried, random, 60, &counts);
    }
  }
  EXPECT_GT(counts.hits, counts.rays / 4);
  EXPECT_GT(counts.left, 100);
  EXPECT_GT(counts.inside, 100);
  EXPECT_GT(counts.near, 500);
}

TEST(Query, SeesAnOpenedGapAsAir) {
  const TouchedBody block(slotted_block());
  Queried queried(block);
  std::vector<palpate_grip> rim;
  for (const std::int32_t n : block.touchable)
    if (std::abs(block.node(n)[0] - .030) < 1e-9 && std::abs(block.node(n)[2] - .050) < 1e-9)
      rim.push_back(grip_at_node(n, {-.010, 0, 0}));
  ASSERT_EQ(rim.size(), 4u);
  const Eigen::Vector3d p(.026, .015, .048);  // in the wall at rest, in the gap once it is drawn back
  EXPECT_LT(queried.distance(p), -.001);
  queried.touch(rim);
  EXPECT_GT(queried.distance(p), .001);
  const palpate_surface_hit down = queried.ray(p, {0, 0, -1});
  ASSERT_TRUE(down.hit);
  EXPECT_GT(down.distance, .010);  // far below, where the wall still stands or on the bottom of the slot
  // Contacts NULL: the surface at rest, whatever was asked before.
  double distance = 0;
  EXPECT_EQ(palpate_scene_signed_distance(queried.scene.get(), nullptr, p.data(), &distance), 0u);
  EXPECT_NEAR(distance, -.002, 1e-12);
  EXPECT_GT(queried.distance(p), .001);
}

TEST(Query, ReadsEveryStoredForm) {
  const auto in_blocks = [](BundleParts& parts) { store_in_blocks(parts, {}); };
  for (const auto& store :
       {std::function<void(BundleParts&)>(store_as_f64), std::function<void(BundleParts&)>(store_as_f16),
        std::function<void(BundleParts&)>(in_blocks)}) {
    const TouchedBox box({.cells = {5, 4, 3}, .interior = false}, store);
    Queried queried(box);
    Random random;
    Counts counts;
    for (int scene = 0; scene < 4; ++scene) {
      std::vector<palpate_grip> grips;
      for (int g = 0; g <= scene; ++g)
        grips.push_back(grip_at_node(box.touchable[(7 * g + scene) % box.touchable.size()], .006 * random.direction()));
      queried.touch(grips);
      ask_at_random(queried, random, 50, &counts);
    }
    EXPECT_GT(counts.hits, 30);
  }
}

TEST(Query, RayThroughAnEdgeOrAVertexPassesThroughNoGap) {
  const TouchedBox box({.cells = {6, 5, 4}});
  Queried queried(box);
  for (const bool pressed : {false, true}) {
    if (pressed) queried.touch({grip_at_node(box.touchable[3], {.004, .001, -.002})});
    // From an inner place through every vertex and every edge's middle: the body is seen from there as a star or nearly so.
    const Eigen::Vector3d inner(.0301, .0252, .0197);
    for (std::size_t f = 0; f < box.body.triangles.size(); ++f)
      for (int v = 0; v < 3; ++v) {
        const Eigen::Vector3d a = queried.truth.corner(f, v), b = queried.truth.corner(f, (v + 1) % 3);
        for (const Eigen::Vector3d& to : {a, Eigen::Vector3d(0.5 * (a + b))}) {
          const palpate_surface_hit hit = queried.ray(inner, to - inner);
          ASSERT_TRUE(hit.hit) << f;
          EXPECT_GT(vector(hit.normal).dot(to - inner), 0);
          EXPECT_NEAR(hit.distance, (to - inner).norm(), pressed ? 1e-5 : 1e-12);
        }
      }
    // Along the grid's own lines from outside: through vertices, edges and within planes of triangles.
    for (int i = 0; i <= 6; ++i)
      for (int j = 0; j <= 5; ++j) {
        const Eigen::Vector3d from(.01 * i, .01 * j, .1);
        const palpate_surface_hit hit = queried.ray(from, {0, 0, -1});
        if (!pressed && i > 0 && i < 6 && j > 0 && j < 5) {
          ASSERT_TRUE(hit.hit);
          EXPECT_NEAR(hit.distance, .06, 1e-12);
          EXPECT_GT(hit.normal[2], .99);
        }
      }
  }
}

TEST(Query, DefinesWhatBadAndDegenerateInputGives) {
  const TouchedBox box;
  Queried queried(box);
  const Eigen::Vector3d p(.03, .02, .06), down(0, 0, -1);
  const auto expect_refused = [&](const palpate_surface_hit& hit) {
    EXPECT_EQ(queried.flags, PALPATE_STEP_BAD_INPUT);
    EXPECT_EQ(hit.hit, 0);
    EXPECT_EQ(hit.triangle, -1);
    EXPECT_EQ(hit.distance, 0);
    EXPECT_EQ(hit.struct_bytes, sizeof hit);
  };
  for (const double bad : {double(NAN), double(INFINITY), 1e7}) {
    expect_refused(queried.ray({bad, 0, 0}, down));
    expect_refused(queried.closest({0, bad, 0}));
    EXPECT_EQ(queried.distance({0, 0, bad}), INFINITY);
    EXPECT_EQ(queried.flags, PALPATE_STEP_BAD_INPUT);
  }
  expect_refused(queried.ray(p, {0, 0, 0}));
  expect_refused(queried.ray(p, {0, 1e-200, 0}));
  expect_refused(queried.ray(p, {0, NAN, 0}));
  expect_refused(queried.ray(p, {0, INFINITY, 0}));
  for (const double bad : {0.0, -1.0, double(NAN)}) {
    expect_refused(queried.ray(p, down, bad));
    expect_refused(queried.closest(p, bad));
  }
  // NULL and damaged arguments.
  palpate_surface_hit hit = palpate_default_surface_hit();
  palpate_scene* scene = queried.scene.get();
  EXPECT_EQ(palpate_scene_cast_ray(scene, nullptr, nullptr, down.data(), 1, &hit), PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(palpate_scene_cast_ray(scene, nullptr, p.data(), nullptr, 1, &hit), PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(palpate_scene_cast_ray(scene, nullptr, p.data(), down.data(), 1, nullptr), PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(palpate_scene_cast_ray(nullptr, nullptr, p.data(), down.data(), 1, &hit), PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(palpate_scene_closest_point(scene, nullptr, nullptr, 1, &hit), PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(palpate_scene_signed_distance(scene, nullptr, p.data(), nullptr), PALPATE_STEP_BAD_INPUT);
  for (const std::uint32_t bytes : {0u, 8u, 12u, 0xffffffffu}) {
    hit.struct_bytes = bytes;
    EXPECT_EQ(palpate_scene_cast_ray(scene, nullptr, p.data(), down.data(), 1, &hit), PALPATE_STEP_BAD_INPUT);
    EXPECT_EQ(hit.struct_bytes, bytes);
  }
  const ScenePointer other = box.scene(with(query_def(), PALPATE_QUERIES_OFF));
  hit = palpate_default_surface_hit();
  EXPECT_EQ(palpate_scene_cast_ray(other.get(), nullptr, p.data(), down.data(), 1, &hit), PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(hit.hit, 0);
  // Contacts that are damaged or of another bundle: the surface at rest, and a flag.
  queried.touch({grip_at_node(box.touchable[3], {.004, .001, -.002})});
  const double at_rest = .02;
  queried.contacts->node_count = 1 << 20;
  EXPECT_NEAR(queried.ray(p, down).distance, at_rest, 1e-12);
  EXPECT_EQ(queried.flags, PALPATE_STEP_BAD_INPUT);
  queried.touch({grip_at_node(box.touchable[3], {.004, .001, -.002})});
  queried.contacts->bundle ^= 1;
  EXPECT_NEAR(queried.ray(p, down).distance, at_rest, 1e-12);
  EXPECT_EQ(queried.flags, PALPATE_STEP_OTHER_BUNDLE);
  queried.touch({grip_at_node(box.touchable[3], {.004, .001, -.002})});
  const_cast<palpate_contact_node*>(queried.contacts.nodes())->modified_displacement[1] = NAN;
  EXPECT_TRUE(queried.ray(p, down).hit);
  EXPECT_EQ(queried.flags, PALPATE_STEP_BAD_INPUT);
  // On the surface, at its end, beside it.
  queried.touch({});
  EXPECT_EQ(std::abs(queried.distance({.03, .02, .04})), 0);
  EXPECT_EQ(queried.closest({.03, .02, .04}, 1e-300).hit, 1);
  EXPECT_EQ(queried.ray(p, down, .0199).hit, 0);
  EXPECT_EQ(queried.ray(p, down, .0201).hit, 1);
  EXPECT_EQ(queried.ray(p, -down).hit, 0);
  EXPECT_EQ(queried.ray({.03, .02, 9e5}, down).hit, 1);
  EXPECT_EQ(queried.flags, 0u);
}

// The bytes of every contact of a run, with queries between its steps or without.
std::vector<std::uint64_t> bytes_of_run(const TouchedBody& body, palpate_query_model queries) {
  Queried queried(body, unlimited_def(PALPATE_COLLISION_DEFORMED, queries));
  std::vector<std::uint64_t> all;
  Random random;
  for (int s = 0; s < 200; ++s) {
    const Eigen::Vector3d p(.045 + 1e-5 * s, .013, .0131 - 2e-5 * s), q(.08, .017, .0131 - 2e-5 * s);
    const std::vector<palpate_grip> grips = {grip_at_node(body.touchable[9], {0, 0, -1e-5 * s})};
    const palpate_tool tools[3] = {tool_of(grips), point_tool(p.data(), 1, .003), point_tool(q.data())};
    queried.TouchedScene::touch(tools);
    all.insert(all.end(), queried.contacts.memory.begin(), queried.contacts.memory.end());
    if (queries == PALPATE_QUERIES_OFF) continue;
    for (int i = 0; i < 5; ++i) {
      const Eigen::Vector3d at = random.in({0, 0, -.01}, {.12, .03, .02});
      queried.ray(at, random.direction()), queried.closest(at), queried.distance(at);
      EXPECT_EQ(queried.flags, 0u);
    }
  }
  return all;
}

TEST(Query, ChangesNoBitOfAStep) {
  const TouchedBody slab(clamped_slab());
  EXPECT_EQ(bytes_of_run(slab, PALPATE_QUERIES_OFF), bytes_of_run(slab, PALPATE_QUERIES_ON));
}

TEST(Query, TakesMemoryOnlyWhereASceneAsks) {
  const TouchedBox box;
  const auto bytes = [&](palpate_query_model queries) {
    SceneDef def;
    def.queries.queries = queries, def.max_contact_nodes = 192;
    return bytes_of(def, box);
  };
  // A tree of 200 bytes for each triangle at most, and 28 bytes for each node.
  const std::size_t triangles = box.body.triangles.size(), nodes = static_cast<std::size_t>(box.body.surface_nodes);
  const std::size_t more = bytes(PALPATE_QUERIES_ON) - bytes(PALPATE_QUERIES_OFF);
  EXPECT_GT(more, 28 * nodes);
  EXPECT_LT(more, 220 * triangles + 40 * nodes + 192 * 90);
  // A scene that neither collides nor touches triangles answers queries, too.
  Queried queried(box, with(query_def(), PALPATE_COLLISION_OFF, PALPATE_CONTACT_NODE));
  EXPECT_NEAR(queried.distance({.03, .02, .06}), .02, 1e-12);
}

TEST(Query, RunsBesideTouchAndShape) {
  const TouchedBox box;
  Queried queried(box, with(query_def(), PALPATE_COLLISION_DEFORMED));
  queried.touch({grip_at_node(box.touchable[3], {.004, .001, -.002})});
  Contacts drawn(queried.scene.get()), touched(queried.scene.get());
  drawn.memory = queried.contacts.memory;
  const Eigen::Vector3d p(.055, .02, .05);
  const double expected = queried.distance(p);
  std::atomic<bool> done = false;
  std::thread touching([&] {
    while (!done) play(box, queried.scene.get(), touched, 20, [](palpate_step_flags) {});
  });
  std::thread shaping([&] {
    while (!done) displacements(queried.scene.get(), drawn, box.body.surface_nodes);
  });
  for (int i = 0; i < 2000; ++i) {
    double at_rest = 0;
    EXPECT_EQ(queried.distance(p), expected);
    palpate_scene_signed_distance(queried.scene.get(), nullptr, p.data(), &at_rest);
    EXPECT_NEAR(at_rest, .01, 1e-12);
  }
  done = true;
  touching.join(), shaping.join();
}

// ---- normals ---------------------------------------------------------------------------------------------------------

struct Shaped {
  explicit Shaped(const TouchedBody& body, palpate_scene* scene, const palpate_contacts* contacts)
      : nodes(body.body.surface_nodes), positions(3 * static_cast<std::size_t>(nodes)), normals(positions.size(), 7) {
    out = shape_out(nullptr, positions.data(), nodes);
    palpate_scene_shape(scene, contacts, &out);
    flags = palpate_scene_normals(scene, &out, normals.data(), nodes);
  }
  Eigen::Vector3d normal(std::int32_t n) const {
    return Eigen::Map<const Eigen::Vector3f>(&normals[3 * n]).cast<double>();
  }
  std::int32_t nodes;
  std::vector<float> positions, normals;
  palpate_shape_out out;
  palpate_step_flags flags = 0;
};

TEST(Normals, OfABoxDoNotDependOnItsDiagonals) {
  const TouchedBox box;
  TouchedScene scene(box, SceneDef());
  scene.touch();
  const Shaped shaped(box, scene.get(), scene.contacts);
  EXPECT_EQ(shaped.flags, 0u);
  const Eigen::Vector3d size(.06, .05, .04);
  for (std::int32_t n = 0; n < shaped.nodes; ++n) {
    // One unit for each face that the node lies on.
    Eigen::Vector3d expected = Eigen::Vector3d::Zero();
    for (int d = 0; d < 3; ++d)
      expected[d] = std::abs(box.node(n)[d]) < 1e-9 ? -1 : std::abs(box.node(n)[d] - size[d]) < 1e-9 ? 1 : 0;
    // Angles are rounded to 1e-4, positions and sums to single precision.
    EXPECT_LT((shaped.normal(n) - expected.normalized()).norm(), 3e-4) << n;
  }
}

TEST(Normals, AreTheMeanOfTheTrianglesWeightedByTheirAngles) {
  const TouchedBody block(slotted_block());
  Queried queried(block, query_def());
  queried.touch(
      {grip_at_node(block.touchable[30], {.004, .003, -.005}), grip_at_node(block.touchable[60], {0, .006, 0})});
  const Shaped shaped(block, queried.scene.get(), queried.contacts);
  EXPECT_EQ(shaped.flags, 0u);
  std::vector<Eigen::Vector3d> sum(shaped.nodes, Eigen::Vector3d::Zero());
  for (std::size_t f = 0; f < block.body.triangles.size(); ++f)
    for (int v = 0; v < 3; ++v) {
      const Eigen::Vector3d a = queried.truth.corner(f, v), u = queried.truth.corner(f, (v + 1) % 3) - a,
                            w = queried.truth.corner(f, (v + 2) % 3) - a;
      sum[block.body.triangles[f][v]] += std::acos(u.dot(w) / (u.norm() * w.norm())) * queried.truth.outward(f);
    }
  for (std::int32_t n = 0; n < shaped.nodes; ++n) EXPECT_LT((shaped.normal(n) - sum[n].normalized()).norm(), 5e-4) << n;
}

TEST(Normals, RefuseWhatTheyCannotReadAndSkipWhatIsNotFinite) {
  const TouchedBox box;
  TouchedScene scene(box, SceneDef());
  scene.touch();
  Shaped shaped(box, scene.get(), scene.contacts);
  const std::vector<float> before = shaped.normals;
  palpate_shape_out less = shaped.out;
  less.node_count = shaped.nodes - 1;
  EXPECT_EQ(palpate_scene_normals(scene.get(), &less, shaped.normals.data(), shaped.nodes), PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(palpate_scene_normals(scene.get(), &shaped.out, shaped.normals.data(), shaped.nodes - 1),
            PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(palpate_scene_normals(scene.get(), &shaped.out, nullptr, shaped.nodes), PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(palpate_scene_normals(scene.get(), nullptr, shaped.normals.data(), shaped.nodes), PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(palpate_scene_normals(box.scene(with(SceneDef(), PALPATE_COLLISION_OFF, PALPATE_CONTACT_NODE)).get(),
                                  &shaped.out, shaped.normals.data(), shaped.nodes),
            PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(shaped.normals, before);
  shaped.positions[0] = NAN;
  EXPECT_EQ(palpate_scene_normals(scene.get(), &shaped.out, shaped.normals.data(), shaped.nodes),
            PALPATE_STEP_BAD_INPUT);
  for (const float x : shaped.normals) EXPECT_TRUE(std::isfinite(x));
}

}  // namespace
}  // namespace palpate::tests
