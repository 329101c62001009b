#include "tests/effects/referee.h"

#include "runtime/cut/effect.h"
#include "runtime/scene/scene.h"
#include "runtime/surface/surface_tissue.h"
#include "studies/hyperelastic/large_reference.h"
#include "tests/runtime/large/large_scene.h"
#include "tests/support/box_motions.h"
#include "tests/support/crossed_triangles.h"
#include "tests/support/deformed_truth.h"
#include "tests/support/tool_parts.h"

namespace palpate::tests {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kLength = 3e-3;  // m: what errors of places are a share of, about the largest displacement
constexpr double kRaised =
    0.05e-3;  // m, by which a dent may raise the surface beside a disc, where the mesh shows more of it than there is
constexpr double kSlack = 1e-3;    // m, more than any of these scenes has
constexpr double kNoForce = 1e-6;  // N: a force below has no direction

Vec3 vec(const Vector3d& v) {
  return {v[0], v[1], v[2]};
}
Vector3d vector(Vec3 v) {
  return {v.x, v.y, v.z};
}
Vector3d vector(const double* v) {
  return Vector3d(v);
}

bool is_of(const palpate_contact_node& node, palpate_contact_source source, std::int32_t index) {
  return node.source == source && node.index == index;
}

Eigen::Quaterniond turn_of(const palpate_grasp& grasp) {
  return {grasp.orientation[0], grasp.orientation[1], grasp.orientation[2], grasp.orientation[3]};
}

struct Direction {
  explicit Direction(const palpate_tool_state& state)
      : share(vector(state.direction).norm()), unit(vector(state.direction) / (share > 0 ? share : 1)) {}
  double share;
  Vector3d unit;
};

}  // namespace

Referee::Referee(const SceneOfEffects& of, Stage& stage)
    : of_(of), stage_(stage), body_(body_of(of)), memory_of_surface_(palpate_allocator{}) {
  const TouchedBody& body = body_.touched;
  organs_.resize(static_cast<std::size_t>(stage.organs()));
  for (Organ& organ : organs_) organ.left.emplace_back(body_);
  rest_.resize(body.dofs());
  for (std::int32_t n = 0; 3 * n < body.dofs(); ++n) rest_.segment<3>(3 * n) = body.node(n);
  if (of.def.preload == PALPATE_PRELOAD_ON) rest_ += body_.preload;
  p_.set(kRadial.coefficients().data(), 3, kRadial.range), q_.set(kForce.coefficients().data(), 3, kForce.range);
  relaxation_.set(of.def.relaxation);
}

Referee::~Referee() {
  memory_of_surface_.release_all();
}

double Referee::worst() const {
  double most = 0;
  for (const auto& [kind, error] : errors_) most = std::max(most, error);
  return most;
}

// NaN stays.
void Referee::miss(const char* kind, double error, double scale) {
  double& most = errors_[kind];
  const double share = error / scale;
  if (!(share <= most)) most = share;
}

Vector3d Referee::place(std::int32_t triangle, const double* k, const VectorXd& u) const {
  Vector3d sum = Vector3d::Zero();
  const auto& nodes = body_.touched.body.triangles[triangle];
  for (int v = 0; v < 3; ++v) sum += k[v] * (rest(nodes[v]) + u.segment<3>(3 * nodes[v]));
  return sum;
}

// Between the normals of the nodes, at rest; of a hyperelastic body, which the laws follow, as the step has deformed it.
Vector3d Referee::smooth_normal(const palpate_contact& contact) {
  const SurfacePoint at = surface_point_of(contact.triangle, contact.barycentric);
  if (of_.def.large.deformation == PALPATE_DEFORMATION_LINEAR) return vector(measure_.outward(at));
  std::vector<double> deformed = position_;
  for (std::size_t i = 0; i < deformed.size(); ++i) deformed[i] += organs_[0].u[static_cast<Eigen::Index>(i)];
  SceneMemory memory{palpate_allocator{}};
  SurfaceMeasure measure;
  measure.build(memory, deformed.data(), body_.touched.body.surface_nodes, triangles_.data(),
                static_cast<std::int32_t>(triangles_.size() / 3));
  const Vector3d normal = vector(measure.outward(at));
  memory.release_all();
  return normal;
}

// m/N, what the mesh does not resolve below the contact's disc.
Matrix3d Referee::local_of_disc(const palpate_contact& contact) {
  Matrix3d local = Matrix3d::Zero();
  if (of_.def.contact != PALPATE_CONTACT_PATCH || !(contact.disc_radius > 0)) return local;
  const SurfacePoint at = surface_point_of(contact.triangle, contact.barycentric);
  // A disc on a finer surface lies along that one.
  const Vec3 outward = of_.fine ? load3(contact.disc_normal) : measure_.outward(at);
  patch_.press(at, outward, across(outward, {}), contact.disc_radius);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) local(i, j) = patch_.local().m[i][j];
  return local;
}

// ---- what a step tells -------------------------------------------------------------------------------------------------

void Referee::read_forces(Organ& organ) {
  organ.f = VectorXd::Zero(body_.touched.dofs()), organ.of_node.clear();
  for (std::int32_t e = 0; e < organ.contacts->node_count; ++e) {
    const palpate_contact_node& node = *palpate_contacts_node(organ.contacts, e);
    Vector3d f(node.force);
    if (of_.def.large.deformation == PALPATE_DEFORMATION_LINEAR) {
      f = vector(node.modified_displacement);
      if (node.node < body_.touched.body.surface_nodes) f = stiffness_of(organ.left[0].origin(node.node)) * f;
    }
    organ.of_node.push_back(f);
    organ.f.segment<3>(3 * node.node) += f;
    largest_force_ = std::max(largest_force_, f.norm());
  }
}

void Referee::read(Organ& organ, int k) {
  organ.scene = stage_.scene(k), organ.contacts = &stage_.contacts(k);
  if (of_.loads) check_loads(organ, k);
  const TouchedBody& body = body_.touched;
  const bool large = of_.def.large.deformation != PALPATE_DEFORMATION_LINEAR;
  const auto nodes =
      static_cast<std::int32_t>(of_.def.shape == PALPATE_SHAPE_VOLUME ? body.dofs() / 3 : body.body.surface_nodes);
  std::vector<float> at(3 * nodes);
  organ.told.assign(at.size(), NAN);
  palpate_shape_out out = shape_out(organ.told.data(), at.data(), nodes);
  miss("shape flags", palpate_scene_shape(organ.scene, organ.contacts, &out) & ~of_response_range(), 1);
  for (std::size_t i = 0; i < at.size(); ++i) {
    const auto dof = static_cast<Eigen::Index>(i);
    if (large && step_ == 0) rest_[dof] = static_cast<double>(at[i]) - static_cast<double>(organ.told[i]);
    miss("positions", std::fabs(at[i] - organ.told[i] - rest_[dof]), kLength);
  }
  if (step_ % 20 == 0) check_crossings(organ, at);
  if (of_.cut) has_changed_ |= organ.left[0].follow(cut_mesh_of(*organ.scene));
  read_forces(organ);
  // A new node's displacement is told from where it was in reserve.
  for (std::int32_t n = 0; of_.cut && n < nodes; ++n)
    if (const std::int32_t from = organ.left[0].origin(n); from != n)
      for (int d = 0; d < 3; ++d) organ.told[3 * n + d] += static_cast<float>(rest_[3 * n + d] - rest_[3 * from + d]);
  if (large) {
    organ.u = VectorXd::Zero(body.dofs());
    for (std::size_t i = 0; i < organ.told.size(); ++i) organ.u[static_cast<Eigen::Index>(i)] = organ.told[i];
    organ.drawn = organ.u;
    if (of_.motions) amounts_of(organ);
    return;
  }
  organ.u = VectorXd::Zero(body.dofs());
  if (of_.motions) organ.u = body_.motions * amounts_of(organ);
  if (of_.loads) organ.u += body_.compliance * stage_.loads(k);
  if (of_.cut) {
    const bool sags = of_.def.preload == PALPATE_PRELOAD_ON;
    VectorXd by_volume = VectorXd::Zero(body.dofs());
    if (of_.motions) by_volume = amounts_of(organ)[kWeight] * body_.motions.col(kWeight);
    organ.u = organ.left[0].moved(organ.u - by_volume, false);
    if (sags) by_volume += body_.preload;
    organ.u += organ.left[0].moved(by_volume, true);
    for (Eigen::Index n = 0; sags && n < body.dofs() / 3; ++n)
      organ.u.segment<3>(3 * n) -= body_.preload.segment<3>(3 * organ.left[0].origin(static_cast<std::int32_t>(n)));
  }
  organ.drawn = organ.u;
  add_corrected_shape(organ);
  for (Eigen::Index n = 0; n < body.dofs() / 3; ++n)
    if (!organ.f.segment<3>(3 * n).isZero(0))
      organ.u += organ.left[0].compliance().middleCols<3>(3 * n) * organ.f.segment<3>(3 * n);
}

// Their sum, as the state and the contacts tell it.
void Referee::check_loads(const Organ& organ, int k) {
  const VectorXd f = stage_.loads(k);
  Vector3d sum = Vector3d::Zero(), told = sum, in_state = sum;
  for (Eigen::Index n = 0; n < f.size() / 3; ++n) sum += f.segment<3>(3 * n);
  for (int i = 0; i < 2; ++i) {
    told += vector(palpate_contacts_amounts(organ.contacts) + (of_.motions ? kMotions : 0) + 3 * i);
    in_state += vector(palpate_scene_load_state(organ.scene, i)->force);
  }
  miss("amounts of loads", (told - sum).norm(), largest_force_);
  miss("forces of loads", (in_state - stage_.direction_in_world(k, sum)).norm(), largest_force_);
}

// As they were sent; of a volume that is held the pressure that the step tells.
Eigen::Vector4d Referee::amounts_of(const Organ& organ) {
  Eigen::Vector4d amounts = stage_.amounts();
  const double* const told = palpate_contacts_amounts(organ.contacts);
  if (!std::isnan(stage_.held_volume(0))) amounts[kFilling] = told[kFilling];
  for (int m = 0; m < kMotions; ++m) miss("amounts of motions", std::fabs(told[m] - amounts[m]), 1);
  return amounts;
}

// Eqs 3 and 4: of what a tool displaces, the part across its direction gets another length.
void Referee::add_corrected_shape(Organ& organ) {
  std::map<std::int32_t, VectorXd> parts;
  for (std::size_t e = 0; e < organ.of_node.size(); ++e) {
    const palpate_contact_node& node = *palpate_contacts_node(organ.contacts, static_cast<std::int32_t>(e));
    const std::int32_t tool =
        of_.def.radial == PALPATE_RADIAL_RESPONSE && node.source == PALPATE_SOURCE_TOOL ? node.index : -1;
    VectorXd& f = parts.try_emplace(tool, VectorXd::Zero(organ.f.size())).first->second;
    f.segment<3>(3 * node.node) += organ.of_node[e];
  }
  for (const auto& [tool, f] : parts) {
    VectorXd u = VectorXd::Zero(f.size());
    for (Eigen::Index n = 0; n < f.size() / 3; ++n)
      if (!f.segment<3>(3 * n).isZero(0)) u += organ.left[0].compliance().middleCols<3>(3 * n) * f.segment<3>(3 * n);
    if (tool >= 0) {
      const Direction direction(*palpate_contacts_tool(organ.contacts, tool));
      for (Eigen::Index n = 0; n < u.size() / 3; ++n) {
        const Vector3d at = u.segment<3>(3 * n), across = at - direction.unit.dot(at) * direction.unit;
        u.segment<3>(3 * n) += direction.share * (p_.ratio(across.norm()) - 1) * across;
      }
    }
    organ.drawn += u;
  }
}

// The nodes of one constraint: their weights follow from their forces, which are all along one resultant.
Referee::Held Referee::held_by(const Organ& organ, palpate_contact_source source, std::int32_t index,
                               std::int32_t point) const {
  Held held;
  std::vector<std::size_t> of;
  for (std::size_t e = 0; e < organ.of_node.size(); ++e) {
    const palpate_contact_node& node = *palpate_contacts_node(organ.contacts, static_cast<std::int32_t>(e));
    if (!is_of(node, source, index) || node.point != point) continue;
    of.push_back(e), held.nodes.push_back(node.node), held.force += organ.of_node[e];
  }
  if (held.force.norm() < kNoForce) return held;
  for (std::size_t i = 0; i < of.size(); ++i) {
    const double weight = organ.of_node[of[i]].dot(held.force) / held.force.squaredNorm();
    held.moved += weight * organ.u.segment<3>(3 * held.nodes[i]), held.rest += weight * rest(held.nodes[i]);
  }
  return held;
}

// ---- checks ------------------------------------------------------------------------------------------------------------

void Referee::check(int s) {
  step_ = s;
  const bool large = of_.def.large.deformation != PALPATE_DEFORMATION_LINEAR;
  last_u_ = s == 0 ? VectorXd(VectorXd::Zero(rest_.size())) : organs_[0].u;
  for (int k = 0; k < stage_.organs(); ++k) read(organs_[k], k);
  if (s == 0 || has_changed_) {
    const std::vector<std::int32_t> before = triangles_;
    measure_surface();
    follow_jaws(before);
  }
  // Beside its steps a hyperelastic body only approaches the solution: what it is held to, it is where all stands still.
  const bool looks = stage_.flags == 0 && (!large || s == kSteps - 1);
  trusted += stage_.flags == 0;
  if (const int t = stage_.tool_of_grasp(); t >= 0)
    if (const palpate_grasp* const grasp = grasp_of(stage_.tool(t)); grasp && grasp->id != jaws_.id) close_jaws(*grasp);
  check_tools(organs_[0]);
  for (std::size_t k = 0; k < organs_.size(); ++k) {
    check_shape(organs_[k], static_cast<int>(k));
    if (s % 20 == 0 || s == kSteps - 1) check_surface(organs_[k]), check_inside(organs_[k]);
    if (s % 10 == 0 || s == kSteps - 1) check_skin(organs_[k]);
  }
  if (!looks) return;
  check_contacts(organs_[0]);
  if (of_.force_control) check_pusher(organs_[0]);
  check_grasp(organs_[0]), check_needle(organs_[0]), check_links(organs_[0]);
  for (std::size_t k = 0; of_.obstacles && k < organs_.size(); ++k) check_plate(organs_[k], static_cast<int>(k));
  for (std::size_t k = 0; of_.cut && k < organs_.size(); ++k) check_lips(organs_[k]);
  if (of_.touching) check_pairs();
  if (of_.world_links) check_world_links();
  for (std::size_t k = 0; large && k < organs_.size(); ++k) check_large(organs_[k], static_cast<int>(k));
}

// At rest: what is left of the first organ.
void Referee::measure_surface() {
  const CutTruth& left = organs_[0].left[0];
  has_changed_ = false;
  index_ = {}, measure_ = {}, patch_ = {};
  position_.clear(), triangles_.clear();
  for (std::int32_t n = 0; n < body_.touched.body.surface_nodes; ++n)
    for (int d = 0; d < 3; ++d) position_.push_back(rest_[3 * left.origin(n) + d]);
  for (const auto& t : body_.touched.body.triangles) triangles_.insert(triangles_.end(), t.begin(), t.end());
  if (const std::int32_t now = palpate_scene_cut_surface(organs_[0].scene, nullptr, nullptr, 0); now > 0) {
    triangles_.resize(3 * static_cast<std::size_t>(now));  // those of the whole organ come first
    palpate_scene_cut_surface(organs_[0].scene, triangles_.data(), nullptr, now);
  }
  const auto count = static_cast<std::int32_t>(triangles_.size() / 3);
  palpate_error error = {};
  const bool made =
      index_.build(memory_of_surface_, position_.data(), triangles_.data(), count) &&
      measure_.build(memory_of_surface_, position_.data(), body_.touched.body.surface_nodes, triangles_.data(),
                     count) &&
      patch_.create(memory_of_surface_, &index_, &measure_, triangles_.data(), body_.touched.body.surface_nodes) &&
      read_tissue(*body_.touched.bundle(), memory_of_surface_, measure_, &error) == PALPATE_OK;
  if (!made) throw std::runtime_error("no surface for the referee");
  for (std::int32_t n = 0; n < body_.touched.body.surface_nodes; ++n)
    if (left.origin(n) != n) measure_.copy_tissue(n, left.origin(n));
}

void Referee::check_shape(Organ& organ, int k) {
  if (of_.def.large.deformation != PALPATE_DEFORMATION_LINEAR) return;
  if (of_.motions && !of_.cut) {
    const double swept = body_.sweep.dot(organ.u), scale = 1e-6;  // m^3, what a pressure of these scenes sweeps
    miss("volumes", std::fabs(palpate_scene_motion_state(organ.scene, kFilling)->volume - swept), scale);
    if (!std::isnan(stage_.held_volume(k)) && stage_.flags == 0)
      miss("held volumes", std::fabs(stage_.held_volume(k) - swept), scale);
  }
  for (std::size_t i = 0; i < organ.told.size(); ++i)
    miss("shape", std::fabs(organ.told[i] - organ.drawn[static_cast<Eigen::Index>(i)]), kLength);
}

// ---- tools -------------------------------------------------------------------------------------------------------------

// Eqs 5 and 6, relaxation, and the sums.
void Referee::check_tools(const Organ& organ) {
  if (step_ == kFingerIsAway[0]) memory_.erase(kIdOfFinger), torque_memory_.erase(kIdOfFinger);
  const palpate_contact_report& report = *palpate_scene_report(organ.scene);
  for (std::int32_t t = 0; t < organ.contacts->tool_count; ++t) {
    const palpate_tool_state& state = *palpate_contacts_tool(organ.contacts, t);
    const Direction direction(state);
    Vector3d sum = Vector3d::Zero(), torque = Vector3d::Zero();
    for (std::size_t e = 0; e < organ.of_node.size(); ++e) {
      const palpate_contact_node& node = *palpate_contacts_node(organ.contacts, static_cast<std::int32_t>(e));
      if (is_of(node, PALPATE_SOURCE_TOOL, t)) sum += organ.of_node[e];
    }
    double stretch = 0;
    if (of_.def.force == PALPATE_FORCE_RESPONSE) stretch = direction.share * (q_.ratio(sum.dot(direction.unit)) - 1);
    const auto corrected = [&](const Vector3d& f) -> Vector3d {
      return f + stretch * f.dot(direction.unit) * direction.unit;
    };
    for (std::size_t e = 0; e < organ.of_node.size(); ++e) {
      const palpate_contact_node& node = *palpate_contacts_node(organ.contacts, static_cast<std::int32_t>(e));
      if (is_of(node, PALPATE_SOURCE_TOOL, t))
        miss("forces of nodes", (corrected(organ.of_node[e]) - vector(node.force)).norm(), largest_force_);
    }
    Vector3d force = -corrected(sum);
    int contacts = 0;
    for (std::int32_t c = 0; c < report.contact_count; ++c) {
      const palpate_contact& contact = *palpate_report_contact(&report, c);
      if (contact.tool != t) continue;
      ++contacts;
      torque += (vector(contact.tool_point) - vector(stage_.tool(t).reference)).cross(vector(contact.force));
    }
    if (t == stage_.tool_of_needle()) {
      const palpate_needle_state& needle = *palpate_scene_needle_state(organ.scene, state.id);
      Vector3d on_tissue = Vector3d::Zero();
      for (std::size_t e = 0; e < organ.of_node.size(); ++e)
        if (is_of(*palpate_contacts_node(organ.contacts, static_cast<std::int32_t>(e)), PALPATE_SOURCE_NEEDLE, t))
          on_tissue += organ.of_node[e];
      const Vector3d felt = stage_.direction_in_organ(needle.force);
      miss("force of the needle", (on_tissue + felt).norm(), largest_force_);
      force += felt, torque += stage_.direction_in_organ(needle.torque);
    }
    if (t == stage_.tool_of_grasp()) {
      const palpate_grasp_state& grasp = *palpate_scene_grasp_state(organ.scene, state.id);
      miss("force of the jaws", (sum + stage_.direction_in_organ(grasp.force)).norm(), largest_force_);
      const auto expected = grasp_of(stage_.tool(t)) ? PALPATE_GRASP_HOLDS : PALPATE_GRASP_OPEN;
      miss("jaws let go", grasp.condition == expected ? 0 : 1, 1);
      torque += stage_.direction_in_organ(grasp.torque);
    }
    if (of_.def.relaxation.terms > 0) {
      const Vec3 elastic = vec(force), relaxed = relaxation_.step(memory_[state.id], elastic, kStepTime);
      const Vec3 turned = relaxation_.step(torque_memory_[state.id], vec(torque), kStepTime);
      const bool stays = t == stage_.tool_of_needle() ||
                         (state.contact_count > 0 && (t == stage_.tool_of_grasp() || !(dot(relaxed, elastic) < 0)));
      force = stays ? vector(relaxed) : Vector3d(Vector3d::Zero());
      torque = stays ? vector(turned) : Vector3d(Vector3d::Zero());
    }
    miss("forces of tools", (force - stage_.direction_in_organ(state.force_raw)).norm(), largest_force_);
    // Of jaws Q also turns the sum; Response.AddsToAGraspsTorque* has that.
    if (t != stage_.tool_of_grasp() || stretch == 0)
      miss("torques of tools", (torque - stage_.direction_in_organ(state.torque_raw)).norm(), 0.1 * largest_force_);
    if (stage_.world())
      miss("forces of the world's tools",
           (vector(stage_.world_contacts().tool(t).force_raw) - vector(state.force_raw)).norm(), largest_force_);
  }
}

// ---- contacts ----------------------------------------------------------------------------------------------------------

void Referee::check_contacts(const Organ& organ) {
  const palpate_contact_report& report = *palpate_scene_report(organ.scene);
  for (std::int32_t c = 0; c < report.contact_count; ++c) check_contact(organ, *palpate_report_contact(&report, c));
}

void Referee::check_contact(const Organ& organ, const palpate_contact& contact) {
  const auto& nodes = body_.touched.body.triangles[contact.triangle];
  const double* const k = contact.barycentric;
  miss("places of contacts", (place(contact.triangle, k, organ.u) - vector(contact.place)).norm(), kLength);
  const Held held = held_by(organ, PALPATE_SOURCE_TOOL, contact.tool, contact.point);
  const Vector3d target = vector(contact.tool_point) - place(contact.triangle, k, VectorXd::Zero(rest_.size()));
  if (of_.def.contact == PALPATE_CONTACT_NODE) {
    check_law(contact, organ.u.segment<3>(3 * held.nodes.at(0)) - target, held.force);
  } else if (of_.def.contact == PALPATE_CONTACT_TRIANGLE) {
    const double square = k[0] * k[0] + k[1] * k[1] + k[2] * k[2];
    for (std::size_t v = 0; v < held.nodes.size(); ++v) {
      const auto n = held.nodes[v];
      const auto corner = std::find(nodes.begin(), nodes.end(), n) - nodes.begin();
      Vector3d force = Vector3d::Zero();
      for (std::size_t e = 0; e < organ.of_node.size(); ++e) {
        const palpate_contact_node& node = *palpate_contacts_node(organ.contacts, static_cast<std::int32_t>(e));
        if (is_of(node, PALPATE_SOURCE_TOOL, contact.tool) && node.point == contact.point && node.node == n)
          force = organ.of_node[e];
      }
      // Where it slips, the report has the place where the anchor goes on, and not that of the step.
      if (contact.state != PALPATE_CONTACT_SLIPS)
        check_law(contact, organ.u.segment<3>(3 * n) - (k[corner] + 1 - square) * target, force);
    }
  } else if (of_.def.contact == PALPATE_CONTACT_POINT || !(contact.disc_radius > 0)) {
    // The report has the place where the anchor goes on; the weights are those of the step.
    const bool has_weights = held.force.norm() >= kNoForce;
    const Vector3d at = has_weights ? Vector3d(held.rest + held.moved) : place(contact.triangle, k, organ.u);
    check_law(contact, at - vector(contact.tool_point), held.force);
  } else if (held.force.norm() >= kNoForce) {
    check_law(contact, held.moved + local_of_disc(contact) * held.force - target, held.force);
  }
}

// ahead: m, of the tool's target. Where anchors move over the surface, the account of energy may make a target shorter (docs/method.md,
// section 6): the tissue then stays behind its target, by less than kSlack. It is never pushed beyond it.
void Referee::check_law(const palpate_contact& contact, const Vector3d& ahead, const Vector3d& force) {
  const bool is_grip = contact.point >= stage_.tool(contact.tool).point_count;
  const Vector3d out = smooth_normal(contact);
  const double pushed = -force.dot(out);
  const std::pair<int, int> key(contact.tool_id, contact.point);
  const bool stuck = stuck_[key];
  stuck_[key] = contact.state == PALPATE_CONTACT_STICKS;
  if (is_grip || of_.def.law == PALPATE_LAW_STICKING) return miss(is_grip ? "grip" : "sticking", ahead.norm(), kLength);
  const auto miss_slack = [&](const char* kind, double behind) {
    if (behind < 0 || behind > kSlack) miss(kind, std::fabs(behind), kLength);
  };
  if (force.norm() < kNoForce) {
    if (of_.def.law != PALPATE_LAW_SLIDING && ahead.dot(out) > kSlack) miss("released", ahead.dot(out), kLength);
    return;
  }
  if (of_.def.law == PALPATE_LAW_COULOMB) {
    const Vector3d across = force - force.dot(out) * out;
    const double most = kFingerFriction * pushed;
    miss("coulomb, pulls", std::max(0.0, -pushed), largest_force_);
    miss_slack("coulomb, normal", ahead.dot(out));
    miss("coulomb, cone", std::max(0.0, across.norm() - most), largest_force_);
    if (contact.state == PALPATE_CONTACT_SLIPS && of_.def.contact != PALPATE_CONTACT_TRIANGLE)
      miss("coulomb, slips", std::fabs(across.norm() - most), largest_force_);
    else if (stuck && across.norm() < 0.9 * most)
      miss("coulomb, sticks", (ahead - ahead.dot(out) * out).norm(), kLength);
    return;
  }
  // The row is along the force; a disc's normal is its own.
  miss_slack("frictionless, normal", (pushed < 0 ? 1 : -1) * ahead.dot(force.normalized()));
  if (of_.def.law == PALPATE_LAW_UNILATERAL) miss("unilateral, pulls", std::max(0.0, -pushed), largest_force_);
  if (of_.def.contact != PALPATE_CONTACT_PATCH)
    miss("frictionless, across", (force + pushed * out).norm(), largest_force_);
}

// What presses with a given force: the organ carries it, but what a contact without friction does not along the surface.
void Referee::check_pusher(const Organ& organ) {
  const int t = stage_.tool_of_pusher();
  const palpate_given_force_state& state = *palpate_scene_given_force_state(organ.scene, kIdOfPusher);
  if (state.condition == PALPATE_GIVEN_FORCE_FREE) return;
  Vector3d sum = Vector3d::Zero();
  for (std::size_t e = 0; e < organ.of_node.size(); ++e)
    if (is_of(*palpate_contacts_node(organ.contacts, static_cast<std::int32_t>(e)), PALPATE_SOURCE_TOOL, t))
      sum += organ.of_node[e];
  const Vector3d told = stage_.direction_in_organ(state.force), missed = stage_.direction_in_organ(state.missed);
  miss("force of the pusher", (told - sum).norm(), largest_force_);
  miss("force that was given", (told + missed - stage_.pushed()).norm(), largest_force_);
  const bool frictionless = of_.def.law == PALPATE_LAW_SLIDING || of_.def.law == PALPATE_LAW_UNILATERAL;
  // The contact's normal is along its force.
  const bool has_normal = frictionless && sum.norm() > kNoForce;
  miss("force that is missed", has_normal ? std::fabs(missed.dot(sum.normalized())) : missed.norm(), largest_force_);
}

// ---- jaws and needles --------------------------------------------------------------------------------------------------

// The jaws close on the tissue where the last step has left it.
void Referee::close_jaws(const palpate_grasp& grasp) {
  std::vector<std::array<double, 3>> nodes;
  std::vector<std::int32_t> touchable = body_.touched.touchable;
  for (std::int32_t n = 0; n < body_.touched.body.surface_nodes; ++n) {
    nodes.push_back({position_[3 * n], position_[3 * n + 1], position_[3 * n + 2]});
    if (organs_[0].left[0].origin(n) != n) touchable.push_back(n);
  }
  std::vector<std::array<std::int32_t, 3>> triangles(triangles_.size() / 3);
  std::memcpy(triangles.data(), triangles_.data(), triangles_.size() * sizeof triangles_[0]);
  grasped_ = studies::grasped_surface(nodes, body_.touched.body.surface_nodes, triangles, touchable);
  studies::GraspedRows jaws(grasped_, *body_.touched.bundle(), surface_point_of(grasp.triangle, grasp.barycentric),
                            grasp.radius);
  jaws_.id = grasp.id, jaws_.position = vector(grasp.position), jaws_.turn = turn_of(grasp);
  jaws_.rows = jaws.rows(jaws_.position, Vector3d::Zero(), Eigen::Quaterniond::Identity());
  jaws_.closed_on = last_u_;
  const std::int32_t* const corner = triangles_.data() + 3 * grasp.triangle;
  jaws_.middle = Vector3d::Zero(), jaws_.radius = grasp.radius;
  for (int v = 0; v < 3; ++v) jaws_.middle += grasp.barycentric[v] * Vector3d(position_.data() + 3 * corner[v]);
}

// Of a node that was divided the jaws hold the part with most of their disc's area on triangles of the whole organ; where the disc reaches none of
// them, the nearest part. before: the triangles.
void Referee::follow_jaws(const std::vector<std::int32_t>& before) {
  std::map<std::int32_t, std::int32_t> now;
  for (const studies::Row& row : jaws_.rows)
    for (const studies::Row::Term& term : row.terms) now[static_cast<std::int32_t>(term.dof / 3)] = -1;
  for (auto& [node, part] : now) {
    part = node;
    std::map<std::int32_t, double> area, distance;
    for (std::size_t t = 0; t < body_.touched.body.triangles.size(); ++t)
      for (std::size_t v = 3 * t; v < 3 * t + 3; ++v) {
        if (before[v] != node) continue;
        const Vector3d a(position_.data() + 3 * before[3 * t]), b(position_.data() + 3 * before[3 * t + 1]),
            c(position_.data() + 3 * before[3 * t + 2]);
        constexpr int parts = 40;
        for (int i = 0; i < parts; ++i)
          for (int j = 0; i + j < parts; ++j) {
            const Vector3d p = a + (i + 0.5) / parts * (b - a) + (j + 0.5) / parts * (c - a);
            const double far = (p - jaws_.middle).norm();
            if (far <= jaws_.radius) area[triangles_[v]] += (b - a).cross(c - a).norm();
            double& least = distance.try_emplace(triangles_[v], far).first->second;
            least = std::min(least, far);
          }
      }
    distance.try_emplace(node, HUGE_VAL);
    for (const auto& [other, far] : distance)
      if (area[other] > area[part] || (area[other] == 0 && area[part] == 0 && far < distance[part])) part = other;
    jaws_.closed_on.segment<3>(3 * part) = Vector3d(jaws_.closed_on.segment<3>(3 * node));
  }
  for (studies::Row& row : jaws_.rows)
    for (studies::Row::Term& term : row.terms)
      term.dof = 3 * now[static_cast<std::int32_t>(term.dof / 3)] + term.dof % 3;
}

void Referee::check_grasp(const Organ& organ) {
  if (stage_.tool_of_grasp() < 0 || !grasp_of(stage_.tool(stage_.tool_of_grasp()))) return;
  const palpate_grasp& grasp = *grasp_of(stage_.tool(stage_.tool_of_grasp()));
  std::map<std::int32_t, Eigen::Index> index;
  VectorXd f = VectorXd::Zero(3 * organ.contacts->node_count);
  for (std::size_t e = 0; e < organ.of_node.size(); ++e) {
    const palpate_contact_node& node = *palpate_contacts_node(organ.contacts, static_cast<std::int32_t>(e));
    if (!is_of(node, PALPATE_SOURCE_TOOL, stage_.tool_of_grasp())) continue;
    const auto at = index.try_emplace(node.node, static_cast<Eigen::Index>(index.size())).first->second;
    f.segment<3>(3 * at) += organ.of_node[e];
  }
  const auto count = static_cast<Eigen::Index>(jaws_.rows.size());
  const Eigen::Quaterniond turn = turn_of(grasp) * jaws_.turn.inverse();
  MatrixXd h = MatrixXd::Zero(3 * static_cast<Eigen::Index>(index.size()), count);
  VectorXd ahead = VectorXd::Zero(count);
  for (Eigen::Index r = 0; r < count; ++r)
    for (const studies::Row::Term& term : jaws_.rows[r].terms) {
      const auto node = static_cast<std::int32_t>(term.dof / 3);
      const auto at = index.find(node);
      if (at == index.end()) return miss("nodes of the jaws", 1, 1);
      h(3 * at->second + term.dof % 3, r) = term.weight;
      // The node's motion since the jaws closed, less that of the jaws.
      const Vector3d closed = jaws_.closed_on.segment<3>(3 * node), y = rest(organ.left[0].origin(node)) + closed,
                     moved = turn * (y - jaws_.position) + vector(grasp.position) - y;
      ahead[r] += term.weight * (organ.u[term.dof] - closed[term.dof % 3] - moved[term.dof % 3]);
    }
  const VectorXd held = f.head(h.rows()), reaction = h.colPivHouseholderQr().solve(held);
  miss("forces of the jaws' rows", (h * reaction - held).norm(), largest_force_);
  // Of a gradient times the radius.
  for (Eigen::Index r = 0; r < count; ++r)
    miss("jaws", std::fabs(ahead[r] + jaws_.rows[r].softness * reaction[r]) * (r < 3 ? 1 : grasp.radius), kLength);
}

void Referee::check_needle(const Organ& organ) {
  if (stage_.tool_of_needle() < 0) return;
  const palpate_needle& needle = *needle_of(stage_.tool(stage_.tool_of_needle()));
  const palpate_needle_state& state = *palpate_scene_needle_state(organ.scene, stage_.tool(stage_.tool_of_needle()).id);
  std::set<std::int32_t> points;
  for (std::int32_t e = 0; e < organ.contacts->node_count; ++e) {
    const palpate_contact_node& node = *palpate_contacts_node(organ.contacts, e);
    if (is_of(node, PALPATE_SOURCE_NEEDLE, stage_.tool_of_needle())) points.insert(node.point);
  }
  const Vector3d along(needle.direction), tip(needle.tip);
  const bool inside = state.condition >= PALPATE_NEEDLE_INSIDE;
  miss("the needle's force is missing", inside && step_ > 100 && vector(state.force).norm() < kNoForce ? 1 : 0, 1);
  for (const std::int32_t point : points) {
    const Held held = held_by(organ, PALPATE_SOURCE_NEEDLE, stage_.tool_of_needle(), point);
    if (held.force.norm() < kNoForce || !inside) continue;
    const Vector3d from_tip = held.rest + held.moved - tip, off = from_tip - from_tip.dot(along) * along;
    const Vector3d across = held.force - held.force.dot(along) * along;
    double edge = 0;
    int pairs = 0;
    for (std::size_t a = 0; a < held.nodes.size(); ++a)
      for (std::size_t b = 0; b < a; ++b) edge += (rest(held.nodes[a]) - rest(held.nodes[b])).norm(), ++pairs;
    edge /= std::max(1, pairs);
    // The place stands for a length between a quarter of the spacing and twice it; the tissue is off the axis by what the mesh does not
    // resolve for that.
    const auto softness = [&](double length) {
      return studies::softness_across_shaft(5400, 0.45, edge, needle.radius, length);
    };
    const double least = softness(2 * needle.spacing), most = softness(0.25 * needle.spacing),
                 found = std::clamp(-off.dot(across) / std::max(across.squaredNorm(), 1e-12), least, most);
    miss("needle, across", (off + found * across).norm(), kLength);
    const double limit = std::max(needle.friction * 2 * needle.spacing, needle.cutting_force);
    miss("needle, along", std::max(0.0, std::fabs(held.force.dot(along)) - limit), largest_force_);
  }
}

// ---- links -------------------------------------------------------------------------------------------------------------

// Along the line that the step has used, which is that of the force.
void Referee::check_link(const palpate_link_state& state, palpate_link_kind kind, double stiffness,
                         const Vector3d ends[2]) {
  const Vector3d force(state.force);
  for (int e = 0; e < 2; ++e) miss("ends of links", (ends[e] - vector(state.ends[e])).norm(), kLength);
  if (kind == PALPATE_LINK_CLIP) return miss("clips", (ends[1] - ends[0]).norm(), kLength);
  if (kind == PALPATE_LINK_THREAD) miss("threads that push", std::max(0.0, -state.tension), largest_force_);
  if (force.norm() < kNoForce) {
    const bool slack = kind == PALPATE_LINK_THREAD && step_ > kStandsFrom;
    if (slack) miss("slack threads", std::max(0.0, (ends[1] - ends[0]).norm() - state.rest_length), kLength);
    return;
  }
  const Vector3d line = force / state.tension;
  miss("lengths of links", std::fabs(line.dot(ends[1] - ends[0]) - state.rest_length - state.tension / stiffness),
       kLength);
  if (step_ > kSteps - 20) miss("lines of links", line.cross((ends[1] - ends[0]).normalized()).norm(), 1);
}

void Referee::check_links(const Organ& organ) {
  for (std::size_t l = 0; l < stage_.links().size(); ++l) {
    const palpate_link& link = stage_.links()[l];
    const palpate_link_state& state = *palpate_scene_link_state(organ.scene, static_cast<std::int32_t>(l));
    std::map<std::int32_t, Vector3d> expected;
    Vector3d ends[2];
    for (int e = 0; e < 2; ++e) {
      const palpate_link_end& end = link.ends[e];
      ends[e] = end.kind == PALPATE_END_WORLD ? vector(end.point) : place(end.triangle, end.barycentric, organ.u);
      for (int v = 0; v < 3 && end.kind == PALPATE_END_SURFACE_POINT; ++v)
        expected.try_emplace(body_.touched.body.triangles[end.triangle][v], Vector3d::Zero()).first->second +=
            (e == 0 ? 1 : -1) * end.barycentric[v] * vector(state.force);
    }
    for (std::size_t e = 0; e < organ.of_node.size(); ++e) {
      const palpate_contact_node& node = *palpate_contacts_node(organ.contacts, static_cast<std::int32_t>(e));
      if (is_of(node, PALPATE_SOURCE_LINK, static_cast<std::int32_t>(l)))
        expected.try_emplace(node.node, Vector3d::Zero()).first->second -= organ.of_node[e];
    }
    for (const auto& [node, missing] : expected) miss("forces of links", missing.norm(), largest_force_);
    check_link(state, link.kind, link.stiffness, ends);
  }
}

void Referee::check_world_links() {
  for (std::size_t l = 0; l < stage_.world_links().size(); ++l) {
    const palpate_world_link& link = stage_.world_links()[l];
    const palpate_link_state& state = *palpate_world_link_state(stage_.world(), static_cast<std::int32_t>(l));
    Vector3d ends[2];
    for (int e = 0; e < 2; ++e) {
      const Organ& organ = organs_[link.organ[e]];
      ends[e] = stage_.in_world(link.organ[e], place(link.ends[e].triangle, link.ends[e].barycentric, organ.u));
      Vector3d sum = Vector3d::Zero();
      for (std::size_t i = 0; i < organ.of_node.size(); ++i) {
        const palpate_contact_node& node = *palpate_contacts_node(organ.contacts, static_cast<std::int32_t>(i));
        if (is_of(node, PALPATE_SOURCE_WORLD_LINK, static_cast<std::int32_t>(l))) sum += organ.of_node[i];
      }
      const Vector3d on_end = (e == 0 ? 1 : -1) * vector(state.force);
      miss("forces of links", (stage_.direction_in_world(link.organ[e], sum) - on_end).norm(), largest_force_);
    }
    check_link(state, link.kind, link.stiffness, ends);
  }
}

// ---- a plate ------------------------------------------------------------------------------------------------------------

void Referee::check_plate(const Organ& organ, int k) {
  const auto above = [&](std::int32_t n) {
    return kPlateNormal.dot(rest(n) + organ.u.segment<3>(3 * n) - stage_.plate());
  };
  Vector3d sum = Vector3d::Zero();
  for (std::size_t i = 0; i < organ.of_node.size(); ++i) {
    const palpate_contact_node& node = *palpate_contacts_node(organ.contacts, static_cast<std::int32_t>(i));
    if (node.source != PALPATE_SOURCE_OBSTACLE) continue;
    const Vector3d& force = organ.of_node[i];
    const double pushed = force.dot(kPlateNormal);
    sum += force;
    miss("plates that pull", std::max(0.0, -pushed), largest_force_);
    miss("friction of plates", std::max(0.0, (force - pushed * kPlateNormal).norm() - kPlateFriction * pushed),
         largest_force_);
    if (force.norm() > kNoForce) miss("plates that press apart", std::fabs(above(node.node)), kLength);
  }
  for (std::int32_t n = 0; n < body_.touched.body.surface_nodes; ++n)
    if (!body_.touched.fixed[3 * n]) miss("nodes behind a plate", std::max(0.0, -above(n)), kLength);
  const palpate_obstacle_state& state = *palpate_scene_obstacle_state(organ.scene, 0);
  miss("forces of plates", (stage_.direction_in_world(k, sum) + vector(state.force)).norm(), largest_force_);
}

// ---- the lips of a cut --------------------------------------------------------------------------------------------------

// A pair of nodes pushes along one line, to both sides alike, where the two lie across from one another.
void Referee::check_lips(const Organ& organ) {
  std::map<std::pair<std::int32_t, std::int32_t>, std::array<Vector3d, 2>> pairs;
  for (std::size_t i = 0; i < organ.of_node.size(); ++i) {
    const palpate_contact_node& node = *palpate_contacts_node(organ.contacts, static_cast<std::int32_t>(i));
    if (node.source != PALPATE_SOURCE_LIP) continue;
    auto& on = pairs.try_emplace({node.index, node.point}, std::array<Vector3d, 2>{Vector3d::Zero(), Vector3d::Zero()})
                   .first->second;
    on[node.node == node.index ? 0 : 1] += organ.of_node[i];
  }
  for (const auto& [nodes, on] : pairs) {
    miss("forces of lips", (on[0] + on[1]).norm(), largest_force_);
    if (on[0].norm() < kNoForce) continue;
    const Vector3d apart = organ.u.segment<3>(3 * nodes.first) - organ.u.segment<3>(3 * nodes.second);
    miss("lips that press apart", std::fabs(on[0].normalized().dot(apart)), kLength);
  }
}

// ---- organs that touch -------------------------------------------------------------------------------------------------

void Referee::check_pairs() {
  WorldContacts& contacts = stage_.world_contacts();
  Vector3d sum[2] = {Vector3d::Zero(), Vector3d::Zero()};
  for (std::int32_t i = 0; i < contacts->pair_count; ++i) {
    const palpate_world_pair& pair = *palpate_world_contacts_pair(contacts.get(), i);
    const Organ &a = organs_[pair.organ[0]], &b = organs_[pair.organ[1]];
    const Vector3d vertex = stage_.in_world(pair.organ[0], rest(pair.node) + a.u.segment<3>(3 * pair.node)),
                   other = stage_.in_world(pair.organ[1], place(pair.triangle, pair.barycentric, b.u)),
                   normal(pair.normal), force(pair.force);
    sum[pair.organ[0]] += force, sum[pair.organ[1]] -= force;
    const double pushed = force.dot(normal);
    // The smooth surface is up to an eighth of an edge's square over the radius above the flat triangle.
    miss("gaps of pairs", std::fabs(normal.dot(vertex - other) + pair.overlap - pair.gap), kLength);
    miss("pairs that pull", std::max(0.0, -pushed), largest_force_);
    miss("friction of pairs", std::max(0.0, (force - pushed * normal).norm() - kPairFriction * pushed), largest_force_);
    if (force.norm() > kNoForce) miss("pairs that press apart", std::fabs(pair.gap), kLength);
    if (step_ == kSteps - 1) miss("pairs in one another", std::max(0.0, -pair.gap), kLength);
  }
  for (int k = 0; k < 2; ++k) {
    const Organ& organ = organs_[k];
    Vector3d nodes = Vector3d::Zero();
    for (std::size_t i = 0; i < organ.of_node.size(); ++i)
      if (is_of(*palpate_contacts_node(organ.contacts, static_cast<std::int32_t>(i)), PALPATE_SOURCE_ORGAN, 1 - k))
        nodes += organ.of_node[i];
    miss("forces of pairs", (stage_.direction_in_world(k, nodes) - sum[k]).norm(), largest_force_);
    miss("forces of pairs", (vector(contacts.state(k).pressed) - sum[k]).norm(), largest_force_);
  }
}

// ---- what is shown -----------------------------------------------------------------------------------------------------

// P is not part of the surface that queries meet.
void Referee::check_surface(const Organ& organ) {
  if (of_.def.queries.queries == PALPATE_QUERIES_OFF) return;
  DeformedTruth truth(body_.touched.body);
  std::vector<float> moved;
  for (Eigen::Index i = 0; i < 3 * body_.touched.body.surface_nodes; ++i)
    moved.push_back(static_cast<float>(organ.u[i] + rest_[i] - body_.touched.body.mesh.nodes[i / 3][i % 3]));
  truth.move(moved);
  for (const Vector3d& p : {Vector3d(0.041, 0.024, 0.043), Vector3d(0.05, 0.045, 0.02), Vector3d(0.03, 0.02, 0.02)}) {
    double distance = 0;
    palpate_scene_signed_distance(organ.scene, organ.contacts, p.data(), &distance);
    miss("queries", std::fabs(distance - truth.signed_distance(p)), kLength);
  }
}

void Referee::check_skin(Organ& organ) {
  if (!of_.skin) return;
  const palpate_render_mesh& mesh = effect_skin();
  std::vector<float> positions(3 * mesh.vertex_count);
  const std::int32_t nodes = static_cast<std::int32_t>(organ.told.size() / 3);
  palpate_shape_out shape = shape_out(organ.told.data(), nullptr, nodes);
  shape.node_count = nodes;
  palpate_skin_out out = skin_out(positions.data(), nullptr, mesh.vertex_count);
  if (of_.def.dent.dent != PALPATE_DENT_OFF) out.report = palpate_scene_report(organ.scene);
  miss("skin flags", palpate_scene_skin(organ.scene, &shape, &out), 1);
  for (std::int32_t t = 0; t < mesh.vertex_count; ++t) {
    const double k[3] = {0.5, 0.3, 0.2};
    const Vector3d expected = place(t, k, organ.drawn),
                   found = Eigen::Map<const Eigen::Vector3f>(&positions[3 * t]).cast<double>();
    // A dent goes inwards, below the finger and the pusher alone.
    const Vector3d out_of = body_.touched.outward(t);
    const bool pressed = out_of[2] > 0.99 || (of_.force_control && out_of[2] < -0.99),
               dented = of_.def.dent.dent != PALPATE_DENT_OFF && pressed;
    if (dented)
      miss("dent", (found - expected).dot(out_of) > kRaised ? 1 : 0, 1);
    else
      miss("skin", (found - expected).norm(), kLength);
  }
}

// A whole check in each call.
void Referee::check_crossings(const Organ& organ, std::vector<float>& positions) {
  if (of_.def.crossings.crossings == PALPATE_CROSSINGS_OFF) return;
  const auto truth = crossed_triangles(positions, body_.touched.body.triangles);
  palpate_shape_out shape = shape_out(nullptr, positions.data(), static_cast<std::int32_t>(positions.size() / 3));
  shape.node_count = shape.node_capacity;
  palpate_crossings_out found = palpate_default_crossings_out();
  const palpate_step_flags expected = truth.empty() ? 0 : palpate_step_flags{PALPATE_STEP_SURFACE_CROSSES};
  miss("crossings flags", palpate_scene_crossings(organ.scene, &shape, &found) ^ expected, 1);
  miss("crossings", std::fabs(found.pairs - static_cast<double>(truth.size())), 1);
}

// Strain, and the part of the stress that changes the form.
void Referee::check_inside(Organ& organ) {
  if (of_.def.inside.inside == PALPATE_INSIDE_OFF) return;
  const auto& mesh = body_.touched.body.mesh;
  const std::size_t nodes = mesh.nodes.size();
  const bool large = of_.def.large.deformation != PALPATE_DEFORMATION_LINEAR;
  std::vector<float> strains(6 * nodes), stresses(6 * nodes), displacements(3 * nodes);
  palpate_shape_out shape = shape_out(organ.told.data(), nullptr, static_cast<std::int32_t>(nodes));
  shape.node_count = static_cast<std::int32_t>(nodes);
  palpate_inside_out out = palpate_default_inside_out();
  out.capacity = static_cast<std::int32_t>(nodes);
  out.strains = strains.data(), out.stresses = stresses.data(), out.displacements = displacements.data();
  miss("inside flags", palpate_scene_inside(organ.scene, &shape, &out), 1);
  std::vector<Matrix3d> mean(nodes, Matrix3d::Zero());
  std::vector<double> volume(nodes, 0.0);
  for (const auto& t : mesh.tetrahedra) {
    Matrix3d edges, moved;
    for (int a = 0; a < 3; ++a) {
      edges.col(a) = body_.touched.node(t[a + 1]) - body_.touched.node(t[0]);
      const auto n = t[a + 1];
      moved.col(a) =
          rest(n) + organ.drawn.segment<3>(3 * n) - rest(t[0]) - organ.drawn.segment<3>(3 * t[0]) - edges.col(a);
    }
    const Matrix3d gradient = moved * edges.inverse();
    const Matrix3d strain = 0.5 * (gradient + gradient.transpose() +
                                   (large ? Matrix3d(gradient.transpose() * gradient) : Matrix3d(Matrix3d::Zero())));
    const double size = std::fabs(edges.determinant());
    for (const auto n : t) mean[n] += size * strain, volume[n] += size;
  }
  const double shear = 5400 / (2 * 1.45);
  for (std::size_t n = 0; n < nodes; ++n) {
    const Matrix3d strain = mean[n] / volume[n];
    const auto of = [&](const std::vector<float>& all) {
      const float* const t = &all[6 * n];
      Matrix3d m;
      m << t[0], t[3], t[5], t[3], t[1], t[4], t[5], t[4], t[2];
      return m;
    };
    // Strains of these scenes are about 0.1.
    miss("strain", (of(strains) - strain).norm(), 0.1);
    if (large) continue;
    const auto deviator = [](const Matrix3d& m) -> Matrix3d { return m - m.trace() / 3 * Matrix3d::Identity(); };
    miss("stress", (deviator(of(stresses)) - 2 * shear * deviator(strain)).norm(), 2 * shear * 0.1);
  }
}

// ---- large deformation -------------------------------------------------------------------------------------------------

// N on each dof, of 1 Pa on the pressed face as it is; the displacement is from the mesh.
VectorXd Referee::on_pressed_face(const CutTruth& left, const VectorXd& displacement) const {
  VectorXd force = VectorXd::Zero(displacement.size());
  const auto triangles = left.triangles();
  for (std::size_t t = 0; t < body_.touched.body.triangles.size(); ++t) {
    if (body_.touched.outward(static_cast<std::int32_t>(t))[0] < 0.9) continue;
    Vector3d p[3];
    const auto& corners = triangles[t];
    for (int v = 0; v < 3; ++v)
      p[v] = body_.touched.node(left.origin(corners[v])) + displacement.segment<3>(3 * corners[v]);
    for (const auto n : corners) force.segment<3>(3 * n) -= (p[1] - p[0]).cross(p[2] - p[0]) / 6;
  }
  return force;
}

// Where Newton's method brings the body under the forces that the step tells, with the supports where the motions bring them, and under the pressure
// on its face where that is then.
void Referee::check_large(Organ& organ, int k) {
  const CutTruth& left = organ.left[0];
  const LargeReference& reference = left.large();
  VectorXd load = VectorXd::Zero(rest_.size()), on_surface = load, found = organ.u;
  for (std::int32_t n = 0; 3 * n < found.size(); ++n)
    found.segment<3>(3 * n) += rest(left.origin(n)) - body_.touched.node(left.origin(n));
  if (of_.def.preload == PALPATE_PRELOAD_ON) load = body_.touched.stiffness() * body_.preload;
  if (of_.motions) {
    Eigen::Vector4d amounts = amounts_of(organ);
    amounts[kFilling] = 0;
    const VectorXd moved = body_.motions * amounts;
    load += body_.touched.stiffness() * moved;  // gravity; zero where supports alone move
    for (Eigen::Index i = 0; i < load.size(); ++i)
      if (body_.touched.fixed[i] && left.origin(static_cast<std::int32_t>(i / 3)) == i / 3)
        miss("supports", std::fabs(found[i] - moved[i]), kLength);
  }
  if (of_.loads) on_surface = stage_.loads(k);
  for (Eigen::Index i = 0; i < load.size(); ++i)
    if (body_.touched.fixed[i]) load[i] = on_surface[i] = 0;
  load = left.divided(load, true) + left.divided(on_surface, false);
  if (organ.told.size() < static_cast<std::size_t>(rest_.size())) return;
  VectorXd exact = found;
  const double pressure = of_.motions ? palpate_scene_motion_state(organ.scene, kFilling)->amount : 0;
  for (int i = 0; i < (pressure != 0 ? 8 : 1); ++i)
    reference.balance(load + organ.f + pressure * on_pressed_face(left, exact), &exact);
  miss("newton", (exact - found).norm(), organ.u.norm());
  if (!std::isnan(stage_.held_volume(k)))
    miss("held volumes", std::fabs(stage_.held_volume(k) - palpate_scene_motion_state(organ.scene, kFilling)->volume),
         1e-6);
}

}  // namespace palpate::tests
