// What searches a surface, where its triangles come, go and get other corners, against the same made anew of the triangles that are active.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>
#include <set>
#include <vector>

#include "runtime/contact/contact_patch.h"
#include "runtime/contact/surface_change.h"
#include "runtime/contact/touch.h"
#include "runtime/cut/cut_triangles.h"
#include "runtime/surface/surface_index.h"
#include "runtime/surface/surface_inside.h"
#include "runtime/surface/surface_measure.h"
#include "runtime/surface/surface_tree.h"
#include "tests/runtime/cut/cut_bodies.h"

namespace palpate::tests {
namespace {

using Numbers = std::vector<std::int32_t>;

// Half a cube, half a ball.
BodyToCut ball_to_cut(int n, std::uint64_t seed) {
  BodyToCut body = lattice_to_cut(n, n, n, 0.1, seed);
  for (std::size_t i = 0; i < body.nodes.size(); i += 3) {
    const Vec3 p = load3(&body.nodes[i]) - Vec3{0.5 * n, 0.5 * n, 0.5 * n};
    const double far = std::max({std::fabs(p.x), std::fabs(p.y), std::fabs(p.z)});
    const double scale = length(p) > 0 ? 0.5 + 0.5 * far / length(p) : 1;
    store3(scale * p, &body.nodes[i]);
  }
  return body;
}

// The triangles that a body may have, at rest.
struct Surface {
  std::vector<double> rest;
  Numbers triangles;
  std::vector<std::uint8_t> active;

  std::int32_t nodes() const { return static_cast<std::int32_t>(rest.size() / 3); }
  std::int32_t count() const { return static_cast<std::int32_t>(triangles.size() / 3); }
  Numbers active_ones() const {
    Numbers found;
    for (std::int32_t t = 0; t < count(); ++t)
      if (active[static_cast<std::size_t>(t)]) found.push_back(t);
    return found;
  }
};

// The structures over a surface. It stays where it is.
struct Searches {
  explicit Searches(const Surface& of, bool changes) : surface(of) {
    const std::uint8_t* const flags = changes ? of.active.data() : nullptr;
    EXPECT_TRUE(tree.build(memory, of.rest.data(), of.nodes(), of.triangles.data(), of.count(), flags));
    EXPECT_TRUE(index.build(memory, of.rest.data(), of.triangles.data(), of.count(), flags));
    EXPECT_TRUE(measure.build(memory, of.rest.data(), of.nodes(), of.triangles.data(), of.count(), flags));
    tree.set_reach(std::vector<double>(static_cast<std::size_t>(of.nodes()), 1.0).data());
  }
  ~Searches() { memory.release_all(); }
  Searches(const Searches&) = delete;
  Searches& operator=(const Searches&) = delete;
  void change(const Numbers& triangles) {
    const auto count = static_cast<std::int32_t>(triangles.size());
    tree.change(triangles.data(), count);
    index.change(triangles.data(), count);
    measure.change(tree.fans());
  }

  const Surface& surface;
  SceneMemory memory{palpate_allocator{}};
  SurfaceTree tree;
  SurfaceIndex index;
  SurfaceMeasure measure;
};

// A body that is cut at random, its surface, and a field in metres that moves the nodes.
struct Changing {
  explicit Changing(const BodyToCut& body, std::uint64_t seed) : play(body, 1 << 12), random(seed) {
    EXPECT_TRUE(slots.create(memory, play.mesh, body.view()));
    surface.rest = body.nodes;
    surface.rest.resize(body.nodes.size() + 3 * (1 << 12));
    moved.resize(surface.rest.size() / 3);
    inner = body.inner_faces();
    copy();
  }
  ~Changing() { memory.release_all(); }
  Changing(const Changing&) = delete;
  Changing& operator=(const Changing&) = delete;

  void copy() {
    surface.triangles.assign(slots.triangles(), slots.triangles() + 3 * slots.count());
    surface.active.assign(slots.active(), slots.active() + slots.count());
  }
  double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); }
  std::int32_t below(std::size_t count) { return static_cast<std::int32_t>(random() % count); }

  // Cuts the faces near a random plane, or removes a few tetrahedra. Returns the triangles that have changed.
  Numbers step() {
    const std::int32_t before = play.mesh.nodes();
    if (below(4) == 0) {
      Numbers tetrahedra;
      for (int i = 0; i < 3; ++i) tetrahedra.push_back(below(static_cast<std::size_t>(play.body.tetrahedron_count())));
      play.mesh.remove(tetrahedra.data(), 3);
    } else {
      Numbers faces;
      for (int i = 0; i < 12; ++i) faces.push_back(inner[static_cast<std::size_t>(below(inner.size()))]);
      play.mesh.cut(faces.data(), static_cast<std::int32_t>(faces.size()));
    }
    return take_over(before);
  }
  // What the mesh has changed since it had so many nodes.
  Numbers take_over(std::int32_t before) {
    slots.follow(play.mesh);
    for (std::int32_t n = before; n < play.mesh.nodes(); ++n) {
      store3(load3(&surface.rest[3 * static_cast<std::size_t>(play.mesh.at_rest(n))]),
             &surface.rest[3 * static_cast<std::size_t>(n)]);
      moved[static_cast<std::size_t>(n)] = moved[static_cast<std::size_t>(play.mesh.from(n))];
    }
    copy();
    return {slots.changed(), slots.changed() + slots.changed_count()};
  }
  // Moves all nodes by a common turn and each by a little.
  void move(double size) {
    const Vec3 common{between(-size, size), between(-size, size), between(-size, size)};
    double largest = 0, norm = 0;
    for (std::int32_t n = 0; n < play.mesh.nodes(); ++n) {
      const double little = 0.05 * size;
      const Vec3 by = common + Vec3{between(-little, little), between(-little, little), between(-little, little)};
      moved[static_cast<std::size_t>(n)] += by;
      largest = std::max(largest, length(by));
      norm = std::max(norm, length(moved[static_cast<std::size_t>(n)]));
    }
    bound.norm = norm, bound.path += largest;
  }
  Vec3 place(std::int32_t n) const {
    return load3(&surface.rest[3 * static_cast<std::size_t>(n)]) + moved[static_cast<std::size_t>(n)];
  }
  Vec3 corner(std::int32_t t, int v) const {
    return place(surface.triangles[3 * static_cast<std::size_t>(t) + static_cast<std::size_t>(v)]);
  }
  // In and around the body.
  Vec3 somewhere() {
    const std::int32_t n = below(static_cast<std::size_t>(play.mesh.nodes()));
    return place(n) + Vec3{between(-1, 1), between(-1, 1), between(-1, 1)};
  }

  SceneMemory memory{palpate_allocator{}};
  CutPlay play;
  CutTriangles slots;
  Surface surface;
  std::vector<Vec3> moved;  // m
  FieldBound bound;
  Numbers inner;
  std::mt19937_64 random;
};

bool same(const Vec3& a, const Vec3& b) {
  return a.x == b.x && a.y == b.y && a.z == b.z;
}

struct Found {
  Numbers visited;
  Operations work = 0;
  bool operator==(const Found&) const = default;
};

Found near_of(SurfaceIndex& index, Vec3 p, int reach) {
  Found found;
  index.near(p, reach, [&](std::int32_t t) { found.visited.push_back(t); });
  return found;
}
Found near_at_rest(const SurfaceTree& tree, Vec3 low, Vec3 high) {
  Found found;
  tree.near_at_rest(low, high, &found.work, [&](std::int32_t t) { found.visited.push_back(t); });
  return found;
}

void expect_same_answer(const NearestPoint& a, const NearestPoint& b) {
  ASSERT_EQ(a.surface_point.triangle, b.surface_point.triangle);
  ASSERT_EQ(a.distance, b.distance);
  ASSERT_EQ(a.per_path, b.per_path);
  ASSERT_EQ(a.outside, b.outside);
  for (int v = 0; v < 3; ++v) ASSERT_EQ(a.surface_point.barycentric[v], b.surface_point.barycentric[v]);
}

void expect_same_measures(const SurfaceMeasure& a, const SurfaceMeasure& b, std::int32_t nodes) {
  for (std::int32_t n = 0; n < nodes; ++n) {
    ASSERT_TRUE(same(a.outward(n), b.outward(n))) << n;
    ASSERT_EQ(a.spacing(n), b.spacing(n)) << n;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) ASSERT_EQ(a.curvature(n).m[i][j], b.curvature(n).m[i][j]) << n;
  }
}

// The same numbers, in any order, each once.
void expect_same_set(Numbers a, Numbers b) {
  std::sort(a.begin(), a.end()), std::sort(b.begin(), b.end());
  ASSERT_EQ(a, b);
}

const auto kAtRest = [](const SurfaceTree& tree) { return [&tree](std::int32_t n) { return tree.at_rest(n); }; };

// Against structures that are built of the active triangles alone.
void compare_with_new_ones(Changing& of, Searches& changed) {
  const Numbers ones = of.surface.active_ones();
  Surface alone{of.surface.rest, {}, {}};
  for (const std::int32_t t : ones)
    for (std::size_t v = 0; v < 3; ++v)
      alone.triangles.push_back(of.surface.triangles[3 * static_cast<std::size_t>(t) + v]);
  Searches fresh(alone, false);
  expect_same_measures(changed.measure, fresh.measure, alone.nodes());
  ASSERT_LE(fresh.tree.largest_fan(), changed.tree.largest_fan());
  for (std::int32_t n = 0; n < alone.nodes(); ++n) {
    Numbers around, expected;
    changed.tree.around(n, [&](std::int32_t t) { around.push_back(t); });
    fresh.tree.around(n, [&](std::int32_t t) { expected.push_back(ones[static_cast<std::size_t>(t)]); });
    ASSERT_EQ(around, expected) << n;
    ASSERT_EQ(changed.tree.fans().has(n), !expected.empty());
  }
  for (int i = 0; i < 40; ++i) {
    const std::int32_t n = of.below(static_cast<std::size_t>(of.play.mesh.nodes()));
    const Vec3 p = changed.tree.at_rest(n) + Vec3{of.between(-1, 1), of.between(-1, 1), of.between(-1, 1)};
    QueryWork work;
    const NearestPoint found = changed.tree.nearest(p, 10, {}, &work, kAtRest(changed.tree), nullptr),
                       expected = fresh.tree.nearest(p, 10, {}, &work, kAtRest(fresh.tree), nullptr);
    // Of triangles that share an edge, boxes that round decide which one gives the distance.
    ASSERT_NEAR(found.distance, expected.distance, 1e-13);
    ASSERT_TRUE(changed.tree.is_active(found.surface_point.triangle));
    // Both lips are at one distance while they lie on one another.
    if (found.surface_point.triangle == ones[static_cast<std::size_t>(expected.surface_point.triangle)]) {
      ASSERT_EQ(found.outside, expected.outside);
      ASSERT_TRUE(same(found.outward, expected.outward));
    }
    const SurfacePoint by_index = changed.index.nearest(p);
    ASSERT_TRUE(changed.index.is_active(by_index.triangle));
    ASSERT_NEAR(length(changed.index.position(by_index) - p), expected.distance, 1e-12);
    const auto inside = [&](const SurfaceTree& tree) {
      return is_inside_surface(tree, p, {}, [&](Vec3 low, Vec3 high, auto visit) {
        const_cast<SurfaceTree&>(tree).meet(low, high, {}, &work, kAtRest(tree), nullptr, visit);
      });
    };
    ASSERT_EQ(inside(changed.tree), inside(fresh.tree));
    // All that come near, and no more than once.
    const Vec3 half{0.3, 0.3, 0.3};
    Numbers found_near, expected_near;
    const auto meets = [&](std::int32_t t) {
      Vec3 corner[3];
      for (int v = 0; v < 3; ++v) corner[v] = changed.tree.at_rest(changed.tree.corners(t)[v]);
      return corners_meet(corner, 3, 0, p - half, p + half);
    };
    for (const std::int32_t t : ones)
      if (meets(t)) expected_near.push_back(t);
    for (const std::int32_t t : near_at_rest(changed.tree, p - half, p + half).visited) {
      ASSERT_TRUE(changed.tree.is_active(t));
      if (meets(t)) found_near.push_back(t);
    }
    expect_same_set(found_near, expected_near);
    const Numbers bucket = near_of(changed.index, p, 1).visited;
    for (const std::int32_t t : bucket) ASSERT_TRUE(changed.index.is_active(t));
    for (const std::int32_t t : ones) {
      double k[3];
      const double d = std::sqrt(closest_on_triangle(p, changed.index.corner(t, 0), changed.index.corner(t, 1),
                                                     changed.index.corner(t, 2), k));
      const auto times = std::count(bucket.begin(), bucket.end(), t);
      ASSERT_TRUE(d < 0.99 * changed.index.bucket_size() ? times == 1 : times <= 1);
    }
  }
}

// The bits of two structures with the same triangles.
void compare_bits(Changing& of, Searches& a, Searches& b) {
  expect_same_measures(a.measure, b.measure, of.surface.nodes());
  a.tree.forget(), b.tree.forget();
  for (int i = 0; i < 60; ++i) {
    const Vec3 p = of.somewhere(), half{0.4, 0.4, 0.4};
    QueryWork one, two;
    const auto place = [&](std::int32_t n) { return of.place(n); };
    expect_same_answer(a.tree.nearest(p, 10, of.bound, &one, place, AskedIsField{}),
                       b.tree.nearest(p, 10, of.bound, &two, place, AskedIsField{}));
    ASSERT_EQ(one.done(), two.done());
    ASSERT_TRUE(near_of(a.index, p, 2) == near_of(b.index, p, 2));
    ASSERT_TRUE(near_at_rest(a.tree, p - half, p + half) == near_at_rest(b.tree, p - half, p + half));
  }
}

struct Bodies : testing::TestWithParam<int> {
  BodyToCut body() const {
    const auto seed = static_cast<std::uint64_t>(GetParam());
    return GetParam() % 2 ? ball_to_cut(4, seed) : block_to_cut(4, 4, 3, 0.2, seed);
  }
  std::uint64_t seed() const { return static_cast<std::uint64_t>(100 + GetParam()); }
};
INSTANTIATE_TEST_SUITE_P(SurfaceChanges, Bodies, testing::Range(0, 6));

TEST_P(Bodies, ACutSurfaceIsSearchedAsOneThatIsBuiltOfItsTriangles) {
  const BodyToCut body = this->body();
  Changing of(body, seed());
  Searches changed(of.surface, true);
  compare_with_new_ones(of, changed);
  std::size_t changes = 0;
  for (int step = 0; step < 60; ++step) {
    const Numbers list = of.step();
    changes += list.size();
    changed.change(list);
    if (step % 4 == 0) compare_with_new_ones(of, changed);
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(changes, 300u);
  EXPECT_GT(of.play.mesh.nodes(), body.node_count());
}

TEST_P(Bodies, AnotherOrderOfTheChangesGivesTheSameBits) {
  const BodyToCut body = this->body();
  Changing of(body, seed());
  const Surface before = of.surface;
  Searches changed(of.surface, true);
  Surface other = before;
  Searches at_once(other, true);
  Numbers all;
  for (int step = 0; step < 50; ++step) {
    const Numbers list = of.step();
    all.insert(all.end(), list.begin(), list.end());
    changed.change(list);
  }
  std::copy(of.surface.rest.begin(), of.surface.rest.end(), other.rest.begin());
  std::copy(of.surface.triangles.begin(), of.surface.triangles.end(), other.triangles.begin());
  std::copy(of.surface.active.begin(), of.surface.active.end(), other.active.begin());
  std::shuffle(all.begin(), all.end(), of.random);
  const auto half = all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2);
  at_once.change({half, all.end()});
  at_once.change({all.begin(), half});
  of.move(0.3);
  compare_bits(of, changed, at_once);
}

TEST_P(Bodies, TheSurfaceIsFoundWhereItIsWhileItMovesAndIsCut) {
  const BodyToCut body = this->body();
  Changing of(body, seed());
  Searches changed(of.surface, true);
  for (int step = 0; step < 60; ++step) {
    if (step % 3 == 0) changed.change(of.step());
    of.move(step % 7 == 0 ? 1.0 : 0.05);
    const Numbers ones = of.surface.active_ones();
    const auto place = [&](std::int32_t n) { return of.place(n); };
    for (int i = 0; i < 12; ++i) {
      const Vec3 p = of.somewhere(), half{0.3, 0.3, 0.3};
      double nearest = INFINITY;
      Numbers expected, found;
      const auto meets = [&](std::int32_t t) {
        const Vec3 corner[3] = {of.corner(t, 0), of.corner(t, 1), of.corner(t, 2)};
        return corners_meet(corner, 3, 0, p - half, p + half);
      };
      for (const std::int32_t t : ones) {
        double k[3];
        nearest =
            std::min(nearest, std::sqrt(closest_on_triangle(p, of.corner(t, 0), of.corner(t, 1), of.corner(t, 2), k)));
        if (meets(t)) expected.push_back(t);
      }
      QueryWork work;
      const NearestPoint point = changed.tree.nearest(p, 20, of.bound, &work, place, AskedIsField{});
      ASSERT_NEAR(point.distance, nearest, 1e-13) << step;
      ASSERT_TRUE(changed.tree.is_active(point.surface_point.triangle));
      changed.tree.meet(p - half, p + half, of.bound, &work, place, AskedIsField{}, [&](std::int32_t t, const Vec3*) {
        ASSERT_TRUE(changed.tree.is_active(t));
        if (meets(t)) found.push_back(t);
      });
      expect_same_set(found, expected);
      const bool inside = is_inside_surface(changed.tree, p, of.bound, [&](Vec3 low, Vec3 high, auto visit) {
        changed.tree.meet(low, high, of.bound, &work, place, AskedIsField{}, visit);
      });
      ASSERT_EQ(inside, is_inside_surface(changed.tree, p, of.bound, [&](Vec3, Vec3, auto visit) {
                  for (const std::int32_t t : ones) {
                    const Vec3 corner[3] = {of.corner(t, 0), of.corner(t, 1), of.corner(t, 2)};
                    visit(t, corner);
                  }
                }));
      if (HasFatalFailure()) return;
    }
  }
}

TEST(SurfaceChanges, ATreeOfNoActiveTriangleFindsNothing) {
  const BodyToCut body = octahedron();
  Surface surface{body.nodes, body.triangles, std::vector<std::uint8_t>(body.triangles.size() / 3, 1)};
  Searches searches(surface, true);
  Numbers all;
  for (std::int32_t t = 0; t < surface.count(); ++t) all.push_back(t), surface.active[static_cast<std::size_t>(t)] = 0;
  searches.change(all);
  QueryWork work;
  const auto place = [&](std::int32_t n) { return searches.tree.at_rest(n); };
  for (const double within : {1.0, static_cast<double>(INFINITY)})
    EXPECT_LT(searches.tree.nearest({}, within, {}, &work, place, AskedIsField{}).surface_point.triangle, 0);
  EXPECT_TRUE(near_at_rest(searches.tree, {-9, -9, -9}, {9, 9, 9}).visited.empty());
  EXPECT_TRUE(near_of(searches.index, {}, 9).visited.empty());
  EXPECT_LT(searches.index.nearest({}).triangle, 0);
  for (auto& flag : surface.active) flag = 1;
  searches.change(all);
  const Searches fresh(surface, false);
  expect_same_measures(searches.measure, fresh.measure, surface.nodes());
  EXPECT_GE(searches.tree.nearest({}, 1, {}, &work, place, AskedIsField{}).surface_point.triangle, 0);
}

TEST(SurfaceChanges, ToolPointsAreTestedAgainAndContactsEndWhereTheirTriangleGoes) {
  const BodyToCut body = block_to_cut(2, 2, 2, 0, 0);
  Changing of(body, 1);
  SurfaceTree tree;
  TouchedSurface surface;
  TouchPoints touch;
  const Surface& all = of.surface;
  surface.triangles = all.triangles.data(), surface.triangle_count = all.count(), surface.active = all.active.data();
  surface.fans = &tree.fans();
  ASSERT_TRUE(
      tree.build(of.memory, all.rest.data(), all.nodes(), all.triangles.data(), all.count(), all.active.data()));
  ASSERT_TRUE(surface.index.build(of.memory, all.rest.data(), all.triangles.data(), all.count(), all.active.data()));
  std::vector<PointState> points(3);
  touch.of_tool[0] = points.data();
  const std::int32_t before = of.play.mesh.nodes(), corner_tetrahedron = 0;
  of.play.mesh.remove(&corner_tetrahedron, 1);
  const Numbers list = of.take_over(before);
  std::int32_t gone = -1;
  for (const std::int32_t t : list)
    if (!surface.is_active(t)) gone = t;
  ASSERT_GE(gone, 0);
  for (PointState& point : points) point.clear.distance = 1;
  points[0].contact = points[1].contact = true;
  points[0].anchor.triangle = gone, points[1].anchor.triangle = of.surface.active_ones().front();
  change_surface(surface, tree, touch, 3, list.data(), static_cast<std::int32_t>(list.size()));
  for (const PointState& point : points) EXPECT_EQ(point.clear.distance, 0);
  EXPECT_FALSE(points[0].contact);
  EXPECT_TRUE(points[0].has_ended);
  EXPECT_TRUE(points[1].contact);
  EXPECT_EQ(surface.changes, 1u);
  EXPECT_FALSE(surface.has_triangles(of.surface.nodes() - 1));
  EXPECT_TRUE(surface.has_triangles(surface.triangles[3 * of.surface.active_ones().front()]));
}

// ---- discs -----------------------------------------------------------------------------------------------------------

// A block of 4 x 5 x 2 cells that may be cut along x = 2, where y is below 3.
struct Slit {
  Slit() : body(block_to_cut(4, 5, 2, 0, 0)), of(body, 1), searches(of.surface, true) {
    searches.measure.set_tissue(local_compliance(3000, 0.45, StoredElement::p1));
    EXPECT_TRUE(
        all.create(of.memory, &searches.index, &searches.measure, of.surface.triangles.data(), of.surface.nodes()));
    EXPECT_TRUE(connected.create(of.memory, &searches.index, &searches.measure, of.surface.triangles.data(),
                                 of.surface.nodes(), &searches.tree.fans()));
  }
  void cut() {
    Numbers faces;
    for (const std::int32_t face : of.inner) {
      int in_plane = 0;
      for (const std::uint8_t corner : kFaceCorners[face % 4]) {
        const double* const p =
            &body.nodes[3 *
                        static_cast<std::size_t>(body.tetrahedra[static_cast<std::size_t>(4 * (face / 4) + corner)])];
        in_plane += p[0] == 2 && p[1] <= 3;
      }
      if (in_plane == 3) faces.push_back(face);
    }
    of.play.mesh.cut(faces.data(), static_cast<std::int32_t>(faces.size()));
    ASSERT_EQ(of.play.mesh.pending(), 0);
    searches.change(of.take_over(body.node_count()));
  }
  // The triangles whose nodes a disc at the place of the active surface that is nearest to p, and faces along `facing`, may hold: on which side
  // of the plane they lie.
  std::set<int> sides(Vec3 p, Vec3 facing, double radius, double* sum = nullptr) {
    SurfacePoint at;
    double best = INFINITY;
    for (const std::int32_t t : of.surface.active_ones()) {
      double k[3];
      const double d = closest_on_triangle(p, searches.index.corner(t, 0), searches.index.corner(t, 1),
                                           searches.index.corner(t, 2), k);
      if (dot(searches.index.outward(t), facing) < 0.9 || d >= best) continue;
      best = d, at = surface_point_of(t, k);
    }
    connected.press(at, facing, across(facing, {}), radius);
    std::set<int> found;
    if (sum) *sum = 0;
    for (int e = 0; e < connected.count(); ++e) {
      if (sum) *sum += connected.weights()[e];
      // A node's side is that of the tetrahedra that have it.
      for (std::int32_t t = 0; t < body.tetrahedron_count(); ++t) {
        const std::int32_t* const node = of.play.mesh.nodes_of(t);
        double x = 0;
        for (int v = 0; v < 4; ++v) x += 0.25 * of.surface.rest[3 * static_cast<std::size_t>(node[v])];
        if (std::find(node, node + 4, connected.nodes()[e]) != node + 4) found.insert(x < 2 ? -1 : 1);
      }
    }
    return found;
  }

  BodyToCut body;
  Changing of;
  Searches searches;
  ContactPatch all, connected;
};

TEST(SurfaceChanges, ADiscOnAnUncutSurfaceHasTheNodesThatItHasWithoutFans) {
  Slit slit;
  for (int i = 0; i < 200; ++i) {
    const SurfacePoint at = slit.searches.index.nearest(slit.of.somewhere());
    const Vec3 up = slit.searches.index.outward(at.triangle);
    const double radius = slit.of.between(0.05, 1.5);
    slit.all.press(at, up, across(up, {}), radius);
    slit.connected.press(at, up, across(up, {}), radius);
    std::map<std::int32_t, double> all, connected;
    for (int e = 0; e < slit.all.count(); ++e) all[slit.all.nodes()[e]] = slit.all.weights()[e];
    for (int e = 0; e < slit.connected.count(); ++e) connected[slit.connected.nodes()[e]] = slit.connected.weights()[e];
    for (const auto& [node, weight] : all) ASSERT_NEAR(connected[node], weight, 1e-9);
    for (const auto& [node, weight] : connected) ASSERT_NEAR(all[node], weight, 1e-9);
  }
}

TEST(SurfaceChanges, ADiscDoesNotReachAcrossACut) {
  Slit slit;
  const Vec3 up{0, 0, 1}, right{1, 0, 0};
  EXPECT_EQ(slit.sides({1.8, 1, 2}, up, 0.6), (std::set<int>{-1, 1}));
  slit.cut();
  double sum = 0;
  // Beside the cut on either side; a third of the disc hangs over the cut.
  EXPECT_EQ(slit.sides({1.8, 1, 2}, up, 0.6, &sum), std::set<int>{-1});
  EXPECT_LT(sum, 0.9);
  EXPECT_GT(sum, 0.4);
  EXPECT_EQ(slit.sides({2.2, 1, 2}, up, 0.6), std::set<int>{1});
  // Over the end of the cut, where its sides hang together.
  EXPECT_EQ(slit.sides({1.8, 3.2, 2}, up, 0.6), (std::set<int>{-1, 1}));
  // On the lips, which lie on one another.
  EXPECT_EQ(slit.sides({2, 1, 1}, right, 0.6), std::set<int>{-1});
  EXPECT_EQ(slit.sides({2, 1, 1}, -1 * right, 0.6), std::set<int>{1});
}

}  // namespace
}  // namespace palpate::tests
