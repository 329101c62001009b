// An organ that is cut while it is touched, through the C API, from palpate-precompute on; against the stiffness of the mesh that is left, factored anew.
#include <palpate/palpate_scene_def.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <set>

#include "runtime/cut/effect.h"
#include "runtime/cut/lips.h"
#include "runtime/scene/scene.h"
#include "studies/cut/cut_body.h"
#include "studies/hyperelastic/large_body.h"
#include "studies/hyperelastic/large_reference.h"
#include "tests/runtime/cut/precomputed_block.h"
#include "tests/runtime/cut/random_cut_scene.h"
#include "tests/runtime/touched_box.h"

namespace palpate::tests {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr char kAll[] = "{ box = { min = [-1, -1, -1], max = [100, 100, 100] }, where = \"all\" }";

// While it is there, linear scenes re-base the compliance, from this rank on.
struct Rebases {
  explicit Rebases(std::int32_t at) { rank = at; }
  ~Rebases() { rank = 0; }
  Rebases(const Rebases&) = delete;
  Rebases& operator=(const Rebases&) = delete;
  inline static std::int32_t rank = 0;
};

SceneDef cut_def() {
  SceneDef def = unlimited_def();
  def.collision = PALPATE_COLLISION_DEFORMED, def.contact = PALPATE_CONTACT_POINT, def.shape = PALPATE_SHAPE_SURFACE;
  def.cut.cut = PALPATE_CUT_ON, def.cut.cut_operations = 1'000'000'000;
  def.cut.cut_rebase = Rebases::rank;
  return def;
}

SceneDef large_def(palpate_deformation_model as = PALPATE_DEFORMATION_LARGE) {
  SceneDef def = cut_def();
  def.large.deformation = as, def.cut.cut_rebase = 0;
  return def;
}
constexpr palpate_deformation_model kLarge[] = {PALPATE_DEFORMATION_LARGE, PALPATE_DEFORMATION_LARGE_BESIDE,
                                                PALPATE_DEFORMATION_LARGE_RENEWED};

// 80 x 50 x 40 mm, all of which may be cut, held at x = 0.
struct Block {
  explicit Block(Element of, const char* foundation = Inputs::kBesideTheCut)
      : Block(Inputs(of, {10, 6, 5}, kAll, foundation)) {}
  explicit Block(Inputs made) : inputs(std::move(made)), body(inputs.body()) {
    palpate_error error = {};
    palpate_bundle* opened = nullptr;
    EXPECT_EQ(palpate_bundle_open_file(inputs.precompute("").c_str(), nullptr, &opened, &error), PALPATE_OK)
        << error.text;
    bundle.reset(opened);
  }
  Inputs inputs;
  ElasticBody body;
  BundlePointer bundle;
};
const Block& block(Element element) {
  static const Block p1(Element::p1), anp(Element::p1_anp);
  return element == Element::p1 ? p1 : anp;
}
// On a foundation below all of it.
const Block& standing_block(Element element) {
  static const Block p1(Element::p1, Inputs::kBelowAll), anp(Element::p1_anp, Inputs::kBelowAll);
  return element == Element::p1 ? p1 : anp;
}

// The mesh that is left, as a body; a node that no tetrahedron has stands on a spring of the reference.
ElasticBody left_of(const ElasticBody& body, const CutMesh& mesh) {
  ElasticBody now = body;
  for (std::int32_t n = static_cast<std::int32_t>(body.nodes.size()); n < mesh.nodes(); ++n) {
    now.nodes.push_back(body.nodes[static_cast<std::size_t>(mesh.at_rest(n))]);
    now.fixed.push_back(body.fixed[static_cast<std::size_t>(mesh.at_rest(n))]);
  }
  for (std::size_t t = 0; t < body.triangles.size(); ++t)
    if (mesh.surface().face(static_cast<std::int32_t>(t)) >= 0)
      mesh.surface().nodes(static_cast<std::int32_t>(t), now.triangles[t].data());
    else
      now.triangles[t] = {};
  for (auto& foundation : now.foundations)
    std::erase_if(foundation.triangles, [&](std::int32_t t) { return mesh.surface().face(t) < 0; });
  now.tetrahedra.clear(), now.region.clear();
  for (std::size_t e = 0; e < body.tetrahedra.size(); ++e) {
    if (mesh.is_removed(static_cast<std::int32_t>(e))) continue;
    const std::int32_t* const t = mesh.nodes_of(static_cast<std::int32_t>(e));
    now.tetrahedra.push_back({t[0], t[1], t[2], t[3]});
    now.region.push_back(body.region[e]);
  }
  return now;
}
// The node of the cut mesh that a node of the scene is.
std::int32_t in_mesh_of(const ElasticBody& body, std::int32_t node) {
  const std::int32_t first = body.surface_count - body.reserve;
  const bool is_new = node >= first && node < body.surface_count;
  return is_new ? static_cast<std::int32_t>(body.nodes.size()) + node - first : node;
}

struct Played {
  explicit Played(const Block& from, SceneDef def = cut_def())
      : of(from), scene(make(from, def)), contacts(scene.get()) {}
  static ScenePointer make(const Block& from, const SceneDef& def) {
    palpate_scene* created = nullptr;
    palpate_error error = {};
    EXPECT_EQ(palpate_scene_create(from.bundle.get(), &def, &created, &error), PALPATE_OK) << error.text;
    return ScenePointer(created);
  }
  // A body that is solved beside the touch is solved between its steps.
  palpate_step_flags touch(const std::vector<palpate_tool>& tools = {}) {
    if (solves_beside) palpate_scene_deform(scene.get());
    return palpate_scene_touch(scene.get(), tools.data(), static_cast<std::int32_t>(tools.size()), 1e-3, contacts.get(),
                               contacts.bytes());
  }
  // A blade of some points along z, in the plane y = at.
  void blade(double x, double at, double toughness = 0, double below = -0.01, double above = 0.05, double friction = 0,
             double width = 0) {
    std::vector<double> points;
    for (int i = 0; i < 4; ++i) points.insert(points.end(), {x, at, below + (above - below) * i / 3});
    palpate_blade blade = palpate_default_blade();
    blade.points = points.data(), blade.point_count = 4, blade.direction[0] = -1, blade.toughness = toughness;
    blade.friction = friction, blade.width = width;
    palpate_error error = {};
    ASSERT_EQ(palpate_scene_set_blade(scene.get(), 0, &blade, &error), PALPATE_OK) << error.text;
  }
  void withdraw() {
    const palpate_blade none = palpate_default_blade();
    ASSERT_EQ(palpate_scene_set_blade(scene.get(), 0, &none, nullptr), PALPATE_OK);
  }
  // From the free end to x = end.
  void cut(double end, double at = 0.025, const std::vector<palpate_tool>& tools = {}) {
    for (double x = 0.09; x > end; x -= 0.001) {
      blade(x, at);
      ASSERT_EQ(touch(tools) & ~PALPATE_STEP_DEFORMATION_BEHIND, 0u) << x;
      ASSERT_EQ(surface_fault(), "") << x;
    }
    withdraw();
  }
  const palpate_cut_state& state() const { return *palpate_scene_cut_state(scene.get()); }
  const CutMesh& mesh() const { return cut_mesh_of(*scene); }
  std::int32_t surface_nodes() const { return of.body.surface_count; }
  // The node of the cut mesh that a node of the scene is.
  std::int32_t in_mesh(std::int32_t node) const { return in_mesh_of(of.body, node); }
  std::int32_t in_scene(std::int32_t node) const {
    const auto rest = static_cast<std::int32_t>(of.body.nodes.size());
    return node < rest ? node : of.body.surface_count - of.body.reserve + node - rest;
  }
  std::int32_t shaped_nodes() const {
    return scene->def.shape == PALPATE_SHAPE_VOLUME ? static_cast<std::int32_t>(of.body.nodes.size()) : surface_nodes();
  }
  std::vector<float> positions() {
    std::vector<float> found(3 * static_cast<std::size_t>(shaped_nodes()));
    palpate_shape_out out = palpate_default_shape_out();
    out.positions = found.data(), out.node_capacity = shaped_nodes();
    EXPECT_EQ(palpate_scene_shape(scene.get(), contacts, &out), 0u);
    return found;
  }
  std::vector<std::array<std::int32_t, 3>> triangles(std::vector<std::uint8_t>* lips = nullptr) const {
    const std::int32_t count = palpate_scene_cut_surface(scene.get(), nullptr, nullptr, 0);
    std::vector<std::array<std::int32_t, 3>> found(static_cast<std::size_t>(count));
    std::vector<std::uint8_t> is_lip(found.size());
    EXPECT_EQ(palpate_scene_cut_surface(scene.get(), found[0].data(), is_lip.data(), count), count);
    if (lips) *lips = is_lip;
    return found;
  }
  // Whether each edge has one triangle on either side.
  std::string surface_fault() const {
    std::set<std::pair<std::int32_t, std::int32_t>> edges;
    const auto found = triangles();
    for (const auto& t : found)
      for (std::size_t v = 0; v < 3; ++v)
        if (!edges.emplace(t[v], t[(v + 1) % 3]).second) return "an edge twice";
    for (const auto& [a, b] : edges)
      if (!edges.contains({b, a})) return "an open edge";
    return "";
  }
  ElasticBody left() const { return left_of(of.body, mesh()); }

  const Block& of;
  ScenePointer scene;
  Contacts contacts;
  bool solves_beside = true;
};

// The free node of the scene nearest to a place, on one side of the plane y = at.
std::int32_t nearest(const Played& played, Vector3d p, double at, int side) {
  std::int32_t best = -1;
  double least = INFINITY;
  std::set<std::int32_t> of_surface;
  for (const auto& t : played.triangles()) of_surface.insert(t.begin(), t.end());
  for (const std::int32_t n : of_surface) {
    const std::int32_t own = played.mesh().at_rest(played.in_mesh(n));
    const Vector3d x(played.of.body.nodes[static_cast<std::size_t>(own)].data());
    if (side * (x[1] - at) < 1e-3 || (x - p).norm() >= least) continue;
    least = (x - p).norm(), best = n;
  }
  return best;
}

// Of the whole organ.
std::int32_t triangle_nearest(const Played& played, const Vector3d& p) {
  std::int32_t best = -1;
  double least = INFINITY;
  for (std::size_t t = 0; t < played.of.body.triangles.size(); ++t) {
    Vector3d middle = Vector3d::Zero();
    for (const std::int32_t n : played.of.body.triangles[t])
      middle += Vector3d(played.of.body.nodes[static_cast<std::size_t>(n)].data()) / 3;
    if ((middle - p).norm() < least) least = (middle - p).norm(), best = static_cast<std::int32_t>(t);
  }
  return best;
}

palpate_tool puller(const palpate_grip& grip, std::int32_t id) {
  palpate_tool tool = palpate_default_tool();
  tool.id = id, tool.grips = &grip, tool.grip_count = 1;
  return tool;
}

// ---- the body that is left -------------------------------------------------------------------------------------------

// Grips draw both sides of a cut apart: the field and the forces are those of the mesh that is left.
void compare_opened_cut() {
  for (const Element element : {Element::p1, Element::p1_anp})
    for (const bool stands : {false, true}) {
      Played played(stands ? standing_block(element) : block(element));
      played.cut(0.035);
      EXPECT_GT(played.state().nodes, 10);
      EXPECT_EQ(played.state().left, 0);
      EXPECT_EQ(played.state().pieces, 1);
      EXPECT_GE(played.state().rebased, Rebases::rank > 0 ? 2 : 0);
      palpate_grip up = grip_at_node(nearest(played, {0.08, 0.05, 0.02}, 0.025, 1), {0, 0.006, 0.001}),
                   down = grip_at_node(nearest(played, {0.08, 0, 0.02}, 0.025, -1), {0, -0.006, 0});
      for (int s = 0; s < 3; ++s) ASSERT_EQ(played.touch({puller(up, 1), puller(down, 2)}), 0u);
      const FactoredBody now(played.left(), element);
      VectorXd force = VectorXd::Zero(3 * played.mesh().nodes());
      for (std::int32_t e = 0; e < played.contacts->node_count; ++e) {
        const palpate_contact_node& node = played.contacts.nodes()[e];
        force.segment<3>(3 * played.in_mesh(node.node)) += Vector3d(node.force);
      }
      const VectorXd right = now.solve(force);
      const std::vector<float> shape = played.positions();
      double worst = 0, opened = 0;
      for (std::int32_t n = 0; n < played.mesh().nodes(); ++n) {
        const auto rest = played.of.body.nodes[static_cast<std::size_t>(played.mesh().at_rest(n))];
        const std::int32_t own = played.in_scene(n), reserve = played.of.body.surface_count - played.of.body.reserve;
        const bool waits = n >= reserve && n < played.of.body.surface_count;  // in no tetrahedron
        if (own >= played.surface_nodes() || waits) continue;
        for (int i = 0; i < 3; ++i) {
          const double u = static_cast<double>(shape[3 * static_cast<std::size_t>(own) + static_cast<std::size_t>(i)]) -
                           rest[static_cast<std::size_t>(i)];
          worst = std::max(worst, std::abs(u - right[3 * n + i]));
        }
        if (n >= static_cast<std::int32_t>(played.of.body.nodes.size()))
          opened = std::max(opened, (right.segment<3>(3 * n) - right.segment<3>(3 * played.mesh().from(n))).norm());
      }
      EXPECT_LT(worst, 1e-4 * 0.006) << name_of(element);
      EXPECT_GT(opened, 0.006) << "the lips are apart";
      // The grips are where they draw.
      for (const palpate_grip* grip : {&up, &down})
        for (int i = 0; i < 3; ++i)
          EXPECT_NEAR(right[3 * played.in_mesh(grip->node) + i], grip->displacement[i], 1e-6) << name_of(element);
    }
}
TEST(CutScene, AnOpenedCutIsThatOfTheStiffnessFactoredAnew) {
  compare_opened_cut();
}

// ---- what was held before a cut --------------------------------------------------------------------------------------

SceneDef holding_def() {
  SceneDef def = cut_def();
  def.contact = PALPATE_CONTACT_PATCH, def.grasps.grasps = 1, def.links.max_links = 4;
  return def;
}

// The triangle of the side z = 40 mm whose middle is nearest to a place, on one side of y = at; never one of a lip.
std::int32_t triangle_near(const ElasticBody& body, double x, double y, double at, int side) {
  std::int32_t best = -1;
  double least = INFINITY;
  for (std::size_t t = 0; t < body.triangles.size(); ++t) {
    Vector3d middle = Vector3d::Zero();
    bool on_top = true;
    for (const std::int32_t n : body.triangles[t]) {
      const Vector3d p(body.nodes[static_cast<std::size_t>(n)].data());
      middle += p / 3, on_top = on_top && std::abs(p[2] - 0.04) < 1e-9;
    }
    const double far = (middle - Vector3d(x, y, 0.04)).norm();
    if (on_top && side * (middle[1] - at) > 0 && far < least) best = static_cast<std::int32_t>(t), least = far;
  }
  return best;
}

// On which side of y = at the tetrahedra of a node of the scene lie; 0: the node was not divided.
int side_of(const Played& played, std::int32_t node, double at) {
  const CutMesh& mesh = played.mesh();
  const std::int32_t own = played.in_mesh(node), rest = mesh.at_rest(own);
  bool divided = own != rest;
  for (auto n = static_cast<std::int32_t>(played.of.body.nodes.size()); n < mesh.nodes(); ++n)
    divided = divided || mesh.at_rest(n) == rest;
  double sum = 0;
  for (std::size_t e = 0; e < played.of.body.tetrahedra.size(); ++e) {
    const std::int32_t* const t = mesh.nodes_of(static_cast<std::int32_t>(e));
    if (std::find(t, t + 4, own) == t + 4) continue;
    for (const std::int32_t n : played.of.body.tetrahedra[e])
      sum += played.of.body.nodes[static_cast<std::size_t>(n)][1] / 4 - at / 4;
  }
  return !divided ? 0 : sum > 0 ? 1 : -1;
}

struct HeldError {
  double field = 0, rows = 0;
  int divided = 0, across = 0;  // nodes that are held: where the cut divided; of these, those of the other side
};
VectorXd force_of(const Played& played) {
  VectorXd force = VectorXd::Zero(3 * played.mesh().nodes());
  for (std::int32_t e = 0; e < played.contacts->node_count; ++e) {
    const palpate_contact_node& node = played.contacts.nodes()[e];
    force.segment<3>(3 * played.in_mesh(node.node)) += Vector3d(node.force);
  }
  return force;
}
// The field is that of the body which is left under the forces of the contact nodes, and each constraint that sticks has its target.
HeldError held_error(Played& played, const ElasticBody& left, Element element, double at, int side) {
  HeldError found;
  const FactoredBody now(left, element);
  for (std::int32_t e = 0; e < played.contacts->node_count; ++e) {
    const palpate_contact_node& node = played.contacts.nodes()[e];
    if (node.source == PALPATE_SOURCE_LIP) continue;
    const int of_node = side_of(played, node.node, at);
    found.divided += of_node != 0, found.across += of_node == -side;
  }
  const VectorXd right = now.solve(force_of(played));
  const double scale = right.cwiseAbs().maxCoeff();
  const std::vector<float> shape = played.positions();
  for (const auto& t : played.triangles())
    for (const std::int32_t n : t) {
      const auto rest = played.of.body.nodes[static_cast<std::size_t>(played.mesh().at_rest(played.in_mesh(n)))];
      for (int i = 0; i < 3; ++i)
        found.field =
            std::max(found.field, std::abs(static_cast<double>(shape[static_cast<std::size_t>(3 * n + i)]) -
                                           rest[static_cast<std::size_t>(i)] - right[3 * played.in_mesh(n) + i]) /
                                      scale);
    }
  const TouchState& touch = played.scene->touch;
  const ContactConstraints& set = touch.rows.set();
  for (std::int32_t p = 0; p < set.constraint_count; ++p) {
    const ContactConstraint& constraint = set.constraints[p];
    if (constraint.framed || constraint.axes != 7 || constraint.id.part != 0) continue;
    const Vec3 r = touch.body->reaction(touch, p);
    Vector3d mean(set.target[p].x, set.target[p].y, set.target[p].z);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) mean[i] -= constraint.local.m[i][j] * r[j];
    for (std::int32_t e = constraint.first_node; e < constraint.first_node + constraint.node_count; ++e)
      mean -= set.nodes[e].weight * right.segment<3>(3 * played.in_mesh(set.nodes[e].node));
    found.rows = std::max(found.rows, mean.norm() / scale);
  }
  return found;
}

void hold_a_side_with_jaws() {
  for (const Element element : {Element::p1, Element::p1_anp})
    for (const int side : {1, -1}) {
      SceneDef def = holding_def();
      if (side > 0) def.cut.cut_operations = 20'000;  // some changes wait for the next step
      Played played(block(element), def);
      palpate_grasp jaws = palpate_default_grasp();
      jaws.triangle = triangle_near(played.of.body, 0.065, 0.025 + 0.003 * side, 0.025, side), jaws.radius = 0.005;
      for (double& weight : jaws.barycentric) weight = 1.0 / 3;
      palpate_tool forceps = palpate_default_tool();
      forceps.id = 5, forceps.parts = &jaws.part;
      ASSERT_EQ(played.touch({forceps}), 0u);
      played.cut(0.035, 0.025, {forceps});
      for (int s = 0; s < 200 && played.state().left > 0; ++s) ASSERT_EQ(played.touch({forceps}), 0u);
      jaws.position[1] += 0.004 * side, jaws.position[2] += 0.001;
      for (int s = 0; s < 3; ++s) ASSERT_EQ(played.touch({forceps}), 0u);
      const HeldError found = held_error(played, played.left(), element, 0.025, side);
      EXPECT_GT(found.divided, 0);
      EXPECT_EQ(found.across, 0) << name_of(element) << ' ' << side;
      EXPECT_LT(found.field, 1e-4) << name_of(element) << ' ' << side;
      EXPECT_LT(found.rows, 1e-4) << name_of(element) << ' ' << side;
      EXPECT_GT(Vector3d(palpate_contacts_tool(played.contacts, 0)->force_raw).norm(), 0.01);
    }
}
TEST(CutScene, JawsHoldTheSideThatTheyTouchedBeforeTheCut) {
  hold_a_side_with_jaws();
}

// A thread from the world to a point of a triangle, and one to a disc; on either side of the coming cut.
void hold_triangles_with_links() {
  for (const int side : {1, -1})
    for (const double radius : {0.0, 0.005}) {
      Played played(block(Element::p1), holding_def());
      std::int32_t on_plane = triangle_near(played.of.body, 0.065, 0.025 + 0.001 * side, 0.025, side);
      palpate_link link = palpate_default_link();
      link.kind = PALPATE_LINK_SPRING, link.stiffness = 5, link.rest_length = 0.01, link.radius = radius;
      link.ends[0].kind = PALPATE_END_SURFACE_POINT, link.ends[1].kind = PALPATE_END_WORLD;
      link.ends[0].triangle = on_plane;
      for (double& weight : link.ends[0].barycentric) weight = 1.0 / 3;
      const double end[3] = {0.065, 0.025 + 0.02 * side, 0.05};
      std::copy_n(end, 3, link.ends[1].point);
      palpate_error error = {};
      ASSERT_EQ(palpate_scene_set_links(played.scene.get(), &link, 1, &error), PALPATE_OK) << error.text;
      ASSERT_EQ(played.touch(), 0u);
      const auto place = [&] { return load3(palpate_scene_link_state(played.scene.get(), 0)->ends[0]); };
      const Vec3 before = place();
      played.cut(0.035);
      for (int s = 0; s < 20; ++s) ASSERT_EQ(played.touch(), 0u);
      const HeldError found = held_error(played, played.left(), Element::p1, 0.025, side);
      EXPECT_GT(found.divided, 0);
      EXPECT_EQ(found.across, 0) << side << ' ' << radius;
      EXPECT_LT(found.field, 1e-4) << side;
      EXPECT_GT(side * (place() - before).y, 1e-4) << "its lip is free now, and follows it";
      if (radius > 0) continue;
      // The end is where its triangle is.
      const std::vector<float> shape = played.positions();
      const std::int32_t* const corner = played.scene->touch.surface.triangles + 3 * on_plane;
      Vector3d middle = Vector3d::Zero();
      for (int v = 0; v < 3; ++v)
        for (int i = 0; i < 3; ++i)
          middle[i] += static_cast<double>(shape[static_cast<std::size_t>(3 * corner[v] + i)]) / 3;
      const Vec3 now = place();
      EXPECT_LT((middle - Vector3d(now.x, now.y, now.z)).norm(), 1e-6);
    }
}
TEST(CutScene, LinksHoldTheTrianglesThatTheyWereGiven) {
  hold_triangles_with_links();
}

// A plate presses the block on a table and has drawn it along; a cut between them divides nodes that stick.
void hold_lips_with_an_obstacle() {
  palpate_obstacle plates[2] = {palpate_default_obstacle(), palpate_default_obstacle()};
  SceneDef def = cut_def();
  def.obstacles.count = 2, def.obstacles.list = plates;
  palpate_pose pose = palpate_default_pose();
  const auto put = [&](double x, double z) {
    pose.position[0] = x, pose.position[1] = 0.025, pose.position[2] = z;
    pose.orientation[0] = 0, pose.orientation[1] = 1;  // it looks down
  };
  put(0.04, 0.041);
  for (palpate_obstacle& plate : plates) {
    plate.kind = PALPATE_OBSTACLE_RECTANGLE, plate.size[0] = plate.size[1] = 0.3, plate.friction = 5;
    std::copy_n(pose.position, 3, plate.position);
  }
  std::copy_n(pose.orientation, 4, plates[0].orientation);
  plates[1].position[2] = -1e-4;
  Played played(block(Element::p1), def);
  for (int s = 0; s <= 60; ++s) {
    put(0.04 + 2e-5 * std::max(0, s - 30), 0.041 - 1e-4 * std::min(s, 30));
    palpate_error error = {};
    ASSERT_EQ(palpate_scene_set_obstacle_pose(played.scene.get(), 0, &pose, &error), PALPATE_OK) << error.text;
    ASSERT_EQ(played.touch(), 0u) << s;
  }
  const std::vector<float> before = played.positions();
  played.cut(0.04);
  for (int s = 0; s < 3; ++s) ASSERT_EQ(played.touch(), 0u);
  const std::vector<float> after = played.positions();
  int divided = 0;
  std::set<std::int32_t> nodes;
  for (const auto& t : played.triangles()) nodes.insert(t.begin(), t.end());
  for (const std::int32_t n : nodes) {
    const std::int32_t own = played.mesh().at_rest(played.in_mesh(n));
    const auto& rest = played.of.body.nodes[static_cast<std::size_t>(own)];
    const double pressed = static_cast<double>(before[static_cast<std::size_t>(3 * own + 2)]);
    // Those at the end may slip.
    if (std::abs(rest[2] - 0.04) > 1e-9 || std::abs(pressed - 0.038) > 1e-6 || rest[0] > 0.075) continue;
    if (side_of(played, n, 0.025) == 0) continue;
    ++divided;
    for (std::size_t d = 0; d < 3; ++d)
      EXPECT_NEAR(after[static_cast<std::size_t>(3 * n) + d], before[static_cast<std::size_t>(3 * own) + d], 2e-6) << n;
  }
  EXPECT_GT(divided, 3);
}
TEST(CutScene, AnObstacleHoldsBothLipsWithItsFriction) {
  hold_lips_with_an_obstacle();
}

// ---- lips that press on one another ----------------------------------------------------------------------------------

// The mesh that is left with the grips and with a row between each two nodes across a cut in the plane y = at: b below, a above it. Solved by projected Gauss-Seidel on
// the dense compliance; grips are held in all three directions.
struct SqueezedTruth {
  VectorXd u;
  std::vector<Vector3d> grip;  // N
  double lips = 0, gap = 0;    // N, of all pairs; m, the least one
};
struct HeldNode {
  std::int32_t node;
  Vector3d at;
};
SqueezedTruth squeezed(const Played& played, const std::vector<HeldNode>& held, Element element, double at, bool lips) {
  const ElasticBody left = played.left();
  std::vector<double> middle(left.nodes.size(), 0), count(left.nodes.size(), 0);
  for (const auto& t : left.tetrahedra)
    for (const std::int32_t n : t)
      for (const std::int32_t other : t)
        middle[static_cast<std::size_t>(n)] += left.nodes[static_cast<std::size_t>(other)][1] - at,
            ++count[static_cast<std::size_t>(n)];
  std::vector<std::pair<std::int32_t, std::int32_t>> pairs;
  const auto nodes = static_cast<std::int32_t>(left.nodes.size());
  for (auto n = static_cast<std::int32_t>(played.of.body.nodes.size()); lips && n < nodes; ++n)
    for (std::int32_t m = 0; m < n; ++m) {
      if (played.mesh().at_rest(m) != played.mesh().at_rest(n) || count[static_cast<std::size_t>(m)] == 0) continue;
      const bool above = middle[static_cast<std::size_t>(n)] > middle[static_cast<std::size_t>(m)];
      pairs.emplace_back(above ? n : m, above ? m : n);
    }
  std::vector<std::int32_t> listed;
  for (const HeldNode& one : held) listed.push_back(one.node);
  for (const auto& [a, b] : pairs) listed.push_back(a), listed.push_back(b);
  const FactoredBody now(left, element);
  const Eigen::MatrixXd c = now.columns(listed);
  const auto grips = static_cast<Eigen::Index>(3 * held.size()), rows = grips + static_cast<Eigen::Index>(pairs.size());
  Eigen::MatrixXd of = Eigen::MatrixXd::Zero(rows, 3 * static_cast<Eigen::Index>(listed.size()));
  VectorXd target = VectorXd::Zero(rows), r = VectorXd::Zero(rows);
  for (Eigen::Index i = 0; i < grips; ++i) of(i, i) = 1, target[i] = held[static_cast<std::size_t>(i / 3)].at[i % 3];
  for (Eigen::Index p = grips; p < rows; ++p) {
    const Eigen::Index first = static_cast<Eigen::Index>(held.size()) + 2 * (p - grips);
    of(p, 3 * first + 1) = 1, of(p, 3 * first + 4) = -1;
  }
  Eigen::MatrixXd all(3 * listed.size(), 3 * listed.size());
  for (std::size_t i = 0; i < listed.size(); ++i)
    all.middleRows<3>(3 * static_cast<Eigen::Index>(i)) = c.middleRows<3>(3 * static_cast<Eigen::Index>(listed[i]));
  const Eigen::MatrixXd w = of * all * of.transpose();
  for (int sweep = 0; sweep < 20000; ++sweep)
    for (Eigen::Index i = 0; i < rows; ++i) {
      r[i] += (target[i] - w.row(i).dot(r)) / w(i, i);
      if (i >= grips) r[i] = std::max(0.0, r[i]);
    }
  SqueezedTruth truth;
  truth.u = c * of.transpose() * r;
  for (std::size_t g = 0; g < held.size(); ++g) truth.grip.push_back(r.segment<3>(3 * static_cast<Eigen::Index>(g)));
  truth.lips = r.tail(rows - grips).sum();
  truth.gap = rows > grips ? (w * r).tail(rows - grips).minCoeff() : 0;
  return truth;
}

// m: the largest difference of a surface node in use from a field of the cut mesh's nodes.
double off_by(Played& played, const VectorXd& right) {
  const std::vector<float> shape = played.positions();
  double worst = 0;
  for (const auto& t : played.triangles())
    for (const std::int32_t n : t) {
      const auto rest = played.of.body.nodes[static_cast<std::size_t>(played.mesh().at_rest(played.in_mesh(n)))];
      for (int i = 0; i < 3; ++i)
        worst = std::max(worst, std::abs(static_cast<double>(shape[static_cast<std::size_t>(3 * n + i)]) -
                                         rest[static_cast<std::size_t>(i)] - right[3 * played.in_mesh(n) + i]));
    }
  return worst;
}

// Of the last step, the pairs of nodes across a cut that press on one another.
std::int32_t lips_that_press(Played& played) {
  std::int32_t count = 0;
  for (std::int32_t e = 0; e < played.contacts->node_count; ++e) {
    const palpate_contact_node& node = played.contacts.nodes()[e];
    count += node.source == PALPATE_SOURCE_LIP && node.node == node.index && Vector3d(node.force).norm() > 1e-9;
  }
  return count;
}

SceneDef lips_def(SceneDef def) {
  def.cut.cut_lips = 200;
  return def;
}

// Two grips squeeze a block that is cut between them, in a plane of the mesh and beside one, where the lips have teeth of half an edge. The force is nearly that of the
// frictionless contact of smooth lips, and 3 times that of lips that pass through one another (p1; p1-anp hardly gives way in volume).
void press_lips() {
  for (const Element element : {Element::p1, Element::p1_anp})
    for (const double at : {0.025, 0.022}) {
      SCOPED_TRACE(name_of(element) + std::string(at == 0.022 ? ", teeth" : ", smooth"));
      Played played(block(element), lips_def(cut_def()));
      played.cut(0.035, at);
      const std::int32_t above = nearest(played, {0.08, 0.05, 0.02}, at, 1),
                         below = nearest(played, {0.08, 0, 0.02}, at, -1);
      const Vector3d up(0, -0.004, 0.001), down(0, 0.004, 0);
      palpate_grip grips[2] = {grip_at_node(above, up), grip_at_node(below, down)};
      for (int s = 0; s < 30; ++s) ASSERT_EQ(played.touch({puller(grips[0], 1), puller(grips[1], 2)}), 0u) << s;
      const std::vector<HeldNode> held = {{played.in_mesh(above), up}, {played.in_mesh(below), down}};
      const SqueezedTruth right = squeezed(played, held, element, at, true),
                          through = squeezed(played, held, element, at, false);
      // It is the body's own field under these forces, which are nearly the right ones.
      EXPECT_LT(off_by(played, FactoredBody(played.left(), element).solve(force_of(played))), 1e-4 * 0.004);
      EXPECT_LT(off_by(played, right.u), (at == 0.022 ? 0.15 : 0.04) * 0.004);
      for (std::size_t g = 0; g < 2; ++g) {
        const Vector3d f(palpate_contacts_tool(played.contacts.get(), static_cast<std::int32_t>(g))->force_raw);
        EXPECT_LT((f + right.grip[g]).norm(), 0.04 * right.grip[g].norm());
        EXPECT_GT(f.norm(), (element == Element::p1 ? 2.5 : 1.1) * through.grip[g].norm());
      }
      EXPECT_GT(right.gap, -1e-9);
      EXPECT_GT(right.lips, 0.09);
      // Let go, it comes back to rest; drawn apart, the lips have no force.
      for (int s = 0; s < 20; ++s) ASSERT_EQ(played.touch({}), 0u);
      for (const float u : played.positions()) ASSERT_TRUE(std::isfinite(u));
      EXPECT_LT(off_by(played, VectorXd::Zero(3 * played.mesh().nodes())), 1e-8);
      for (palpate_grip& grip : grips) grip.displacement[1] *= -1;
      for (int s = 0; s < 20; ++s) ASSERT_EQ(played.touch({puller(grips[0], 1), puller(grips[1], 2)}), 0u) << s;
      EXPECT_EQ(lips_that_press(played), 0);
    }
}
TEST(CutScene, LipsThatArePressedTogetherDoNotPassThroughOneAnother) {
  press_lips();
}

// Without a blade, the effect changes nothing beyond rounding.
TEST(CutScene, BeforeTheFirstCutItIsTheUncutOrgan) {
  SceneDef plain = cut_def();
  plain.cut.cut = PALPATE_CUT_OFF;
  Played cut(block(Element::p1)), uncut(block(Element::p1), plain);
  const Vector3d at(0.04, 0.025, 0.0405);
  for (int s = 0; s < 60; ++s) {
    const Vector3d p = at - Vector3d(0, 0, 1e-4 * s);
    const palpate_tool tool = point_tool(p.data(), 1);
    ASSERT_EQ(cut.touch({tool}), uncut.touch({tool}));
  }
  const Vector3d a(palpate_contacts_tool(cut.contacts, 0)->force_raw),
      b(palpate_contacts_tool(uncut.contacts, 0)->force_raw);
  EXPECT_GT(b.norm(), 0.01);
  EXPECT_LT((a - b).norm(), 1e-6 * b.norm());
}

// ---- pieces, removal -------------------------------------------------------------------------------------------------

// Of both elements, linear and large.
std::vector<std::pair<Element, SceneDef>> kinds() {
  return {{Element::p1, cut_def()},
          {Element::p1_anp, cut_def()},
          {Element::p1, large_def()},
          {Element::p1_anp, large_def()},
          {Element::p1, large_def(PALPATE_DEFORMATION_LARGE_BESIDE)},
          {Element::p1_anp, large_def(PALPATE_DEFORMATION_LARGE_RENEWED)}};
}

TEST(CutScene, APieceThatComesOffIsToldAndStaysWhereAGripDrawsIt) {
  for (const auto& [element, def] : kinds()) {
    Played played(block(element), def);
    for (double y = -0.01; y < 0.06; y += 0.001) {
      const double points[12] = {0.045, y, -0.01, 0.045, y, 0.01, 0.045, y, 0.03, 0.045, y, 0.05};
      palpate_blade blade = palpate_default_blade();
      blade.points = points, blade.point_count = 4;
      ASSERT_EQ(palpate_scene_set_blade(played.scene.get(), 0, &blade, nullptr), PALPATE_OK);
      ASSERT_EQ(played.touch() & ~PALPATE_STEP_DEFORMATION_BEHIND, 0u);
      ASSERT_EQ(played.surface_fault(), "");
    }
    EXPECT_GE(played.state().pieces, 2) << name_of(element);
    EXPECT_EQ(played.state().is_full, 0) << name_of(element);
    EXPECT_EQ(played.state().waiting, 0) << name_of(element);
    // 50 x 40 mm; faces lie zigzag about the plane.
    EXPECT_GT(played.state().area, 0.9 * 0.05 * 0.04);
    EXPECT_LT(played.state().area, 2.5 * 0.05 * 0.04);
    played.withdraw();
    palpate_grip grip = grip_at_node(nearest(played, {0.08, 0.025, 0.02}, -1, 1), {0.02, 0, 0});
    for (int s = 0; s < (def.large.deformation ? 200 : 1); ++s) played.touch({puller(grip, 1)});
    const std::vector<float> shape = played.positions();
    EXPECT_NEAR(shape[3 * static_cast<std::size_t>(grip.node)], 0.1, 2e-3);
    const double drawn = Vector3d(palpate_contacts_tool(played.contacts, 0)->force_raw).norm();
    EXPECT_LT(drawn, 0.5) << "springs alone hold it";
    EXPECT_GT(drawn, 0.01);
  }
}

// The lobe lies on its foundation alone, which a blade has divided, and whose edge is removed.
void cut_a_lobe_off() {
  for (const Element element : {Element::p1, Element::p1_anp}) {
    Played played(standing_block(element));
    for (double y = -0.01; y < 0.06; y += 0.001) {
      const double points[6] = {0.045, y, -0.01, 0.045, y, 0.05};
      palpate_blade blade = palpate_default_blade();
      blade.points = points, blade.point_count = 2;
      ASSERT_EQ(palpate_scene_set_blade(played.scene.get(), 0, &blade, nullptr), PALPATE_OK);
      ASSERT_EQ(played.touch(), 0u);
    }
    played.withdraw();
    const double corner[3] = {0.078, 0.048, 0.002};
    ASSERT_EQ(palpate_scene_remove_tissue(played.scene.get(), corner, 0.012, 0, 0, nullptr), PALPATE_OK);
    ASSERT_EQ(played.touch(), 0u);
    EXPECT_GT(played.state().removed, 0);
    EXPECT_GE(played.state().pieces, 2);
    EXPECT_EQ(played.state().is_full, 0);
    const std::int32_t drawn = nearest(played, {0.08, 0.025, 0.02}, -1, 1);
    palpate_grip grip = grip_at_node(drawn, {0.004, 0.001, 0.002});
    for (int s = 0; s < 3; ++s) ASSERT_EQ(played.touch({puller(grip, 1)}), 0u);
    // What hangs on nothing stays where it is.
    ElasticBody left = played.left();
    std::set<std::int32_t> is_held;
    const MeshPieces& pieces = played.mesh().pieces();
    int held = 0;
    for (std::int32_t i = 0; i < pieces.count(); ++i) held += pieces.piece(i).is_held;
    EXPECT_EQ(held, 2);
    for (std::size_t e = 0; e < played.of.body.tetrahedra.size(); ++e) {
      const auto t = static_cast<std::int32_t>(e);
      if (!played.mesh().is_removed(t) && pieces.piece(pieces.piece_of(t)).is_held)
        is_held.insert(played.mesh().nodes_of(t), played.mesh().nodes_of(t) + 4);
    }
    for (std::int32_t n = 0; n < played.mesh().nodes(); ++n)
      if (!is_held.contains(n)) left.fixed[static_cast<std::size_t>(n)] = {1, 1, 1};
    const HeldError found = held_error(played, left, element, 0.025, 0);
    EXPECT_LT(found.field, 1e-4) << name_of(element);
    const VectorXd field = FactoredBody(left, element).solve(force_of(played));
    for (int i = 0; i < 3; ++i)
      EXPECT_NEAR(field[3 * played.in_mesh(drawn) + i], grip.displacement[i], 1e-6) << name_of(element);
  }
}
TEST(CutScene, ALobeThatIsCutOffLiesOnItsFoundation) {
  cut_a_lobe_off();
}

TEST(CutScene, RemovedTissueLeavesAClosedSurfaceAndASofterOrgan) {
  for (const auto& [element, def] : kinds()) {
    Played played(block(element), def);
    palpate_grip grip = grip_at_node(nearest(played, {0.08, 0.025, 0.02}, -1, 1), {0, 0, -0.004});
    const auto settle = [&] {
      for (int s = 0; s < (def.large.deformation > PALPATE_DEFORMATION_LARGE ? 20 : 1); ++s)
        ASSERT_EQ(played.touch({puller(grip, 1)}) & ~PALPATE_STEP_DEFORMATION_BEHIND, 0u);
    };
    settle();
    const double before = Vector3d(palpate_contacts_tool(played.contacts, 0)->force_raw).norm();
    for (int s = 0; s < 6; ++s) {
      const double centre[3] = {0.04, 0.02 + 0.002 * s, 0.04};
      palpate_error error = {};
      ASSERT_EQ(palpate_scene_remove_tissue(played.scene.get(), centre, 0.009, 0, 0, &error), PALPATE_OK) << error.text;
      settle();
      ASSERT_EQ(played.surface_fault(), "") << s;
    }
    EXPECT_GT(played.state().removed, 10) << name_of(element);
    EXPECT_EQ(played.state().is_full, 0) << name_of(element);
    const double after = Vector3d(palpate_contacts_tool(played.contacts, 0)->force_raw).norm();
    EXPECT_LT(after, 0.99 * before);
    EXPECT_GT(after, 0.2 * before);
  }
}

// A hook that goes along the surface: tissue that it stays at for as long as it needs goes, and what it passes sooner stays. A saved state has the times.
TEST(CutScene, TissueThatIsRemovedByTimeGoesWhereTheHookStays) {
  Played played(block(Element::p1));
  const auto hold = [](Played& hooked, double x, int steps) {
    const double centre[3] = {x, 0.05, 0.02};
    for (int s = 0; s < steps; ++s) {
      ASSERT_EQ(palpate_scene_remove_tissue(hooked.scene.get(), centre, 0.009, 1e-3, 0.02, nullptr), PALPATE_OK);
      ASSERT_EQ(hooked.touch(), 0u);
    }
  };
  hold(played, 0.07, 15), hold(played, 0.04, 19);
  EXPECT_EQ(played.state().removed, 0);
  std::vector<std::uint64_t> saved(palpate_scene_state_bytes(played.scene.get()) / 8 + 1);
  ASSERT_EQ(palpate_scene_save(played.scene.get(), saved.data(), 8 * saved.size(), nullptr), PALPATE_OK);
  hold(played, 0.04, 2);
  const std::int32_t removed = played.state().removed;
  EXPECT_GT(removed, 3);
  EXPECT_EQ(played.surface_fault(), "");
  hold(played, 0.07, 4);
  EXPECT_EQ(played.state().removed, removed);
  hold(played, 0.07, 1);
  EXPECT_GT(played.state().removed, removed);
  Played other(block(Element::p1));
  ASSERT_EQ(palpate_scene_restore(other.scene.get(), saved.data(), 8 * saved.size(), nullptr), PALPATE_OK);
  hold(other, 0.04, 2);
  EXPECT_EQ(other.state().removed, removed);
  palpate_scene_reset(other.scene.get());
  hold(other, 0.04, 2);
  EXPECT_EQ(other.state().removed, 0);
}

// ---- resistance ------------------------------------------------------------------------------------------------------

TEST(CutScene, TheWorkOfABladeIsItsAreaTimesToughnessAndBelowItsForceNothingIsCut) {
  constexpr double toughness = 40;  // J/m^2
  Played played(block(Element::p1_anp));
  double most = 0, work = 0, before = 0.1;
  bool cut_before_limit = false;
  for (double x = 0.09; x > 0.03; x -= 2.5e-4) {
    played.blade(x, 0.025, toughness, 0.0, 0.04);
    ASSERT_EQ(played.touch(), 0u) << x;
    const palpate_blade_state& blade = *palpate_scene_blade_state(played.scene.get(), 0);
    most = std::max(most, blade.force[0]);
    work += blade.force[0] * (before - x), before = x;
    cut_before_limit = cut_before_limit || (blade.work == 0 && played.state().faces > 0);
  }
  const palpate_blade_state& blade = *palpate_scene_blade_state(played.scene.get(), 0);
  EXPECT_FALSE(cut_before_limit);
  EXPECT_GT(played.state().faces, 0);
  EXPECT_GT(blade.area, 5e-4);
  EXPECT_NEAR(blade.work, toughness * blade.area, 1e-9);
  // The edge is 40 mm long.
  EXPECT_LT(most, 1.01 * toughness * 0.04);
  EXPECT_GT(most, 0.8 * toughness * 0.04);
  // What the hand has done beyond the work of cutting is in the pressed tissue, or was lost as it sprang back.
  EXPECT_GT(work, blade.work);
}

// In, drawn up and down along the edge, and back until it feels nothing: the hand has done the work of cutting and of rubbing, and little else.
TEST(CutScene, TheWorkOfABladeIsItsAreaTimesToughnessAndThatOfFriction) {
  constexpr double toughness = 10, friction = 150, width = 0.02, step = 1e-4;  // J/m^2, Pa, m
  for (const bool is_large : {false, true}) {
    SceneDef def = cut_def();
    if (is_large) def.large.deformation = PALPATE_DEFORMATION_LARGE, def.max_operations = 100'000'000;
    Played played(block(Element::p1_anp), def);
    const palpate_blade_state& blade = *palpate_scene_blade_state(played.scene.get(), 0);
    Vector3d last(0.09, 0, 0), force = Vector3d::Zero();
    double work = 0, most = 0, most_along = 0;
    const auto move = [&](double x, double z) {
      played.blade(x, 0.025, toughness, z, z + 0.04, friction, width);
      const palpate_step_flags flags = played.touch();
      ASSERT_EQ(flags & ~PALPATE_STEP_DEFORMATION_BEHIND, 0u) << x << " " << z;
      const Vector3d at(x, 0, z), felt(blade.force);
      work += 0.5 * (force + felt).dot(last - at), last = at, force = felt;
    };
    for (double x = 0.09; x > 0.03; x -= step) move(x, 0), most = std::max(most, force[0]);
    const double forwards = blade.friction_work;
    for (int s = 0; s < 4; ++s)
      for (int k = 0; k < 80; ++k) {
        move(last[0], last[2] + (s % 3 == 0 ? step : -step));
        most_along = std::max(most_along, std::fabs(force[2]));
      }
    const double along = blade.friction_work - forwards;
    while (force[0] > 0 && last[0] < 0.08) move(last[0] + step, last[2]);
    EXPECT_NEAR(blade.work, toughness * blade.area, 1e-9);
    EXPECT_GT(forwards, 0.3 * blade.work);
    EXPECT_GT(along, 1e-4);
    EXPECT_NEAR(work, blade.work + blade.friction_work, 0.05 * work) << is_large;
    // The edge is 40 mm long, with two flanks.
    const double rubbing = 2 * friction * width * 0.04;
    EXPECT_LT(most, 1.01 * (toughness * 0.04 + rubbing));
    EXPECT_GT(most, 0.8 * (toughness * 0.04 + rubbing));
    EXPECT_LT(most_along, 1.01 * rubbing);
    EXPECT_GT(most_along, 0.8 * rubbing);
  }
}

// Two edges that turn about a pin towards one another, as scissors: each holds the tissue for the other.
TEST(CutScene, ScissorsCutWhatIsBetweenTheirEdgesAndDoNotPushTheOrgan) {
  constexpr double toughness = 10, open = 0.6, step = 4e-3;  // J/m^2, rad
  for (const bool is_large : {false, true}) {
    SceneDef def = cut_def();
    if (is_large) def.large.deformation = PALPATE_DEFORMATION_LARGE, def.max_operations = 100'000'000;
    Played played(block(Element::p1_anp), def);
    const palpate_blade_state* const edges[] = {palpate_scene_blade_state(played.scene.get(), 0),
                                                palpate_scene_blade_state(played.scene.get(), 1)};
    double last = open, moment = 0, work = 0, most = 0, most_on_organ = 0;
    const auto turn = [&](double angle) {
      for (int k = 0; k < 2; ++k) {
        const double up = k == 0 ? 1 : -1;
        std::vector<double> points;
        for (int i = 0; i < 4; ++i) {
          const double along = 0.015 * i;
          points.insert(points.end(), {0.085 - along * std::cos(angle), 0.025, 0.02 + up * along * std::sin(angle)});
        }
        palpate_blade blade = palpate_default_blade();
        blade.points = points.data(), blade.point_count = 4, blade.toughness = toughness;
        blade.direction[0] = -std::sin(angle), blade.direction[2] = -up * std::cos(angle);
        ASSERT_EQ(palpate_scene_set_blade(played.scene.get(), k, &blade, nullptr), PALPATE_OK);
      }
      ASSERT_EQ(played.touch() & ~PALPATE_STEP_DEFORMATION_BEHIND, 0u) << angle;
      // About the pin, the first point of both; what closes them works against it.
      const double felt = edges[0]->torque[1] - edges[1]->torque[1];
      work += 0.5 * (moment + felt) * (last - angle), last = angle, moment = felt;
      most = std::max(most, std::fabs(edges[0]->force[2]));
      most_on_organ = std::max(most_on_organ, std::fabs(edges[0]->force[2] + edges[1]->force[2]));
    };
    for (double angle = open; angle > 0; angle -= step) turn(angle);
    while (std::fabs(moment) > 1e-6 && last < 0.3) turn(last + step);
    const double area = edges[0]->area + edges[1]->area, cutting = edges[0]->work + edges[1]->work;
    EXPECT_NEAR(cutting, toughness * area, 1e-9);
    // Of the sector between the edges, 45 mm long, what lies in the block.
    EXPECT_GT(area, 8e-4);
    EXPECT_LT(area, open * 0.045 * 0.045);
    EXPECT_GT(played.state().faces, 0);
    EXPECT_NEAR(work, cutting, 0.05 * work) << is_large;
    EXPECT_LT(most_on_organ, 0.1 * most) << is_large;
  }
}

// ---- contacts --------------------------------------------------------------------------------------------------------

TEST(CutScene, ALipIsTouched) {
  Played played(block(Element::p1));
  played.cut(0.03);
  palpate_grip up = grip_at_node(nearest(played, {0.08, 0.05, 0.02}, 0.025, 1), {0, 0.012, 0});
  const palpate_tool holder = puller(up, 1);
  for (int s = 0; s < 3; ++s) ASSERT_EQ(played.touch({holder}), 0u);
  // Into the opened cut from the free end, then against the lip that was not drawn.
  Vector3d p(0.09, 0.029, 0.02);
  int met = -1;
  for (int s = 0; s < 200; ++s) {
    p += s < 100 ? Vector3d(-2e-4, 0, 0) : Vector3d(0, -1e-4, 0);
    palpate_tool probe = point_tool(p.data(), 1);
    probe.id = 7;
    ASSERT_EQ(played.touch({holder, probe}), 0u) << s;
    if (met < 0 && palpate_contacts_tool(played.contacts, 1)->contact_count > 0) met = s;
  }
  EXPECT_GT(met, 90);
  EXPECT_GT(palpate_contacts_tool(played.contacts, 1)->force_raw[1], 0.001) << "the lip pushes back";
}

// A disc is held while a blade cuts beside it, so that its triangles get other nodes: it then acts as one that comes after the cut, and after a
// reset as one on a new organ.
TEST(CutScene, ADiscThatIsHeldHasTheNodesOfWhatIsLeft) {
  SceneDef def = cut_def();
  def.contact = PALPATE_CONTACT_PATCH;
  for (const Element element : {Element::p1, Element::p1_anp}) {
    Played before(block(element), def), after(block(element), def);
    palpate_grip grip = grip_at_place(triangle_nearest(before, {0.055, 0.031, 0.04}), {0.4, 0.3, 0.3}, {0, 0, 0});
    const auto held = [&] {
      palpate_tool tool = puller(grip, 1);
      tool.disc_radius = 0.004;
      return tool;
    };
    const auto expect_same = [&](Played& one, Played& other, const char* when) {
      grip.displacement[0] = 0.001, grip.displacement[2] = 0.003;
      ASSERT_EQ(one.touch({held()}), 0u);
      ASSERT_EQ(other.touch({held()}), 0u);
      ASSERT_EQ(one.contacts->node_count, other.contacts->node_count) << when;
      for (std::int32_t e = 0; e < one.contacts->node_count; ++e) {
        const palpate_contact_node &a = one.contacts.nodes()[e], &b = other.contacts.nodes()[e];
        EXPECT_EQ(a.node, b.node) << when;
        EXPECT_LT((Vector3d(a.force) - Vector3d(b.force)).norm(), 1e-9) << when;
      }
      EXPECT_GT(Vector3d(palpate_contacts_tool(one.contacts, 0)->force_raw).norm(), 0.01);
    };
    before.cut(0.03, 0.025, {held()});
    after.cut(0.03);
    expect_same(before, after, "after the cut");
    palpate_scene_reset(before.scene.get());
    Played fresh(block(element), def);
    expect_same(before, fresh, "after a reset");
  }
}

// ---- large deformation -----------------------------------------------------------------------------------------------

// Newton's method on the mesh that is left, in the scene's state. Nodes that no tetrahedron has are held.
struct LeftBody {
  static LargeBody body_of(const Played& played, Element element) {
    ElasticBody left = played.left();
    std::vector<char> has(left.nodes.size());
    for (const auto& t : left.tetrahedra)
      for (const std::int32_t n : t) has[static_cast<std::size_t>(n)] = 1;
    for (std::size_t n = 0; n < has.size(); ++n)
      if (!has[n]) left.fixed[n] = {1, 1, 1};
    return LargeBody(std::move(left), element);
  }
  LeftBody(const Played& from, Element element) : played(from), large(body_of(from, element)), newton(large.get()) {}

  // m, the largest difference of the scene's field from that of the rows that hold, over the largest displacement; and that of the forces.
  struct Errors {
    double field = 0, force = 0, largest = 0;
  };
  static double reaction_of(const Played& of, std::int32_t p) {
    const TouchState& touch = of.scene->touch;
    return touch.body->reaction(touch, p).x;
  }
  // grips: of single nodes, all that acts but for lips that press.
  Errors errors(Played& of, const std::vector<const palpate_grip*>& grips) const {
    const ContactConstraints& set = of.scene->touch.rows.set();
    std::vector<std::int32_t> pressed;
    for (std::int32_t p = 0; p < set.constraint_count; ++p)
      if (set.constraints[p].id.contact.source == kLipSource && reaction_of(of, p) > 1e-9) pressed.push_back(p);
    const auto held = static_cast<Eigen::Index>(3 * grips.size()),
               count = held + static_cast<Eigen::Index>(pressed.size());
    Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(count, newton.dofs());
    VectorXd place = VectorXd::Zero(count), carried = VectorXd::Zero(count), right = VectorXd::Zero(newton.dofs());
    for (Eigen::Index i = held; i < count; ++i) {
      const std::int32_t p = pressed[static_cast<std::size_t>(i - held)];
      const ContactConstraint& lip = set.constraints[p];
      for (std::int32_t e = lip.first_node; e < lip.first_node + lip.node_count; ++e)
        for (int d = 0; d < 3; ++d)
          rows(i, 3 * of.in_mesh(set.nodes[e].node) + d) = set.nodes[e].weight * lip.frame.m[0][d];
      place[i] = set.target[p].x, carried[i] = reaction_of(of, p);
    }
    for (Eigen::Index i = 0; i < held; ++i) {
      const palpate_grip& grip = *grips[static_cast<std::size_t>(i / 3)];
      rows(i, 3 * of.in_mesh(grip.node) + i % 3) = 1, place[i] = grip.displacement[i % 3];
      for (std::int32_t e = 0; e < of.contacts->node_count; ++e)
        if (of.contacts.nodes()[e].node == grip.node) carried[i] += of.contacts.nodes()[e].force[i % 3];
    }
    // Along the way, as the scene came there.
    VectorXd lambda;
    for (int s = 1; s <= 4; ++s) lambda = newton.solve(rows, s / 4.0 * place, &right);
    Errors found;
    const std::vector<float> shape = of.positions();
    std::set<std::int32_t> shown;
    for (const auto& t : large.elastic().tetrahedra)
      for (const std::int32_t own : t)
        if (const std::int32_t n = of.in_scene(own); n < of.shaped_nodes()) shown.insert(n);
    for (const std::int32_t n : shown)
      for (std::size_t i = 0; i < 3; ++i) {
        const std::int32_t own = of.in_mesh(n);
        const double u = static_cast<double>(shape[3 * static_cast<std::size_t>(n) + i]) -
                         of.of.body.nodes[static_cast<std::size_t>(of.mesh().at_rest(own))][i];
        const double truth = right[3 * own + static_cast<Eigen::Index>(i)];
        found.field = std::max(found.field, std::abs(u - truth)),
        found.largest = std::max(found.largest, std::abs(truth));
      }
    found.field /= found.largest;
    found.force = (lambda - carried).norm() / lambda.norm();
    return found;
  }
  const Played& played;
  LargeBody large;
  LargeReference newton;
};

struct LargeKind {
  Element element;
  palpate_deformation_model as;
  bool is_beside() const { return as != PALPATE_DEFORMATION_LARGE; }
};
constexpr LargeKind kLargeKinds[] = {{Element::p1, PALPATE_DEFORMATION_LARGE},
                                     {Element::p1_anp, PALPATE_DEFORMATION_LARGE},
                                     {Element::p1_anp, PALPATE_DEFORMATION_LARGE_BESIDE},
                                     {Element::p1_anp, PALPATE_DEFORMATION_LARGE_RENEWED}};

// A flap is drawn up by 30 mm at 0.1 m/s, on a path that the uncut body could not follow.
TEST(CutScene, AFlapIsDrawnUpUnderLargeDeformation) {
  for (const LargeKind& kind : kLargeKinds) {
    SCOPED_TRACE(kind.as);
    const Element element = kind.element;
    Played played(block(element), large_def(kind.as));
    played.cut(0.03);
    EXPECT_GT(played.state().nodes, 10);
    palpate_grip up = grip_at_node(nearest(played, {0.08, 0.05, 0.02}, 0.025, 1), {0, 0, 0}),
                 down = grip_at_node(nearest(played, {0.08, 0, 0.02}, 0.025, -1), {0, 0, 0});
    const LeftBody left(played, element);
    double field = 0, force = 0;
    int flagged = 0;
    for (int s = 1; s <= 300; ++s) {
      up.displacement[1] = 1e-4 * s, up.displacement[2] = 5e-5 * s, down.displacement[1] = -3e-5 * s;
      const palpate_step_flags flags = played.touch({puller(up, 1), puller(down, 2)});
      flagged += flags != 0;
      if (s % 150 != 0) continue;
      const LeftBody::Errors errors = left.errors(played, {&up, &down});
      EXPECT_GT(errors.largest, 0.9e-4 * s);
      field = std::max(field, errors.field), force = std::max(force, errors.force);
    }
    EXPECT_LT(field, 0.01) << name_of(element);
    EXPECT_LT(force, 0.02) << name_of(element);
    EXPECT_LE(flagged, kind.is_beside() ? 30 : 0);
  }
}

// Nodes inside, of which the region of the cut has some.
TEST(CutScene, TheInteriorFollowsACutUnderLargeDeformation) {
  SceneDef def = large_def();
  def.shape = PALPATE_SHAPE_VOLUME;
  const Block part(Inputs(Element::p1_anp, {9, 6, 5}));
  Played played(part, def);
  ASSERT_GT(played.shaped_nodes(), played.surface_nodes());
  ASSERT_EQ(played.touch(), 0u);
  const std::vector<float> at_rest = played.positions();
  for (std::size_t i = 3 * static_cast<std::size_t>(played.surface_nodes()); i < at_rest.size(); ++i)
    ASSERT_EQ(at_rest[i], static_cast<float>(part.body.nodes[i / 3][i % 3])) << i;
  played.cut(0.055);
  EXPECT_GT(played.state().nodes, 5);
  palpate_grip up = grip_at_node(nearest(played, {0.08, 0.05, 0.02}, 0.025, 1), {0, 0, 0});
  const LeftBody left(played, Element::p1_anp);
  for (int s = 1; s <= 200; ++s) {
    up.displacement[1] = 1e-4 * s, up.displacement[2] = 5e-5 * s;
    EXPECT_EQ(played.touch({puller(up, 1)}), 0u) << s;
  }
  const LeftBody::Errors errors = left.errors(played, {&up});
  EXPECT_GT(errors.largest, 0.0199);
  EXPECT_LT(errors.field, 0.01);
  EXPECT_LT(errors.force, 0.02);
}

// A squeezed cut against Newton's method on the mesh that is left, with the rows of the lips that press as equations.
TEST(CutScene, LipsPressOnOneAnotherUnderLargeDeformation) {
  for (const LargeKind& kind : kLargeKinds) {
    SCOPED_TRACE(kind.as);
    const Element element = kind.element;
    Played played(block(element), lips_def(large_def(kind.as)));
    played.cut(0.03, 0.022);
    palpate_grip up = grip_at_node(nearest(played, {0.08, 0.05, 0.02}, 0.022, 1), {0, 0, 0}),
                 down = grip_at_node(nearest(played, {0.08, 0, 0.02}, 0.022, -1), {0, 0, 0});
    int flagged = 0;
    for (int s = 1; s <= 120; ++s) {
      const double far = 1e-4 * std::min(s, kind.element == Element::p1 ? 50 : 80);
      up.displacement[1] = -far, up.displacement[0] = 0.5 * far, down.displacement[1] = far;
      flagged += played.touch({puller(up, 1), puller(down, 2)}) != 0;
    }
    const LeftBody left(played, element);
    const LeftBody::Errors errors = left.errors(played, {&up, &down});
    EXPECT_GT(lips_that_press(played), 8);
    EXPECT_LT(errors.field, 0.01) << name_of(element);
    EXPECT_LT(errors.force, 0.02) << name_of(element);
    EXPECT_LE(flagged, kind.is_beside() ? 30 : 0);
  }
}

// Tissue that stiffens is drawn so far that the linear organ would have 40 times its energy, and is cut through in one step. It opens with the solution of the
// cut mesh, and not before.
TEST(CutScene, StiffTissueOpensWithTheSolutionOfTheCutMesh) {
  const Block stiff(Inputs(Element::p1, {10, 6, 5}, kAll, Inputs::kBesideTheCut, 20));
  Played played(stiff, large_def(PALPATE_DEFORMATION_LARGE_BESIDE));
  std::vector<palpate_grip> ends;
  for (const double y : {0.0, 0.05})
    for (const double z : {0.0, 0.04})
      ends.push_back(grip_at_node(nearest(played, {0.08, y, z}, 0.025, y > 0.025 ? 1 : -1), {0, 0, 0}));
  std::vector<palpate_tool> tools;
  for (std::size_t k = 0; k < ends.size(); ++k) tools.push_back(puller(ends[k], static_cast<std::int32_t>(k)));
  const auto draw = [&](int steps, double x, double y) {
    palpate_step_flags flags = 0;
    for (int s = 0; s < steps; ++s) {
      for (std::size_t k = 0; k < ends.size(); ++k)
        ends[k].displacement[0] += x / steps, ends[k].displacement[1] += (k < 2 ? -y : y) / steps;
      flags = played.touch(tools);
    }
    return flags;
  };
  draw(100, 0.04, 0);
  draw(100, 0, 0.01);
  const std::vector<float> before = played.positions();
  played.blade(0.15, 0.025, 0, -0.05, 0.1);
  played.touch(tools);
  played.blade(0.03, 0.025, 0, -0.05, 0.1);
  played.solves_beside = false;
  draw(3, 0, 0);
  EXPECT_GT(played.state().faces, 20);
  const auto farthest = [&] {
    const std::vector<float> now = played.positions();
    double most = 0;
    for (std::size_t i = 0; i < 3 * static_cast<std::size_t>(stiff.body.surface_count - stiff.body.reserve); ++i)
      most = std::max(most, std::abs(static_cast<double>(now[i] - before[i])));
    return most;
  };
  EXPECT_LT(farthest(), 1e-3);
  played.solves_beside = true;
  const palpate_step_flags flags = draw(60, 0, 0);
  EXPECT_EQ(flags, 0u);
  EXPECT_EQ(played.surface_fault(), "");
  EXPECT_GT(farthest(), 2e-3);
}

// While tissue is drawn, a blade goes on cutting it; then all lets go, and it comes back to rest.
TEST(CutScene, DrawnTissueIsCutUnderLargeDeformation) {
  for (std::size_t k = 0; k < 2 * std::size(kLargeKinds); ++k) {
    const LargeKind& kind = kLargeKinds[k / 2];
    SceneDef def = large_def(kind.as);
    if (k % 2 == 0) def.cut.cut_lips = 0;
    SCOPED_TRACE(std::to_string(kind.as) + (k % 2 ? ", lips press" : ""));
    const Element element = kind.element;
    Played played(block(element), def);
    palpate_grip up = grip_at_node(nearest(played, {0.08, 0.05, 0.04}, 0.025, 1), {0, 0, 0}),
                 down = grip_at_node(nearest(played, {0.08, 0, 0}, 0.025, -1), {0, 0, 0});
    for (int s = 1; s <= 100; ++s) {
      up.displacement[1] = 1e-4 * s, down.displacement[1] = -1e-4 * s;
      played.touch({puller(up, 1), puller(down, 2)});
    }
    const double before = Vector3d(palpate_contacts_tool(played.contacts, 0)->force_raw).norm();
    int flagged = 0, steps = 0;
    for (double x = 0.1; x > 0.03; x -= 2e-4, ++steps) {
      played.blade(x, 0.025);
      flagged += played.touch({puller(up, 1), puller(down, 2)}) != 0;
      ASSERT_EQ(played.surface_fault(), "") << x;
    }
    played.withdraw();
    for (int s = 0; s < 20; ++s) played.touch({puller(up, 1), puller(down, 2)});
    EXPECT_GT(played.state().nodes, 10);
    const LeftBody::Errors errors = LeftBody(played, element).errors(played, {&up, &down});
    EXPECT_LT(errors.field, 0.01) << name_of(element);
    EXPECT_LT(errors.force, 0.02) << name_of(element);
    const double after = Vector3d(palpate_contacts_tool(played.contacts, 0)->force_raw).norm();
    EXPECT_LT(after, (k % 2 ? 0.9 : 0.8) * before) << "what is cut is softer; lips that press bear a part";
    for (int s = 0; s < 300; ++s) played.touch();
    const std::vector<float> shape = played.positions();
    for (const auto& t : played.triangles())
      for (const std::int32_t n : t)
        for (std::size_t i = 0; i < 3; ++i)
          ASSERT_NEAR(static_cast<double>(shape[3 * static_cast<std::size_t>(n) + i]),
                      played.of.body.nodes[static_cast<std::size_t>(played.mesh().at_rest(played.in_mesh(n)))][i],
                      1e-5);
  }
}

// ---- loads -----------------------------------------------------------------------------------------------------------

// What moves the block from outside (Inputs).
struct Outside {
  Vector3d acceleration{0, 1.5, -1};  // m/s^2
  double pressure = 30;               // Pa
  double below = 0.006;               // m
  // In 80 steps.
  void act(Played& played, int step) const {
    const double share = std::min(1.0, step / 80.0);
    const double amounts[5] = {share * acceleration[0], share * acceleration[1], share * acceleration[2],
                               share * pressure, share * below};
    ASSERT_EQ(palpate_scene_set_motions(played.scene.get(), amounts, 5, nullptr), PALPATE_OK);
    ASSERT_EQ(played.touch() & ~PALPATE_STEP_DEFORMATION_BEHIND, 0u) << step;
  }
  // N, on what is left, as it is displaced.
  VectorXd on(const ElasticBody& left, const VectorXd& u) const {
    VectorXd force = VectorXd::Zero(u.size());
    const auto rest = [&](std::int32_t n) { return Vector3d(left.nodes[static_cast<std::size_t>(n)].data()); };
    for (const auto& t : left.tetrahedra) {
      const Vector3d a = rest(t[1]) - rest(t[0]), b = rest(t[2]) - rest(t[0]), c = rest(t[3]) - rest(t[0]);
      for (const std::int32_t n : t) force.segment<3>(3 * n) += 1000 * std::abs(a.cross(b).dot(c)) / 24 * acceleration;
    }
    for (const auto& t : left.triangles) {
      if (std::ranges::any_of(t, [&](std::int32_t n) { return rest(n)[2] < 0.04 - 1e-9; })) continue;
      const auto now = [&](std::size_t v) { return Vector3d(rest(t[v]) + u.segment<3>(3 * t[v])); };
      for (const std::int32_t n : t) force.segment<3>(3 * n) -= pressure / 6 * (now(1) - now(0)).cross(now(2) - now(0));
    }
    const Vector3d moved = below * Vector3d(0.3, 0.2, 1).normalized();
    for (const auto& foundation : left.foundations)
      for (const std::int32_t triangle : foundation.triangles) {
        const auto& t = left.triangles[static_cast<std::size_t>(triangle)];
        const double area = (rest(t[1]) - rest(t[0])).cross(rest(t[2]) - rest(t[0])).norm() / 2;
        for (const std::int32_t a : t)
          for (const std::int32_t b : t)
            if (rest(b)[0] > 0.002) force.segment<3>(3 * a) += 1e4 * area / 12 * (a == b ? 2 : 1) * moved;
      }
    return force;
  }
};

struct RemovedBall {
  double x, y, radius, z[2];  // m: above and below
  double off;                 // of a linear organ, of the largest displacement
};
// Where nodes split, what is left of their tetrahedra and triangles has its own weight, its own pressure and its own part of a foundation that moves. What
// is removed takes its own along.
void compare_outside(const RemovedBall& ball) {
  const Outside outside;
  for (auto& [element, def] : kinds()) {
    if (Rebases::rank > 0 && def.large.deformation != PALPATE_DEFORMATION_LINEAR) continue;
    SCOPED_TRACE(std::string(name_of(element)) + " " + std::to_string(def.large.deformation));
    SceneDef moved = def;
    moved.motions.motions = 1, moved.cut.cut_lips = 0;
    Played played(standing_block(element), moved);
    played.cut(0.03);
    for (const double z : ball.z) {
      const double centre[3] = {ball.x, ball.y, z};
      ASSERT_EQ(palpate_scene_remove_tissue(played.scene.get(), centre, ball.radius, 0, 0, nullptr), PALPATE_OK);
      ASSERT_EQ(played.touch() & ~PALPATE_STEP_DEFORMATION_BEHIND, 0u);
    }
    EXPECT_GT(played.state().removed, 6);
    EXPECT_EQ(played.state().pieces, 1);
    for (int s = 1; s <= 100; ++s) outside.act(played, s);
    const ElasticBody left = played.left();
    VectorXd right = VectorXd::Zero(3 * static_cast<Eigen::Index>(left.nodes.size()));
    const bool large = def.large.deformation != PALPATE_DEFORMATION_LINEAR;
    const LeftBody newton(played, element);
    for (int i = 0; i < 8 && large; ++i) newton.newton.balance(outside.on(left, right), &right);
    if (!large) right = FactoredBody(left, element).solve(outside.on(left, right));
    const std::vector<float> shape = played.positions();
    double off = 0, farthest = 0;
    for (const auto& t : played.triangles())
      for (const std::int32_t n : t)
        for (int i = 0; i < 3; ++i) {
          const std::int32_t own = played.in_mesh(n);
          const double u = static_cast<double>(shape[static_cast<std::size_t>(3 * n + i)]) -
                           left.nodes[static_cast<std::size_t>(own)][static_cast<std::size_t>(i)];
          off = std::max(off, std::abs(u - right[3 * own + i]));
          farthest = std::max(farthest, std::abs(right[3 * own + i]));
        }
    EXPECT_GT(farthest, 0.005);
    EXPECT_LT(off, (large ? 1e-3 : ball.off) * farthest);
  }
}
TEST(CutScene, EachLipBearsItsOwnPartOfWhatActsFromOutside) {
  compare_outside({0.06, 0.0125, 0.0055, {0.038, 0.002}, 1e-5});
}
// The bundle of a linear organ does not say which triangles of a node at an edge bear a pressure: all of them count.
TEST(CutScene, TissueThatIsRemovedAtAnEdgeTakesItsLoadsAlong) {
  compare_outside({0.062, 0.012, 0.014, {0.04, 0}, 0.01});
}

// ---- states ----------------------------------------------------------------------------------------------------------

constexpr std::int32_t kFewOperations = 20'000;  // some changes wait for the next step

void save_and_restore(palpate_deformation_model as, std::int32_t operations = kFewOperations) {
  SceneDef def = holding_def();
  if (as != PALPATE_DEFORMATION_LINEAR) def.large.deformation = as;
  int rebasing = 0;  // states that were saved meanwhile
  def.cut.cut_operations = operations;
  Played one(block(Element::p1_anp), def), two(block(Element::p1_anp), def);
  palpate_link link = palpate_default_link();
  link.kind = PALPATE_LINK_THREAD, link.rest_length = 0.004;
  for (int e = 0; e < 2; ++e) {
    link.ends[e].kind = PALPATE_END_SURFACE_POINT, link.ends[e].barycentric[0] = link.ends[e].barycentric[1] = 0.5;
    link.ends[e].triangle = triangle_near(one.of.body, 0.07, e ? 0.03 : 0.02, 0.025, e ? 1 : -1);
  }
  const auto sew = [&](Played& played) {
    palpate_error error = {};
    EXPECT_EQ(palpate_scene_set_links(played.scene.get(), &link, 1, &error), PALPATE_OK) << error.text;
  };
  palpate_grasp jaws = palpate_default_grasp();
  jaws.triangle = triangle_near(one.of.body, 0.06, 0.028, 0.025, 1), jaws.radius = 0.005, jaws.barycentric[0] = 1;
  const auto step = [&jaws](Played& played, int s) {
    palpate_grasp now = jaws;
    now.position[1] = 3e-5 * s;
    palpate_tool forceps = palpate_default_tool();
    forceps.id = 9, forceps.parts = &now.part;
    played.blade(0.09 - 4e-4 * s, 0.025, s < 60 ? 0 : 30);
    const Vector3d p(0.06, 0.02, 0.0405 - 5e-5 * s);
    const palpate_tool probe = point_tool(p.data(), 1);
    return played.touch({probe, forceps});
  };
  sew(one), sew(two);
  const auto bytes = [](const Played& played) {
    return std::string(reinterpret_cast<const char*>(played.contacts.get()), played.contacts->used_bytes);
  };
  bool waited = false;
  for (int s = 0; s < 160; ++s) {
    step(one, s);
    if (operations > kFewOperations ? s % 2 == 1 : s % 23 == 7) {
      std::vector<std::uint64_t> state(palpate_scene_state_bytes(one.scene.get()) / 8);
      palpate_error error = {};
      rebasing += one.state().rebasing;
      ASSERT_EQ(palpate_scene_save(one.scene.get(), state.data(), 8 * state.size(), &error), PALPATE_OK) << error.text;
      ASSERT_EQ(palpate_scene_restore(two.scene.get(), state.data(), 8 * state.size(), &error), PALPATE_OK)
          << error.text;
    } else if (s > 7) {
      step(two, s);
      ASSERT_EQ(bytes(one), bytes(two)) << s;
      ASSERT_EQ(one.triangles(), two.triangles()) << s;
      ASSERT_EQ(std::memcmp(&one.state(), &two.state(), sizeof one.state()), 0) << s;
    }
    waited = waited || one.state().left > 0;
  }
  EXPECT_TRUE(waited || operations > kFewOperations);
  EXPECT_GT(one.state().nodes, 5);
  if (Rebases::rank > 0) {
    EXPECT_GT(rebasing, 1);
    EXPECT_GT(one.state().rebased, 1);
  }
  palpate_scene_reset(one.scene.get());
  EXPECT_EQ(one.state().nodes, 0);
  EXPECT_EQ(one.triangles().size(), one.of.body.triangles.size());
  Played fresh(block(Element::p1_anp), def);
  sew(fresh);
  for (int s = 0; s < 90; ++s) {
    step(one, s), step(fresh, s);
    ASSERT_EQ(bytes(one), bytes(fresh)) << s;
  }
}
TEST(CutScene, ASavedStateGoesOnWithTheSameBitsAndAResetSceneIsNew) {
  save_and_restore(PALPATE_DEFORMATION_LINEAR);
  save_and_restore(PALPATE_DEFORMATION_LINEAR, 200'000);  // a step takes several
}
TEST(CutScene, ASavedStateUnderLargeDeformationGoesOnWithTheSameBitsAndAResetSceneIsNew) {
  for (const palpate_deformation_model as : kLarge) {
    SCOPED_TRACE(as);
    save_and_restore(as);
  }
}

// ---- re-basing -------------------------------------------------------------------------------------------------------

TEST(CutScene, ARebasedOrganIsThatOfTheStiffnessFactoredAnew) {
  const Rebases at(30);
  compare_opened_cut();
  cut_a_lobe_off();
}
TEST(CutScene, WhatWasHeldIsHeldWhereTheComplianceIsRebased) {
  const Rebases at(30);
  hold_a_side_with_jaws();
  hold_triangles_with_links();
  hold_lips_with_an_obstacle();
  press_lips();
}
TEST(CutScene, ARebasedOrganBearsWhatActsFromOutside) {
  const Rebases at(30);
  compare_outside({0.06, 0.0125, 0.0055, {0.038, 0.002}, 1e-5});
}
TEST(CutScene, ASavedStateGoesOnWhileTheComplianceIsRebased) {
  const Rebases at(24);
  save_and_restore(PALPATE_DEFORMATION_LINEAR, 150'000);
}

// Within few operations of each step, while a blade cuts and a tool presses: beside a scene that never re-bases, in each step.
TEST(CutScene, RebasingDoesNotShowWhileItGoesOn) {
  for (const Element element : {Element::p1, Element::p1_anp}) {
    SceneDef def = cut_def();
    def.cut.cut_operations = 500'000;
    Played plain(block(element), def);
    def.cut.cut_rebase = 40;
    Played rebased(block(element), def);
    int meanwhile = 0;
    double worst = 0, most = 0;
    for (int s = 0; s < 400; ++s) {
      const Vector3d p(0.06 + 2e-5 * s, 0.012, 0.0405 - 1e-5 * s);
      const palpate_tool probe = point_tool(p.data(), 1);
      const std::int32_t nodes = rebased.state().nodes;
      const bool was = rebased.state().rebasing;
      for (Played* played : {&plain, &rebased}) {
        played->blade(0.09 - 1.5e-4 * s, 0.025);
        ASSERT_EQ(played->touch({probe}), 0u) << s;
      }
      ASSERT_EQ(plain.triangles(), rebased.triangles()) << s;
      meanwhile += was && rebased.state().nodes > nodes;
      const auto force = [](Played& of) { return Vector3d(palpate_contacts_tool(of.contacts, 0)->force_raw); };
      worst = std::max(worst, (force(plain) - force(rebased)).norm()), most = std::max(most, force(plain).norm());
      const std::vector<float> a = plain.positions(), b = rebased.positions();
      for (std::size_t i = 0; i < a.size(); ++i) ASSERT_NEAR(a[i], b[i], 1e-6) << s;
    }
    EXPECT_GT(meanwhile, 3) << "new nodes while it is re-based";
    EXPECT_GE(rebased.state().rebased, 2);
    EXPECT_LT(rebased.state().rank, plain.state().rank / 2);
    EXPECT_LT(worst, 1e-5 * most);
  }
}

TEST(CutScene, RebasingMakesRoomWhereTheRankIsFull) {
  SceneDef def = cut_def();
  def.cut.cut_rank = 60;
  Played full(block(Element::p1_anp), def);
  full.cut(0.03);
  EXPECT_EQ(full.state().is_full, 1);
  for (const std::int32_t operations : {20'000, 1'000'000'000}) {
    def.cut.cut_rebase = 30, def.cut.cut_operations = operations;
    Played rebased(block(Element::p1_anp), def);
    for (int s = 0; s < 5000 && (s < 70 || rebased.state().left > 0 || rebased.state().rebasing); ++s) {
      rebased.blade(std::max(0.0305, 0.09 - 1e-3 * s), 0.025);
      ASSERT_EQ(rebased.touch(), 0u) << s;
    }
    EXPECT_EQ(rebased.state().is_full, 0);
    EXPECT_EQ(rebased.state().left, 0);
    EXPECT_GT(rebased.state().nodes, full.state().nodes + 10);
    EXPECT_GT(rebased.state().rebased, 3);
    Played whole(block(Element::p1_anp));
    whole.cut(0.03);
    EXPECT_EQ(whole.state().nodes, rebased.state().nodes);
  }
}

// A scene's surface against the body that is left under the forces of its contact nodes. False where there are pieces, which springs of the scene hold,
// or the scene shows less than the mesh has.
bool compare(RandomCutScene& scene, const Block& of, Element element) {
  const palpate_cut_state& state = scene.state();
  if (state.pieces > 1 || state.left > 0 || state.is_full || (scene.flags & PALPATE_STEP_UNSOLVED)) return false;
  const CutMesh& mesh = cut_mesh_of(*scene.scene());
  VectorXd force = VectorXd::Zero(3 * mesh.nodes());
  for (std::int32_t e = 0; e < scene.told()->node_count; ++e) {
    const palpate_contact_node& node = *palpate_contacts_node(scene.told(), e);
    force.segment<3>(3 * in_mesh_of(of.body, node.node)) += Vector3d(node.force);
  }
  const VectorXd right = FactoredBody(left_of(of.body, mesh), element).solve(force);
  const double scale = std::max(1e-4, right.cwiseAbs().maxCoeff());
  const std::vector<float>& shape = scene.positions();
  double worst = 0;
  for (const std::int32_t n : scene.nodes_in_use()) {
    const std::int32_t own = in_mesh_of(of.body, n);
    const auto& rest = of.body.nodes[static_cast<std::size_t>(mesh.at_rest(own))];
    for (std::size_t d = 0; d < 3; ++d)
      worst = std::max(worst, std::abs(static_cast<double>(shape[static_cast<std::size_t>(3 * n) + d]) - rest[d] -
                                       right[3 * own + static_cast<Eigen::Index>(d)]));
  }
  EXPECT_LT(worst, 1e-4 * scale);
  return true;
}

void play_random_scenes(std::uint64_t first, std::uint64_t end, palpate_deformation_model as) {
  long faces = 0, removed = 0, pieces = 0, compared = 0;
  for (std::uint64_t seed = first; seed < end; ++seed) {
    const Element element = seed % 2 ? Element::p1 : Element::p1_anp;
    RandomCutScene scene((seed % 4 < 2 ? block(element) : standing_block(element)).bundle.get(), seed, as);
    for (int s = 0; s < 150; ++s) ASSERT_EQ(scene.step(), "") << "seed " << seed << ", step " << s;
    if (as == PALPATE_DEFORMATION_LINEAR)
      compared += compare(scene, seed % 4 < 2 ? block(element) : standing_block(element), element);
    ASSERT_EQ(scene.let_go(), "") << "seed " << seed;
    faces += scene.state().faces, removed += scene.state().removed, pieces += scene.state().pieces - 1;
  }
  EXPECT_GT(faces, 100);
  if (as == PALPATE_DEFORMATION_LINEAR) {
    EXPECT_GT(compared, 3);
  }
  EXPECT_GT(removed, 20);
  EXPECT_GT(pieces, 0);
}
TEST(CutScene, RandomScenesStayClosedFiniteAndComeBackToRest) {
  play_random_scenes(0, 12, PALPATE_DEFORMATION_LINEAR);
}
TEST(CutScene, RandomScenesUnderLargeDeformationStayClosedFiniteAndComeBackToRest) {
  for (const palpate_deformation_model as : kLarge) play_random_scenes(100, 112, as);
}

TEST(CutScene, BadInputIsRefused) {
  Played played(block(Element::p1));
  const double points[6] = {0, 0, 0, 0, 0, INFINITY};
  palpate_blade blade = palpate_default_blade();
  palpate_error error = {};
  blade.points = points, blade.point_count = 2;
  EXPECT_EQ(palpate_scene_set_blade(played.scene.get(), 0, &blade, &error), PALPATE_ERROR_ARGUMENT);
  EXPECT_THAT(error.text, ::testing::HasSubstr("1e6 m"));
  blade.point_count = 1;
  EXPECT_EQ(palpate_scene_set_blade(played.scene.get(), 0, &blade, &error), PALPATE_ERROR_ARGUMENT);
  blade.point_count = 0;
  EXPECT_EQ(palpate_scene_set_blade(played.scene.get(), PALPATE_MAX_BLADES, &blade, &error), PALPATE_ERROR_ARGUMENT);
  EXPECT_EQ(palpate_scene_remove_tissue(played.scene.get(), points, 0, 0, 0, &error), PALPATE_ERROR_ARGUMENT);
  EXPECT_EQ(palpate_scene_blade_state(played.scene.get(), -1), nullptr);
  SceneDef plain = cut_def();
  plain.cut.cut = PALPATE_CUT_OFF;
  Played uncut(block(Element::p1), plain);
  EXPECT_EQ(palpate_scene_cut_state(uncut.scene.get()), nullptr);
  EXPECT_EQ(palpate_scene_set_blade(uncut.scene.get(), 0, &blade, &error), PALPATE_ERROR_ARGUMENT);
  // Re-basing is of the linear organ, and begins below the rank that is there.
  for (SceneDef wrong : {large_def(), large_def(PALPATE_DEFORMATION_LARGE_BESIDE), cut_def()}) {
    wrong.cut.cut_rebase = wrong.large.deformation == PALPATE_DEFORMATION_LINEAR ? 600 : 300;
    palpate_scene* made = nullptr;
    EXPECT_EQ(palpate_scene_create(block(Element::p1).bundle.get(), &wrong, &made, &error), PALPATE_ERROR_ARGUMENT);
    EXPECT_THAT(error.text, ::testing::HasSubstr("cut_rebase"));
  }
  // A bundle without a region.
  palpate_scene* created = nullptr;
  const SceneDef def = cut_def();
  EXPECT_EQ(palpate_scene_create(tiny_box().bundle(), &def, &created, &error), PALPATE_ERROR_EFFECT);
  EXPECT_THAT(error.text, ::testing::HasSubstr("cut"));
}

}  // namespace
}  // namespace palpate::tests
