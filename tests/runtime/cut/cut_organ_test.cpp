// A scene whose linear organ is cut, against the stiffness of what is left, assembled and factored anew.
#include "runtime/cut/cut_organ.h"

#include <gtest/gtest.h>

#include <random>

#include "runtime/contact/touch_step.h"
#include "studies/bodies/bodies.h"
#include "studies/cut/cut_body.h"
#include "studies/hyperelastic/large_body.h"
#include "tests/runtime/cut/cut_scene_effect.h"
#include "tests/runtime/touched_box.h"

// Allocations are counted while a change and a step run; sanitizers bring a malloc of their own.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kCounts = false;
#else
constexpr bool kCounts = true;
#endif
namespace {
thread_local bool counting = false;
thread_local long allocations = 0;
}  // namespace
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void* malloc(std::size_t bytes) {
  allocations += counting;
  return __libc_malloc(bytes);
}
void* aligned_alloc(std::size_t alignment, std::size_t bytes) {
  allocations += counting;
  return __libc_memalign(alignment, bytes);
}
}
#endif

namespace palpate::tests {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kSize = 0.01;  // m, of a cell

// ---- a block ---------------------------------------------------------------------------------------------------------

// All of its nodes are surface nodes of the bundle; the last ones are in reserve.
struct Block {
  Block(std::array<int, 3> cells, std::int32_t in_reserve, Element of) : element(of), reserve(in_reserve) {
    const SurfaceFirst first =
        surface_first(box_mesh(cells, {kSize * cells[0], kSize * cells[1], kSize * cells[2]}, 0));
    TetrahedralMesh mesh = first.mesh;
    mesh.region_names = {"soft"};
    elastic = body_of(mesh, {{5000, 0.45, 0}});
    hold(elastic, [](const auto& p) { return p[0] == 0 ? 7 : 0; });
    mesh_nodes = static_cast<std::int32_t>(elastic.nodes.size());
    for (std::int32_t r = 0; r < reserve; ++r) {
      elastic.nodes.push_back({-1 - 0.01 * r, 0, 0});
      elastic.fixed.push_back({1, 1, 1});
    }
    elastic.surface_count = nodes();
  }
  std::int32_t nodes() const { return mesh_nodes + reserve; }
  DenseBody dense() const {
    DenseBody body;
    body.body.mesh.nodes = elastic.nodes, body.body.mesh.tetrahedra = elastic.tetrahedra;
    body.body.mesh.region = elastic.region;
    body.body.triangles = elastic.triangles, body.body.surface_nodes = nodes();
    body.young = 5000, body.poisson = 0.45, body.interior = false;
    for (const auto& f : elastic.fixed) body.fixed.insert(body.fixed.end(), f.begin(), f.end());
    const BlockMatrix k = discretise(elastic, element).stiffness;
    body.stiffness = Eigen::MatrixXd::Zero(3 * nodes(), 3 * nodes());
    for (std::int32_t r = 0; r < k.rows; ++r)
      for (auto at = k.first[static_cast<std::size_t>(r)]; at < k.first[static_cast<std::size_t>(r) + 1]; ++at)
        for (int i = 0; i < 9; ++i)
          body.stiffness(3 * r + i / 3, 3 * k.column[static_cast<std::size_t>(at)] + i % 3) =
              k.block[static_cast<std::size_t>(at)][static_cast<std::size_t>(i)];
    return body;
  }
  Element element;
  std::int32_t reserve, mesh_nodes = 0;
  ElasticBody elastic;
};

struct CutScene {
  // preload, row: forces whose displacements are the preload, and a row of the offset; empty: none.
  CutScene(const Block& of, SceneDef def, CutCapacity capacity, const VectorXd& preload = {}, const VectorXd& row = {},
           bool tensors_alone = false)
      : block(of),
        cut(of.elastic),
        large(of.elastic, of.element),
        uncut(of.elastic, of.element),
        preload_force(preload),
        row_force(row),
        touched(of.dense(), [&](BundleParts& parts) {
          if (preload.size() == 0) return;
          const VectorXd u = uncut.solve(preload);
          parts.set(formats::SectionId::preload_displacement, {static_cast<std::size_t>(of.nodes()), 3},
                    std::vector<double>(u.data(), u.data() + u.size()));
        }) {
    for (std::int32_t n = 0; n < of.mesh_nodes; ++n) listed.push_back(n);
    pairs = std::make_unique<StoredPairs>(uncut, listed, of.nodes());
    CutMaking& making = cut_making();
    making = {};
    making.parts.body = &large.get(), making.parts.pairs = pairs.get();
    if (!tensors_alone)
      making.parts.pair_nodes = listed.data(), making.parts.pair_count = static_cast<std::int32_t>(listed.size());
    making.parts.surface_nodes = of.nodes(), making.parts.first_reserve = of.mesh_nodes;
    making.parts.capacity = capacity;
    if (row.size() > 0) {
      const VectorXd u = uncut.solve(row);
      row_numbers.assign(u.data(), u.data() + u.size());
      making.rows.numbers = row_numbers.data(), making.rows.count = 1, making.rows.nodes = of.nodes();
    }
    if (preload.size() > 0) def.preload = PALPATE_PRELOAD_ON;
    palpate_test_cut_def chosen = switched_on();
    palpate_scene_def wanted = def;
    wanted.parts = nullptr;
    palpate_add_part(&wanted.parts, &chosen.part);
    scene = std::make_unique<TouchedScene>(touched, wanted);
    made = making;
  }

  CutResult apply(const OwnedChange& change, bool replayed = false) {
    const CutResult result = made.organ->take_change(change.get(), replayed);
    if (result.outcome == CutOutcome::made) cut.apply(change), changes.push_back(change);
    TouchState& touch = made.scene->touch;
    // The surface's triangles follow.
    for (const auto& moved : change.moved) {
      const auto& before = of_rest(moved.tetrahedron);
      for (std::int32_t t = 0; t < static_cast<std::int32_t>(block.elastic.triangles.size()); ++t) {
        std::int32_t* const corner = const_cast<std::int32_t*>(touch.surface.triangles) + 3 * t;
        const auto& rest = block.elastic.triangles[static_cast<std::size_t>(t)];
        bool inside = true;
        for (const auto n : rest) inside = inside && std::ranges::find(before, n) != before.end();
        for (int v = 0; v < 3 && inside; ++v)
          for (int a = 0; a < 4; ++a)
            if (before[static_cast<std::size_t>(a)] == rest[static_cast<std::size_t>(v)])
              corner[v] = made.organ->surface_node(moved.corners[a]);
      }
    }
    return result;
  }
  const std::array<std::int32_t, 4>& of_rest(std::int32_t e) const {
    return block.elastic.tetrahedra[static_cast<std::size_t>(e)];
  }
  // The number in the cut body of a surface node.
  std::int32_t in_body(std::int32_t node) const {
    return node < block.mesh_nodes ? node : block.nodes() + node - block.mesh_nodes;
  }
  double max_of(const VectorXd& u) const { return u.cwiseAbs().maxCoeff(); }

  // What the scene should show under the forces of its contact nodes, and by how much it differs, relative to the largest number: of all
  // surface nodes, and of the response of the contact nodes.
  struct Errors {
    double field = 0, contacts = 0, missed = 0;
  };
  Errors errors() {
    const FactoredBody now(cut.now(), block.element);
    const std::int32_t all = cut.nodes();
    VectorXd offset = VectorXd::Zero(3 * all);
    if (preload_force.size() > 0) {
      const VectorXd before = uncut.solve(preload_force), after = now.solve(cut.divided(preload_force));
      for (std::int32_t n = 0; n < all; ++n) {
        const std::int32_t at = made.organ->compliance().tissue().origin(n);
        offset.segment<3>(3 * n) += after.segment<3>(3 * n) - before.segment<3>(3 * at);
      }
    }
    if (row_force.size() > 0) offset += *made.amount * now.solve(cut.divided(row_force));
    VectorXd force = VectorXd::Zero(3 * all);
    const TouchState& touch = made.scene->touch;
    const ContactConstraints& set = touch.rows.set();
    for (std::int32_t e = 0; e < set.node_count; ++e)
      force.segment<3>(3 * in_body(set.nodes[e].node)) +=
          Vector3d(touch.force[e].x, touch.force[e].y, touch.force[e].z);
    const VectorXd by_contacts = now.solve(force), field = offset + by_contacts;
    Errors found;
    const float* const shown = palpate_contacts_field(scene->contacts.get());
    const double scale = max_of(field) + 1e-12;
    for (std::int32_t n = 0; n < made.organ->response().nodes(); ++n)
      for (int i = 0; i < 3; ++i)
        found.field = std::max(found.field, std::abs(shown[3 * n + i] - field[3 * in_body(n) + i]) / scale);
    const double contact_scale = max_of(by_contacts) + 1e-12;
    for (std::int32_t e = 0; e < set.node_count; ++e) {
      const Vec3 u = touch.solver.matrix().displacement(set, touch.force, e);
      for (int i = 0; i < 3; ++i)
        found.contacts =
            std::max(found.contacts, std::abs(u[i] - by_contacts[3 * in_body(set.nodes[e].node) + i]) / contact_scale);
    }
    // Constraints that stick and have no compliance of their own are where they are held.
    for (std::int32_t p = 0; p < set.constraint_count; ++p) {
      const ContactConstraint& constraint = set.constraints[p];
      if (constraint.framed || constraint.axes != 7 || constraint.discs[0].radius > 0) continue;
      Vector3d mean = Vector3d::Zero();
      for (std::int32_t e = constraint.first_node; e < constraint.first_node + constraint.node_count; ++e)
        mean += set.nodes[e].weight * field.segment<3>(3 * in_body(set.nodes[e].node));
      const Vec3 target = set.target[p];
      found.missed = std::max(found.missed, (mean - Vector3d(target.x, target.y, target.z)).norm() / scale);
    }
    return found;
  }
  void expect_right(double limit, const char* what) {
    const Errors found = errors();
    EXPECT_LT(found.field, limit) << what;
    EXPECT_LT(found.contacts, limit) << what;
    EXPECT_LT(found.missed, limit) << what;
  }

  const Block& block;
  CutReference cut;
  LargeBody large;
  FactoredBody uncut;
  VectorXd preload_force, row_force;
  std::vector<float> row_numbers;
  std::vector<std::int32_t> listed;
  std::unique_ptr<StoredPairs> pairs;
  std::vector<OwnedChange> changes;
  TouchedBody touched;
  std::unique_ptr<TouchedScene> scene;
  CutMaking made;
};

// Nodes on the plane z = at that are not held, from the largest x on.
std::vector<std::int32_t> nodes_of_plane(const ElasticBody& body, std::int32_t count, double at) {
  std::vector<std::int32_t> nodes;
  for (std::int32_t n = 0; n < count; ++n)
    if (std::abs(body.nodes[static_cast<std::size_t>(n)][2] - at) < 1e-9 && !body.fixed[static_cast<std::size_t>(n)][0])
      nodes.push_back(n);
  std::ranges::sort(nodes, [&](std::int32_t a, std::int32_t b) {
    const auto &p = body.nodes[static_cast<std::size_t>(a)], &q = body.nodes[static_cast<std::size_t>(b)];
    return std::tuple(-p[0], p[1], a) < std::tuple(-q[0], q[1], b);
  });
  return nodes;
}
OwnedChange split_below(const CutReference& body, std::int32_t node) {
  return body.split(node, [&](std::size_t e) { return body.centre(e)[2] < body.position(node)[2]; });
}

VectorXd some_load(const Block& block, double size) {
  VectorXd force = VectorXd::Zero(3 * block.nodes());
  for (std::int32_t n = 0; n < block.mesh_nodes; ++n)
    for (int i = 0; i < 3; ++i)
      if (!block.elastic.fixed[static_cast<std::size_t>(n)][static_cast<std::size_t>(i)])
        force[3 * n + i] = size * (i == 2 ? -1 : 0.3) * (1 + 0.5 * std::sin(n));
  return force;
}

CutCapacity capacity_for(const Block& block, std::int32_t patterns) {
  return {block.mesh_nodes, block.reserve, patterns};
}
SceneDef held_def() {
  SceneDef def = unlimited_def();
  def.max_contact_nodes = 192;
  return def;
}

// ---- tests -----------------------------------------------------------------------------------------------------------

// A row of the offset as the supports' motion makes it: the held nodes move as well.
TEST(CutOrgan, FollowsSupportsThatMove) {
  const Block block({6, 6, 2}, 40, Element::p1_anp);
  VectorXd driven = VectorXd::Zero(3 * block.nodes());
  for (std::int32_t n = 0; n < block.mesh_nodes; ++n)
    if (block.elastic.fixed[static_cast<std::size_t>(n)][0]) {
      const auto& p = block.elastic.nodes[static_cast<std::size_t>(n)];
      driven.segment<3>(3 * n) = 0.02 * Vector3d(p[1] - 0.03, 0, p[2] * (p[1] - 0.02) / 0.01);
    }
  const auto moved_by = [&](const ElasticBody& body) {
    const auto count = 3 * static_cast<Eigen::Index>(body.nodes.size());
    VectorXd held = VectorXd::Zero(count);
    held.head(driven.size()) = driven;
    VectorXd force = VectorXd::Zero(count);  // -K u of the held nodes' motion
    const BlockMatrix k = discretise(body, block.element).stiffness;
    for (std::int32_t r = 0; r < k.rows; ++r)
      for (auto at = k.first[static_cast<std::size_t>(r)]; at < k.first[static_cast<std::size_t>(r) + 1]; ++at)
        for (int i = 0; i < 9; ++i)
          force[3 * r + i / 3] -= k.block[static_cast<std::size_t>(at)][static_cast<std::size_t>(i)] *
                                  held[3 * k.column[static_cast<std::size_t>(at)] + i % 3];
    return VectorXd(FactoredBody(body, block.element).solve(force) + held);
  };
  CutScene of(block, held_def(), capacity_for(block, 900), {}, VectorXd::Zero(3 * block.nodes()));
  const VectorXd uncut = moved_by(block.elastic);
  std::copy(uncut.data(), uncut.data() + uncut.size(), of.row_numbers.begin());
  *of.made.amount = 1.3;
  const auto plane = nodes_of_plane(block.elastic, block.mesh_nodes, kSize);
  for (std::size_t k = 0; k < 42; ++k)
    if (k < 30 || k > 37) {
      ASSERT_EQ(of.apply(split_below(of.cut, plane[k])).outcome, CutOutcome::made);
    }
  std::mt19937 random(11);
  for (int removed = 0; removed < 8;) {
    OwnedChange change;
    const auto e = static_cast<std::int32_t>(random() % block.elastic.tetrahedra.size());
    if (!of.cut.is_left(static_cast<std::size_t>(e)) || of.cut.centre(static_cast<std::size_t>(e))[0] > 0.02) continue;
    change.removed = {e};
    if (of.apply(change).outcome == CutOutcome::made) ++removed;
  }
  of.scene->touch();
  const VectorXd right = 1.3 * moved_by(of.cut.now());
  const float* const shown = palpate_contacts_field(of.scene->contacts.get());
  for (std::int32_t n = 0; n < of.made.organ->response().nodes(); ++n)
    for (int i = 0; i < 3; ++i)
      ASSERT_NEAR(shown[3 * n + i], right[3 * of.in_body(n) + i], 1e-5 * of.max_of(right)) << n;
}

// Rows on a lip, on the node across it, and elsewhere; after up to 100 split nodes, and with removed tetrahedra.
void split_and_hold(Element element, bool preload, bool row, bool tensors_alone) {
  const Block block({10, 10, 2}, 110, element);
  const VectorXd none;
  CutScene of(block, held_def(), capacity_for(block, element == Element::p1 ? 700 : 1300),
              preload ? some_load(block, 1e-3) : none, row ? some_load(block, 2e-3) : none, tensors_alone);
  const auto plane = nodes_of_plane(block.elastic, block.mesh_nodes, kSize);
  ASSERT_GE(plane.size(), 100u);
  std::vector<palpate_grip> grips;
  for (std::size_t done = 0; done < 100; ++done) {
    ASSERT_EQ(of.apply(split_below(of.cut, plane[done])).outcome, CutOutcome::made);
    if (done != 0 && done != 9 && done != 99) continue;
    const std::int32_t old = plane[done], twin = block.mesh_nodes + static_cast<std::int32_t>(done);
    *of.made.amount = 0.7 + 0.001 * static_cast<double>(done);
    grips = {grip_at_node(old, {0.0005, 0.0002, 0.002}), grip_at_node(twin, {0.0005, 0, -0.002}),
             grip_at_node(plane[plane.size() - 1], {0.0002, 0, -0.0001}), grip_at_node(0, {0, 0, 0.0003}, 7)};
    if (block.elastic.fixed[0][0]) grips.pop_back();
    of.scene->hold(grips);
    EXPECT_EQ(of.scene->flags & PALPATE_STEP_UNSOLVED, 0u);
    EXPECT_GT(of.scene->force().norm(), 0);
    of.expect_right(1e-4, "split");
  }
  std::mt19937 random(3);
  for (int removed = 0, tried = 0; removed < 10 && tried < 60; ++tried) {
    OwnedChange change;
    const auto e = static_cast<std::int32_t>(random() % block.elastic.tetrahedra.size());
    if (!of.cut.is_left(static_cast<std::size_t>(e))) continue;
    change.removed = {e};
    if (of.apply(change).outcome == CutOutcome::made) ++removed;
  }
  of.scene->hold(grips);
  of.expect_right(1e-4, "removed");
}

TEST(CutOrgan, HoldsRowsOnTheLipsOfACut) {
  split_and_hold(Element::p1, false, false, false);
}
TEST(CutOrgan, HoldsRowsWhereTheTensorsAloneKnowTheField) {
  split_and_hold(Element::p1, false, false, true);
}
TEST(CutOrgan, OpensUnderAPreload) {
  split_and_hold(Element::p1, true, false, false);
}
TEST(CutOrgan, OpensUnderARowOfTheOffset) {
  split_and_hold(Element::p1_anp, false, true, false);
}
TEST(CutOrgan, OpensUnderBoth) {
  split_and_hold(Element::p1, true, true, false);
}

TEST(CutOrgan, RemovalsAreThoseOfTheStiffness) {
  for (const Element element : {Element::p1, Element::p1_anp}) {
    const Block block({6, 5, 4}, 4, element);
    CutScene of(block, held_def(), capacity_for(block, 1200), some_load(block, 1e-3));
    std::mt19937 random(5);
    int removed = 0;
    for (int tried = 0; removed < 100 && tried < 400; ++tried) {
      OwnedChange change;
      const auto e = static_cast<std::int32_t>(random() % block.elastic.tetrahedra.size());
      if (!of.cut.is_left(static_cast<std::size_t>(e)) || of.cut.centre(static_cast<std::size_t>(e))[0] < 0.02)
        continue;
      change.removed = {e};
      if (of.apply(change).outcome != CutOutcome::made) continue;
      ++removed;
      if (removed != 1 && removed != 10 && removed != 100) continue;
      std::vector<palpate_grip> grips;
      for (std::int32_t n = block.mesh_nodes - 1; n > 0 && grips.size() < 5; n -= 17)
        if (!block.elastic.fixed[static_cast<std::size_t>(n)][0] &&
            of.made.organ->compliance().tissue().tetrahedra_at(n) > 0)
          grips.push_back(grip_at_node(n, {0.0002, 0.0001 * static_cast<double>(grips.size()), -0.0004}));
      of.scene->hold(grips);
      of.expect_right(1e-4, "removed");
    }
    EXPECT_GE(removed, 100);
  }
}

// Tools press the faces beside an open cut, by all laws and models of contact.
TEST(CutOrgan, MeetsToolsByEveryLawAndModelOfContact) {
  const Block block({6, 6, 2}, 40, Element::p1);
  for (const palpate_contact_law law : kEveryLaw)
    for (const palpate_contact_model contact : kEveryContact) {
      SceneDef def = held_def();
      def.law = law, def.contact = contact, def.collision = PALPATE_COLLISION_DEFORMED;
      CutScene of(block, def, capacity_for(block, 400), some_load(block, 3e-4));
      const auto plane = nodes_of_plane(block.elastic, block.mesh_nodes, kSize);
      for (std::size_t k = 0; k < 20; ++k) ASSERT_EQ(of.apply(split_below(of.cut, plane[k])).outcome, CutOutcome::made);
      const double top = 2 * kSize, radius = contact == PALPATE_CONTACT_PATCH ? 0.008 : 0;
      for (int k = 0; k <= 12; ++k) {
        const Vector3d one(0.043 + 0.0005 * k, 0.03, top + 0.001 - 0.0004 * k),
            two(0.025, 0.014 + 0.0002 * k, top + 0.001 - 0.0003 * k);
        const std::vector<Vector3d> points = {one, two};
        of.scene->touch(tools_of(points, radius, 0.3));
      }
      EXPECT_TRUE(of.scene->touches(0) || of.scene->touches(1)) << law << " " << contact;
      EXPECT_EQ(of.scene->flags & (PALPATE_STEP_UNSOLVED | PALPATE_STEP_SOLVE_INEXACT), 0u) << law << " " << contact;
      of.expect_right(1e-4, "pressed");
    }
}

// The lips meet at the end of the block: triangles of the end have the new nodes.
TEST(CutOrgan, HoldsPlacesOnTrianglesOfNewNodes) {
  const Block block({6, 6, 2}, 40, Element::p1);
  for (const palpate_contact_model contact : kEveryContact) {
    SceneDef def = held_def();
    def.contact = contact;
    CutScene of(block, def, capacity_for(block, 400));
    const auto plane = nodes_of_plane(block.elastic, block.mesh_nodes, kSize);
    for (std::size_t k = 0; k < 21; ++k) ASSERT_EQ(of.apply(split_below(of.cut, plane[k])).outcome, CutOutcome::made);
    std::vector<palpate_grip> grips;
    bool of_new = false, of_old = false;
    for (std::int32_t t = 0; t < static_cast<std::int32_t>(block.elastic.triangles.size()) && grips.size() < 4; ++t) {
      const std::int32_t* const corner = of.made.scene->touch.surface.triangles + 3 * t;
      const bool is_new = *std::max_element(corner, corner + 3) >= block.mesh_nodes;
      const bool at_end = of.touched.outward(t)[0] > 0.99;
      if (!at_end || (is_new ? of_new : of_old)) continue;
      (is_new ? of_new : of_old) = true;
      grips.push_back(grip_at_place(t, {0.5, 0.3, 0.2}, {0.0003, 0, is_new ? -0.001 : 0.001}));
    }
    ASSERT_TRUE(of_new && of_old);
    of.scene->hold(grips, contact == PALPATE_CONTACT_PATCH ? 0.006 : 0);
    EXPECT_GT(of.scene->force().norm(), 0);
    of.expect_right(1e-4, "held");
  }
}

// What collision asks: parts of contacts, and bounds, against all nodes.
TEST(CutOrgan, TellsThePartOfEachContact) {
  const Block block({6, 6, 2}, 40, Element::p1);
  SceneDef def = held_def();
  def.collision = PALPATE_COLLISION_DEFORMED;
  CutScene of(block, def, capacity_for(block, 400), some_load(block, 3e-4));
  const auto plane = nodes_of_plane(block.elastic, block.mesh_nodes, kSize);
  SurfaceField& field = *of.made.scene->touch.field;
  std::mt19937 random(1);
  double path = 0;
  for (int step = 0; step < 30; ++step) {
    if (step % 3 == 0 && step / 3 < 10) {
      ASSERT_EQ(of.apply(split_below(of.cut, plane[static_cast<std::size_t>(step / 3)])).outcome, CutOutcome::made);
    }
    std::vector<Vector3d> before(static_cast<std::size_t>(block.nodes()));
    QueryWork work;
    const auto at = [&](std::int32_t n) {
      const Vec3 u = field.at_node(n, &work);
      return Vector3d(u.x, u.y, u.z);
    };
    for (std::int32_t n = 0; n < of.made.organ->response().nodes(); ++n) before[static_cast<std::size_t>(n)] = at(n);
    path = field.path();
    const double z = 2 * kSize - 0.0002 * step;
    const std::vector<Vector3d> points = {{0.05, 0.03, z}, {0.03, 0.01 + 0.0003 * step, z}, {0.02, 0.05, z + 0.002}};
    of.scene->touch(tools_of(points));
    double most = 0, moved = 0;
    for (std::int32_t n = 0; n < of.made.organ->response().nodes(); ++n) {
      most = std::max(most, at(n).norm()),
      moved = std::max(moved, (at(n) - before[static_cast<std::size_t>(n)]).norm());
    }
    EXPECT_LE(most, field.norm() + 1e-9);
    EXPECT_LE(moved, field.path() - path + 1e-9) << step;
    for (int t = 0; t < 3; ++t) {
      const ContactId id = {ContactSource::tool, t, 0};
      double own = 0, without = 0;
      for (std::int32_t n = 0; n < of.made.organ->response().nodes(); ++n) {
        const Vec3 u = field.at_node_without(n, id, &work), v = field.at_node(n, &work);
        own = std::max(own, length(v - u)), without = std::max(without, length(u));
      }
      if (of.scene->touches(t)) {
        EXPECT_LE(own, field.own_norm(id) + field.norm() * 1e-5 + 1e-9);
      }
      EXPECT_LE(without, field.norm_without(id) + 1e-9);
      Operations done = 0;
      if (!of.scene->touches(t) || !field.predict_without(id, 1'000'000'000, &done)) continue;
      double predicted = 0, apart = 0;
      for (std::int32_t n = 0; n < of.made.organ->response().nodes(); ++n) {
        const Vec3 u = field.predicted_at_node(n, &work);
        predicted = std::max(predicted, length(u)), apart = std::max(apart, length(field.at_node(n, &work) - u));
      }
      EXPECT_LE(predicted, field.predicted_norm() + 1e-9);
      EXPECT_LE(apart, field.predicted_apart() + 1e-9);
    }
  }
}

TEST(CutOrgan, BeforeAnyCutIsTheLinearOrgan) {
  const Block block({5, 4, 3}, 10, Element::p1);
  for (const palpate_contact_law law : kEveryLaw) {
    SceneDef def = held_def();
    def.law = law, def.collision = PALPATE_COLLISION_DEFORMED, def.contact = PALPATE_CONTACT_PATCH;
    CutScene of(block, def, capacity_for(block, 100));
    TouchedScene linear(of.touched, def);
    // Where nothing asks for the surface, to the bit.
    for (int k = 0; k < 3; ++k) {
      const std::vector<palpate_grip> grips = {grip_at_node(40, {0.001, 0.0003 * k, 0}),
                                               grip_at_node(77, {0, 0.0002, -0.001}, 5)};
      of.scene->hold(grips), linear.hold(grips);
      EXPECT_EQ(of.scene->force(), linear.force());
    }
    of.scene->reset(), linear.reset();
    for (int k = 0; k < 20; ++k) {
      const std::vector<Vector3d> points = {{0.03 + 0.0003 * k, 0.02, 0.03 + 0.001 - 0.0003 * k},
                                            {0.02, 0.03, 0.03 + 0.001 - 0.0002 * k}};
      const auto tools = tools_of(points, 0.006, 0.2);
      of.scene->touch(tools), linear.touch(tools);
      for (int t = 0; t < 2; ++t) {
        ASSERT_EQ(of.scene->touches(t), linear.touches(t));
        // The surface that tools meet is known in single precision.
        EXPECT_LE((of.scene->force(t) - linear.force(t)).norm(), 1e-7 * (0.01 + linear.force(t).norm())) << k;
      }
      const auto shown = of.scene->shape(), right = linear.shape();
      double most = 1e-9, apart = 0;
      for (std::size_t i = 0; i < right.size(); ++i) {
        most = std::max(most, std::abs(static_cast<double>(right[i])));
        apart = std::max(apart, std::abs(static_cast<double>(shown[i]) - right[i]));
      }
      EXPECT_LE(apart, 1e-6 * most);
    }
  }
}

TEST(CutOrgan, AllocatesNothingInAChangeOrAStep) {
  if (!kCounts) GTEST_SKIP() << "a sanitizer's malloc is not counted";
  const Block block({6, 6, 2}, 40, Element::p1_anp);
  SceneDef def = held_def();
  def.collision = PALPATE_COLLISION_DEFORMED;
  CutScene of(block, def, capacity_for(block, 600), some_load(block, 2e-4), some_load(block, 1e-4));
  const auto plane = nodes_of_plane(block.elastic, block.mesh_nodes, kSize);
  for (int k = 0; k < 12; ++k) {
    OwnedChange change = split_below(of.cut, plane[static_cast<std::size_t>(k)]);
    if (k % 3 == 2) change = {}, change.removed = {5 * k};
    const std::vector<Vector3d> points = {{0.05, 0.03, 2 * kSize + 0.0005 - 0.0006 * k},
                                          {0.03, 0.02, 2 * kSize + 0.0005 - 0.0006 * k}};
    const auto tools = tools_of(points);
    *of.made.amount = 0.1 * k;
    allocations = 0, counting = true;
    const CutResult result = of.made.organ->take_change(change.get());
    of.scene->touch(tools);
    counting = false;
    EXPECT_EQ(allocations, 0);
    ASSERT_EQ(result.outcome, CutOutcome::made);
    of.cut.apply(change);
  }
  EXPECT_TRUE(of.scene->touches(0) || of.scene->touches(1));
  allocations = 0, counting = true;
  void* volatile memory = std::malloc(1);
  counting = false;
  std::free(memory);
  EXPECT_EQ(allocations, 1) << "the counter does not count";
}

// From a saved state a scene goes on with the same bits; forgetting a cut brings the uncut body back.
TEST(CutOrgan, ASavedStateGoesOnAndAForgottenCutIsNone) {
  const Block block({6, 6, 2}, 40, Element::p1);
  SceneDef def = held_def();
  def.collision = PALPATE_COLLISION_DEFORMED;
  const auto play = [&](CutScene& of, int k) {
    const std::vector<Vector3d> points = {{0.05, 0.03, 2 * kSize + 0.001 - 0.0003 * k},
                                          {0.03, 0.01 + 0.0003 * k, 2 * kSize - 0.0002 * k}};
    *of.made.amount = 0.5 + 0.1 * std::sin(k);
    of.scene->touch(tools_of(points));
  };
  CutScene one(block, def, capacity_for(block, 400), some_load(block, 2e-4), some_load(block, 1e-4));
  const auto plane = nodes_of_plane(block.elastic, block.mesh_nodes, kSize);
  for (int k = 0; k < 10; ++k) {
    if (k % 2 == 0) {
      ASSERT_EQ(one.apply(split_below(one.cut, plane[static_cast<std::size_t>(k)])).outcome, CutOutcome::made);
    }
    play(one, k);
  }
  std::vector<std::uint64_t> state(palpate_scene_state_bytes(one.scene->get()) / 8 + 1);
  palpate_error error = {};
  ASSERT_EQ(palpate_scene_save(one.scene->get(), state.data(), 8 * state.size(), &error), PALPATE_OK) << error.text;

  CutScene two(block, def, capacity_for(block, 400), some_load(block, 2e-4), some_load(block, 1e-4));
  ASSERT_EQ(two.apply(split_below(two.cut, plane[30])).outcome, CutOutcome::made);  // of another past
  play(two, 3);
  two.made.organ->forget_changes(true);
  two.cut = CutReference(block.elastic);
  for (const OwnedChange& change : one.changes) {
    ASSERT_EQ(two.apply(change, true).outcome, CutOutcome::made);
  }
  ASSERT_EQ(palpate_scene_restore(two.scene->get(), state.data(), 8 * state.size(), &error), PALPATE_OK) << error.text;
  for (int k = 10; k < 20; ++k) {
    if (k == 15) {
      ASSERT_EQ(one.apply(split_below(one.cut, plane[20])).outcome, CutOutcome::made);
      ASSERT_EQ(two.apply(split_below(two.cut, plane[20])).outcome, CutOutcome::made);
    }
    play(one, k), play(two, k);
    EXPECT_TRUE(one.scene->has_bytes_of(*two.scene)) << k;
  }

  CutScene fresh(block, def, capacity_for(block, 400), some_load(block, 2e-4), some_load(block, 1e-4));
  one.scene->reset();
  for (int k = 0; k < 5; ++k) {
    play(one, k), play(fresh, k);
    EXPECT_TRUE(one.scene->has_bytes_of(*fresh.scene)) << k;
  }
}

}  // namespace
}  // namespace palpate::tests
