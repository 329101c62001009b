// Cuts that meet themselves and one another, end inside, pass supports, discs and jaws, leave slivers, come at 2 m/s or go to and fro in place.
#include <map>
#include <set>

#include "runtime/cut/effect.h"
#include "runtime/scene/scene.h"
#include "tests/stability/conflict.h"
#include "tests/stability/held_places.h"
#include "tests/stability/stability_case.h"
#include "tests/support/box_corridor.h"

namespace palpate::tests {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr std::int32_t kReserve = 120;
constexpr double kCell = 0.01;  // m

// 80 x 50 x 40 mm, held at x = 0, all of which may be cut.
const DenseBody& dense_organ() {
  static const DenseBody dense = box_that_can_be_cut(kReserve, {.cells = {8, 5, 4}, .size = {0.08, 0.05, 0.04}});
  return dense;
}
const TouchedBody& organ() {
  static const TouchedBody body(dense_organ(),
                                [](BundleParts& parts) { add_cut_region(parts, dense_organ(), kReserve); });
  return body;
}

// cut_lips of the scenes that are made next. Each case is played with 0, and with the default.
std::int32_t lips_of_cuts = 0;

SceneDef cutting_def() {
  SceneDef def =
      unlimited_def(PALPATE_COLLISION_DEFORMED, PALPATE_CONTACT_PATCH, PALPATE_SHAPE_SURFACE, PALPATE_LAW_COULOMB);
  def.torque_limit = def.torque_slew = INFINITY, def.grasps.grasps = 1, def.max_tools = 4;
  def.cut.cut = PALPATE_CUT_ON, def.cut.cut_rank = 900, def.cut.cut_operations = 1'000'000'000;
  def.cut.cut_lips = lips_of_cuts;
  return def;
}

std::int32_t nearest_node(const Vector3d& p) {
  const std::vector<std::int32_t>& nodes = organ().touchable;
  return *std::min_element(nodes.begin(), nodes.end(), [&](std::int32_t a, std::int32_t b) {
    return (organ().node(a) - p).norm() < (organ().node(b) - p).norm();
  });
}

// A scene in which a blade cuts, and what its steps told.
class Cutting {
 public:
  // The free end is drawn by two of its corners, apart and upwards, by some millimetres.
  void draw() {
    for (const auto& [place, way] : {std::pair<Vector3d, Vector3d>{{0.08, 0.05, 0.04}, {0.002, 0.003, 0.0015}},
                                     {{0.08, 0, 0.04}, {0.002, -0.003, -0.001}}})
      grips_.push_back(grip_at_node(nearest_node(place), way));
    step();
    begin_watch();
  }
  // Grips of single nodes, moved to these displacements in a step. Returns the work that they do, J.
  double move(const std::vector<std::pair<std::int32_t, Vector3d>>& nodes) {
    const auto force_on = [&](std::int32_t node) {
      Vector3d sum = Vector3d::Zero();
      const palpate_contacts& contacts = *scene_.contacts.get();
      for (std::int32_t e = 0; e < contacts.node_count; ++e)
        if (const palpate_contact_node& at = *palpate_contacts_node(&contacts, e);
            at.source == PALPATE_SOURCE_TOOL && at.node == node)
          sum += Vector3d(at.force);
      return sum;
    };
    std::vector<Vector3d> before, way;
    for (std::size_t g = 0; g < nodes.size(); ++g) {
      const bool was = g < grips_.size();
      before.push_back(was ? force_on(nodes[g].first) : Vector3d::Zero());
      way.push_back(nodes[g].second - (was ? Vector3d(grips_[g].displacement) : Vector3d::Zero()));
    }
    grips_.clear();
    for (const auto& [node, displacement] : nodes) grips_.push_back(grip_at_node(node, displacement));
    step();
    double work = 0;
    for (std::size_t g = 0; g < nodes.size(); ++g) work += 0.5 * (before[g] + force_on(nodes[g].first)).dot(way[g]);
    return work;
  }
  // The pairs of lips that press.
  std::int32_t pressing() const {
    std::int32_t count = 0;
    const palpate_contacts& contacts = *scene_.contacts.get();
    for (std::int32_t e = 0; e < contacts.node_count; ++e) {
      const palpate_contact_node& at = *palpate_contacts_node(&contacts, e);
      count += at.source == PALPATE_SOURCE_LIP && at.node == at.index && Vector3d(at.force).norm() > 1e-9;
    }
    return count;
  }
  void press(const Vector3d& p) { finger_ = p, presses_ = true; }
  // A disc of 6 mm around the place on top that is nearest to p, whose mean displacement is `way`.
  void hold_disc(const Vector3d& p, const Vector3d& way) {
    const FacePlace place = face_place(organ(), {0, 0, 1}, p);
    grips_ = {grip_at_place(place.triangle, Vector3d(place.barycentric), way)}, disc_ = 0.006;
    step();
  }
  void grasp(const palpate_grasp& jaws) { jaws_ = jaws, grasps_ = true; }
  void move_jaws(const Vector3d& by) { Eigen::Map<Vector3d>(jaws_.position) += by; }
  // The blade's edge from `low` to `high`; goes from there to the other place, by `speed` m in a step.
  void stroke(const Vector3d& low, const Vector3d& high, const Vector3d& way, double speed, double toughness = 0) {
    const int steps = static_cast<int>(std::ceil(way.norm() / speed));
    for (int s = 0; s <= steps; ++s) {
      set_blade(low + way * s / steps, high + way * s / steps, way.normalized(), toughness);
      step();
    }
  }
  void withdraw() {
    const palpate_blade none = palpate_default_blade();
    palpate_scene_set_blade(scene_.get(), 0, &none, nullptr);
    step();
  }
  void let_go() {
    grips_.clear();
    presses_ = grasps_ = false;
    withdraw();
    for (int s = 0; s < 3; ++s) step();
  }
  void set_blade(const Vector3d& low, const Vector3d& high, const Vector3d& ahead, double toughness = 0) {
    const Vector3d points[] = {low, 0.5 * (low + high), high};
    palpate_blade blade = palpate_default_blade();
    blade.points = points[0].data(), blade.point_count = 3, blade.toughness = toughness;
    Eigen::Map<Vector3d>(blade.direction) = ahead;
    ASSERT_EQ(palpate_scene_set_blade(scene_.get(), 0, &blade, nullptr), PALPATE_OK);
  }

  void step() {
    std::vector<palpate_tool> tools;
    if (!grips_.empty()) tools.push_back(tool_of(grips_)), tools.back().disc_radius = disc_;
    if (presses_) tools.push_back(point_tool(finger_.data(), 1, 0.006, 0.3)), tools.back().id = 5;
    if (grasps_) {
      tools.push_back(palpate_default_tool());
      tools.back().parts = &jaws_.part, tools.back().has_torque = 1, tools.back().id = 6;
    }
    flags |= scene_.touch(tools);
    watch(tools.size());
  }

  // Bounds that each case keeps. way: m, the largest that a tool asks for. tools_move: they do work, and the energy may rise.
  void hold(StabilityCase& stability, double way, bool tools_move = false) {
    stability.hold("surfaces that are open or not manifold", faults, 0, "what may be cut is chosen so");
    stability.hold("force, N", most_force, stiffest(organ()) * way,
                   "the stiffest node's own block of K times the largest way asked for");
    stability.hold("displacement, m", most_way, 0.08, "the size of the organ");
    if (!presses_ && !tools_move)
      stability.hold("energy that comes from nowhere in a step, of the most that is stored", most_rise / most_energy,
                     lips_of_cuts > 0 ? 0.02 : 1e-6,
                     lips_of_cuts > 0
                         ? "the direction in which lips press is that of all their faces: it turns as a cut grows"
                         : "tools stand still, and what is left is softer: rounding of single precision");
    stability.hold("flags", flags & ~(presses_ ? kOfConflict : 0u), 0, "nothing is wrong with the input");
    stability.hold("the rank or the nodes in reserve have ended", state().is_full, 0, "both have room for these cuts");
  }
  void hold_rest(StabilityCase& stability) {
    let_go();
    measure();
    double off = 0;
    for (const std::int32_t n : used_) keep(moved(n).norm(), &off);
    stability.hold("displacement when all have let go, m", off, 1e-8, "positions of 80 mm in single precision");
  }
  // The field under the step's own forces, against the mesh that is left, factored anew.
  void hold_full_solve(StabilityCase& stability) {
    ASSERT_EQ(state().left, 0);
    measure();
    VectorXd force = VectorXd::Zero(organ().dofs());
    const palpate_contacts& contacts = *scene_.contacts.get();
    for (std::int32_t e = 0; e < contacts.node_count; ++e) {
      const palpate_contact_node& node = *palpate_contacts_node(&contacts, e);
      force.segment<3>(3 * node.node) += Vector3d(node.force);
    }
    const VectorXd right = compliance_left() * force;
    double worst = 0;
    const std::set<std::int32_t> loose = nodes_of_loose_pieces();
    for (const std::int32_t n : used_)
      if (!loose.contains(n)) keep((moved(n) - right.segment<3>(3 * n)).norm(), &worst);
    stability.hold("field against a full solve of what is left, of the largest displacement",
                   worst / right.cwiseAbs().maxCoeff(), 1e-4,
                   "columns in single precision, and a rank of some hundreds (docs/accuracy.md, Cuts)");
  }

  // What tools have done before does not count.
  void begin_watch() { most_energy = energy_, most_rise = 0; }
  const palpate_cut_state& state() const { return *palpate_scene_cut_state(scene_.get()); }
  const palpate_blade_state& blade() const { return *palpate_scene_blade_state(scene_.get(), 0); }
  double energy() const { return energy_; }
  Vector3d force_of(std::int32_t tool) const { return scene_.force(tool); }
  std::vector<std::array<std::int32_t, 3>> triangles() const {
    std::vector<std::array<std::int32_t, 3>> found(
        static_cast<std::size_t>(palpate_scene_cut_surface(scene_.get(), nullptr, nullptr, 0)));
    palpate_scene_cut_surface(scene_.get(), found[0].data(), nullptr, static_cast<std::int32_t>(found.size()));
    return found;
  }
  double faults = 0, most_force = 0, most_way = 0, most_energy = 0, most_rise = 0;
  palpate_step_flags flags = 0;

  // Triangles of lips all of whose nodes lie between the support and x.
  int lips_below(double x) {
    std::vector<std::uint8_t> is_lip(triangles().size());
    palpate_scene_cut_surface(scene_.get(), nullptr, is_lip.data(), static_cast<std::int32_t>(is_lip.size()));
    measure();
    int count = 0;
    for (std::size_t t = 0; t < is_lip.size(); ++t) {
      const auto nodes = triangles()[t];
      count += is_lip[t] &&
               std::all_of(nodes.begin(), nodes.end(), [&](std::int32_t n) { return organ().node(at_rest(n))[0] < x; });
    }
    return count;
  }

 private:
  void watch(std::size_t tools) {
    for (std::size_t t = 0; t < tools; ++t) keep(scene_.force(static_cast<std::int32_t>(t)).norm(), &most_force);
    for (const double f : blade().force) keep(std::fabs(f), &most_force);
    measure();
    faults += !is_manifold();
    for (const std::int32_t n : used_) keep(moved(n).norm(), &most_way);
    const double before = energy_;
    energy_ = stored();
    keep(energy_, &most_energy), keep(energy_ - before, &most_rise);
  }
  // J: of the mesh, and of what it does not resolve below discs and jaws.
  double stored() const {
    double sum = 0;
    const TouchState& touch = scene_.get()->touch;
    const ContactConstraints& set = touch.rows.set();
    for (std::int32_t e = 0; e < set.node_count; ++e) {
      const Vec3 f = touch.force[e];
      sum += 0.5 * Vector3d(f.x, f.y, f.z).dot(moved(set.nodes[e].node));
    }
    for (std::int32_t p = 0; p < set.constraint_count; ++p) {
      const ContactConstraint& constraint = set.constraints[p];
      const ContactNode* const first = set.nodes + constraint.first_node;
      const ContactNode* const heaviest = std::max_element(
          first, first + constraint.node_count,
          [](const ContactNode& a, const ContactNode& b) { return std::fabs(a.weight) < std::fabs(b.weight); });
      const Vec3 along = (1 / heaviest->weight) * touch.force[heaviest - set.nodes],
                 r = constraint.framed ? constraint.frame * along : along;
      sum += 0.5 * dot(r, constraint.local * r);
    }
    return sum;
  }
  // The surface, and where its nodes are.
  void measure() {
    used_.clear();
    for (const auto& t : triangles()) used_.insert(t.begin(), t.end());
    const std::int32_t nodes = organ().body.surface_nodes;
    positions_.resize(3 * static_cast<std::size_t>(nodes));
    const palpate_shape_out out = shape_out(nullptr, positions_.data(), nodes);
    palpate_shape_out to = out;
    flags |= palpate_scene_shape(scene_.get(), scene_.contacts, &to);
    const std::int32_t made = palpate_scene_cut_nodes(scene_.get(), nullptr, 0);
    std::vector<std::int32_t> pairs(2 * static_cast<std::size_t>(made));
    palpate_scene_cut_nodes(scene_.get(), pairs.data(), made);
    from_.clear();
    for (std::size_t i = 0; i < pairs.size(); i += 2) from_[pairs[i]] = pairs[i + 1];
  }
  std::int32_t at_rest(std::int32_t node) const {
    const auto from = from_.find(node);
    return from == from_.end() ? node : from->second;
  }
  Vector3d moved(std::int32_t node) const {
    return Eigen::Map<const Eigen::Vector3f>(&positions_[3 * static_cast<std::size_t>(node)]).cast<double>() -
           organ().node(at_rest(node));
  }
  // Each edge has a triangle on either side, and the triangles at each node follow one another round it.
  bool is_manifold() const {
    std::map<std::int32_t, std::map<std::int32_t, std::int32_t>> next;
    for (const auto& t : triangles())
      for (std::size_t v = 0; v < 3; ++v)
        if (!next[t[v]].emplace(t[(v + 1) % 3], t[(v + 2) % 3]).second) return false;
    for (const auto& [node, fan] : next) {
      std::size_t passed = 0;
      std::int32_t at = fan.begin()->first;
      do {
        const auto after = fan.find(at);
        if (after == fan.end() || ++passed > fan.size()) return false;
        at = after->second;
      } while (at != fan.begin()->first);
      if (passed != fan.size()) return false;
    }
    return true;
  }
  // They hang on weak springs; lips that press may carry them along.
  std::set<std::int32_t> nodes_of_loose_pieces() const {
    const CutMesh& mesh = cut_mesh_of(*scene_.get());
    const auto nodes = static_cast<std::int32_t>(dense_organ().body.mesh.nodes.size());
    std::set<std::int32_t> found;
    for (std::int32_t e = 0; e < static_cast<std::int32_t>(dense_organ().body.mesh.tetrahedra.size()); ++e) {
      if (mesh.pieces().piece(mesh.pieces().piece_of(e)).is_held) continue;
      for (int c = 0; c < 4; ++c) {
        const std::int32_t n = mesh.nodes_of(e)[c];
        found.insert(n < nodes ? n : nodes - kReserve + n - nodes);
      }
    }
    return found;
  }
  // m/N, of the scene's nodes. Nodes that still wait in reserve are held, and so are those of pieces that have come off, on which no tool acts.
  Eigen::MatrixXd compliance_left() const {
    const CutMesh& mesh = cut_mesh_of(*scene_.get());
    DenseBody left = dense_organ();
    const auto nodes = static_cast<std::int32_t>(left.body.mesh.nodes.size());
    const auto in_scene = [&](std::int32_t n) { return n < nodes ? n : nodes - kReserve + n - nodes; };
    for (std::int32_t n = nodes; n < mesh.nodes(); ++n) {
      const auto own = static_cast<std::size_t>(in_scene(n)), from = static_cast<std::size_t>(mesh.at_rest(n));
      left.body.mesh.nodes[own] = left.body.mesh.nodes[from];
      for (std::size_t d = 0; d < 3; ++d) left.fixed[3 * own + d] = left.fixed[3 * from + d];
    }
    for (std::size_t e = 0; e < left.body.mesh.tetrahedra.size(); ++e) {
      const auto own = static_cast<std::int32_t>(e);
      const bool is_held = mesh.pieces().piece(mesh.pieces().piece_of(own)).is_held;
      for (std::size_t c = 0; c < 4; ++c) {
        const std::int32_t node = left.body.mesh.tetrahedra[e][c] = in_scene(mesh.nodes_of(own)[c]);
        for (int d = 0; d < 3 && !is_held; ++d) left.fixed[static_cast<std::size_t>(3 * node + d)] = 1;
      }
    }
    return dense_compliance(left);
  }

  TouchedScene scene_{organ(), cutting_def()};
  std::vector<palpate_grip> grips_;
  Vector3d finger_;
  palpate_grasp jaws_ = palpate_default_grasp();
  bool presses_ = false, grasps_ = false;
  double disc_ = 0;  // m, of grips
  double energy_ = 0;
  std::set<std::int32_t> used_;
  std::vector<float> positions_;
  std::map<std::int32_t, std::int32_t> from_;
};

constexpr double kWay = 0.004;  // m, of draw()

// Edges from inside the organ to above it, and in front of it.
const Vector3d kUp(0, 0, 0.05);
Vector3d edge(double x, double y, double z) {
  return {x, y, z};
}
Vector3d above(Vector3d low) {
  low[2] = kUp[2];
  return low;
}
// Across the organ at x, from z up.
void slit_across(Cutting& cutting, double x, double z, double speed) {
  const Vector3d low = edge(x, -0.005, z);
  cutting.stroke(low, above(low), {0, 0.06, 0}, speed);
  cutting.withdraw();
}
// Along it from the free end to x, at y, from z up.
void slit_along(Cutting& cutting, double x, double y, double z, double speed) {
  const Vector3d low = edge(0.085, y, z);
  cutting.stroke(low, above(low), {x - 0.085, 0, 0}, speed);
  cutting.withdraw();
}

TEST(StabilityCut, AlongItself) {
  StabilityCase stability(
      "A blade goes along its own cut once more: it meets the faces beside the cut, and faces that were left whole so "
      "that the surface stays manifold.");
  for (lips_of_cuts = 0; lips_of_cuts <= 64; lips_of_cuts += 64) {
    for (const double x : {0.045, 0.04, 0.0433}) {
      Cutting cutting;
      slit_across(cutting, x, 0.013, 5e-4);
      const auto faces = cutting.state().faces;
      const auto triangles = cutting.triangles();
      for (int again = 0; again < 3; ++again) slit_across(cutting, x, 0.013, 5e-4);
      const std::string at = ", at " + std::to_string(1e3 * x).substr(0, 4) + " mm";
      stability.hold("faces that were not cut" + at, faces > 10 ? 0 : 1, 0, "the slit is 50 x 27 mm");
      stability.hold("faces that are cut later" + at, cutting.state().faces - faces, 0,
                     "the blade meets what it has cut");
      stability.hold("other triangles" + at, triangles != cutting.triangles(), 0, "nothing has changed");
      cutting.draw();
      cutting.hold_full_solve(stability);
      cutting.hold(stability, kWay);
      cutting.hold_rest(stability);
    }
  }
}

TEST(StabilityCut, MeetsAnotherAsATAndCrossesItAsAnX) {
  StabilityCase stability(
      "Where cuts meet, four lips lie at one line of nodes: each of its nodes is split three times, and a hinge or an "
      "edge with four triangles may be left.");
  for (lips_of_cuts = 0; lips_of_cuts <= 64; lips_of_cuts += 64) {
    for (const double end : {0.045, 0.044, 0.04, 0.012, 0.02}) {
      Cutting cutting;
      cutting.draw();
      slit_across(cutting, 0.0443, 0.014, 5e-4);
      slit_along(cutting, end, 0.0257, 0.017, 5e-4);
      cutting.hold_full_solve(stability);
      cutting.hold(stability, kWay);
      cutting.hold_rest(stability);
    }
  }
}

TEST(StabilityCut, EndsInsideATetrahedron) {
  StabilityCase stability(
      "A cut that ends inside, at its end and below, opens some faces of a tetrahedron and not the others: nodes there "
      "are split though nothing comes apart, or a blade cuts a hollow inside that no surface reaches.");
  for (lips_of_cuts = 0; lips_of_cuts <= 64; lips_of_cuts += 64) {
    for (int k = 0; k < 4; ++k) {
      Cutting cutting;
      cutting.draw();
      slit_along(cutting, 0.0523 - 0.0021 * k, 0.0237 + 0.001 * k, 0.0173 - 0.0011 * k, 5e-4);
      cutting.hold_full_solve(stability);
      // Inside, between the cut and the support: no surface there.
      const Vector3d low = edge(0.02, 0.015, 0.012), high = edge(0.02, 0.015, 0.028);
      cutting.stroke(low, high, {0, 0.02, 0}, 5e-4);
      stability.hold("faces cut inside", cutting.lips_below(0.035), 0, "a cut begins at the surface or at another");
      cutting.withdraw();
      cutting.hold(stability, kWay);
      cutting.hold_rest(stability);
    }
  }
}

TEST(StabilityCut, GoesThroughASupport) {
  StabilityCase stability(
      "A cut that goes on into the support splits nodes that are held: a copy that is not held leaves one side of the "
      "organ without its support.");
  for (lips_of_cuts = 0; lips_of_cuts <= 64; lips_of_cuts += 64) {
    for (const double y : {0.025, 0.02, 0.0283}) {
      Cutting cutting;
      cutting.draw();
      const double before = cutting.energy();
      slit_along(cutting, -0.005, y, 0.012, 5e-4);
      stability.hold("energy that is left, over that before: 1 over it", before / cutting.energy(), 10,
                     "both halves are still held");
      cutting.hold_full_solve(stability);
      cutting.hold(stability, kWay);
      cutting.hold_rest(stability);
    }
  }
}

TEST(StabilityCut, UnderADiscThatPresses) {
  StabilityCase stability(
      "The triangles under a pressed disc get other nodes, or go: the disc keeps weights of nodes that are the other "
      "lip's, and its force jumps.");
  for (lips_of_cuts = 0; lips_of_cuts <= 64; lips_of_cuts += 64) {
    for (const double x : {0.05, 0.047, 0.053, 0.058}) {
      Cutting cutting;
      for (int s = 0; s <= 20; ++s) cutting.press({0.05, 0.025, 0.0405 - 2e-4 * s}), cutting.step();
      const double before = cutting.energy();
      cutting.begin_watch();
      slit_across(cutting, x, 0.013, 5e-4);
      stability.hold(
          "energy over that before the cut, less 1", cutting.most_energy / before - 1, 0.1,
          "the disc has the nodes of its own lip: on each surface its force is within 5 % (docs/method.md, 5)");
      cutting.hold_full_solve(stability);
      cutting.hold(stability, kWay);
      cutting.hold_rest(stability);
    }
    // One that does not slide off, and that does not move the tissue before the cut is made.
    const Vector3d place(0.055, 0.025, 0.04), way(0.001, 0, -0.003);
    Cutting during, after;
    during.hold_disc(place, Vector3d::Zero());
    for (Cutting* const cutting : {&during, &after})
      slit_across(*cutting, 0.05, 0.013, 5e-4), cutting->hold_disc(place, way);
    stability.hold("force of a disc that was there before the cut, against one that comes after it, of the force",
                   (during.force_of(0) - after.force_of(0)).norm() / after.force_of(0).norm(), 1e-9,
                   "the same surface, the same disc: rounding");
  }
}

TEST(StabilityCut, AlongTheEdgeOfAGrasp) {
  StabilityCase stability(
      "Jaws hold tissue that a blade divides along their edge: they keep rows of nodes whose tissue has gone to the "
      "other lip.");
  for (lips_of_cuts = 0; lips_of_cuts <= 64; lips_of_cuts += 64) {
    for (const double x : {0.056, 0.0535, 0.0585}) {
      Cutting cutting;
      cutting.grasp(face_grasp(organ(), {0, 0, 1}, {0.05, 0.025, 0.04}, 0.006));
      for (int s = 0; s < 15; ++s) cutting.step(), cutting.move_jaws({0, 0, 2e-4});
      cutting.step();
      cutting.begin_watch();
      slit_across(cutting, x, 0.013, 5e-4);
      cutting.hold_full_solve(stability);
      cutting.hold(stability, kWay);
      cutting.hold_rest(stability);
    }
  }
}

TEST(StabilityCut, LeavesASliver) {
  StabilityCase stability(
      "Two cuts nearer to one another than an edge leave a leaf of single tetrahedra between them, or pieces of one: "
      "these hang on nothing, and their motion has no stiffness.");
  for (lips_of_cuts = 0; lips_of_cuts <= 64; lips_of_cuts += 64) {
    for (const double apart : {0.001, 0.003, 0.006, 0.009}) {
      Cutting cutting;
      cutting.draw();
      slit_across(cutting, 0.0433, 0.013, 5e-4);
      slit_across(cutting, 0.0433 + apart, 0.013, 5e-4);
      slit_along(cutting, 0.03, 0.0257, 0.017, 5e-4);
      cutting.hold_full_solve(stability);
      cutting.hold(stability, kWay);
      cutting.hold_rest(stability);
    }
  }
}

TEST(StabilityCut, LipsThatArePressedGoPastOneAnother) {
  StabilityCase stability(
      "The lips of a cut are pressed together, drawn along one another and parted: they pass through one another, the "
      "teeth of the mesh hold them, or pairs of nodes that come and go do work.");
  lips_of_cuts = 64;
  for (const double y : {0.025, 0.0223, 0.0277})
    for (const double along : {0.003, 0.006}) {
      Cutting cutting;
      slit_along(cutting, 0.035, y, -0.005, 5e-4);
      const std::int32_t nodes[2] = {nearest_node({0.075, 0.05, 0.02}), nearest_node({0.075, 0, 0.02})};
      // Squeezed, drawn along, let apart there, and back.
      const std::vector<Vector3d> tour = {{0, -0.002, 0},     {along, -0.002, 0.5 * along},   {along, 0.003, 0},
                                          {-along, 0.002, 0}, {-along, -0.002, -0.5 * along}, {0, -0.002, 0}};
      Vector3d at = Vector3d::Zero();
      double net = 0, most = 0;
      std::int32_t pressing = 0;
      // The first leg leads to where the tour begins and ends.
      for (std::size_t leg = 0; leg < tour.size(); ++leg) {
        const int steps = static_cast<int>(std::ceil((tour[leg] - at).norm() / 1e-4));
        for (int s = 1; s <= steps; ++s) {
          const Vector3d way = at + (tour[leg] - at) * s / steps;
          const double work = cutting.move({{nodes[0], way}, {nodes[1], -way}});
          if (leg > 0) net += work;
          keep(cutting.energy(), &most), pressing = std::max(pressing, cutting.pressing());
        }
        at = tour[leg];
        cutting.hold_full_solve(stability);
      }
      stability.hold("pairs of lips that press at most, under 8", pressing < 8, 0, "the lips are pressed together");
      stability.hold("net work of a closed tour, of the most that is stored", std::fabs(net) / most, 0.02,
                     "lips have no friction");
      cutting.hold(stability, 0.007, true);
      cutting.hold_rest(stability);
    }
}

TEST(StabilityCut, AtTwoMetresASecond) {
  StabilityCase stability(
      "At 2 m/s a blade goes 2 mm in a step, and at 20 m/s through two cells: what it passes between two steps must "
      "be cut as well.");
  for (lips_of_cuts = 0; lips_of_cuts <= 64; lips_of_cuts += 64) {
    Cutting slow;
    slit_across(slow, 0.0443, 0.013, 1e-4);
    for (const double speed : {2e-3, 2e-2, 0.06}) {
      Cutting cutting;
      slit_across(cutting, 0.0443, 0.013, speed);
      stability.hold("area over that at 0.1 m/s, less 1", std::fabs(cutting.state().area / slow.state().area - 1), 0.1,
                     "the faces that are nearest to the blade's plane; which faces finish a cut goes by their order");
      cutting.draw();
      cutting.hold_full_solve(stability);
      cutting.hold(stability, kWay);
      cutting.hold_rest(stability);
    }
  }
}

TEST(StabilityCut, BackAndForthInPlace) {
  StabilityCase stability(
      "A blade that trembles in its cut, or saws, meets the same faces in every step: it may cut more each time, or "
      "use up its work.");
  for (lips_of_cuts = 0; lips_of_cuts <= 64; lips_of_cuts += 64) {
    for (const double toughness : {0.0, 10.0}) {
      Cutting cutting;
      slit_along(cutting, 0.05, 0.0257, 0.013, 5e-4);
      const Vector3d low = edge(0.05, 0.0257, 0.013);
      std::int32_t faces = 0;
      for (int k = 0; k < 60; ++k) {
        cutting.stroke(low + edge(0.004, 0, 0), above(low + edge(0.004, 0, 0)), {-0.008, 0, 0}, 1e-3, toughness);
        cutting.stroke(low - edge(0.004, 0, 0), above(low - edge(0.004, 0, 0)), {0.008, 0, 0}, 1e-3, toughness);
        if (k == 1) faces = cutting.state().faces;
      }
      // With toughness, the edge carries tissue along and cuts it little by little: about twice the faces in 45 times.
      if (toughness == 0)
        stability.hold("faces cut after the second time", cutting.state().faces - faces, 0,
                       "the blade meets what it cut");
      stability.hold("lips more than a cell beyond the blade's way", cutting.lips_below(0.046 - kCell), 0,
                     "the faces that are nearest to it are cut");
      cutting.withdraw();
      cutting.draw();
      cutting.hold_full_solve(stability);
      cutting.hold(stability, kWay);
      cutting.hold_rest(stability);
    }
  }
}

}  // namespace
}  // namespace palpate::tests
