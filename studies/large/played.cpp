#include "studies/large/played.h"

#include <fmt/format.h>

#include <cmath>

#include "formats/errors.h"
#include "studies/timing/timing.h"

namespace palpate::large {
namespace {

constexpr double kTick = 1e-3;  // s
constexpr int kMostDiscs = 2;
constexpr std::int32_t kContactNodes = 512;  // so many that no disc is thinned

SceneDef definition(palpate_deformation_model deformation) {
  SceneDef def;
  def.large.deformation = deformation, def.collision = PALPATE_COLLISION_OFF;
  if (deformation == PALPATE_DEFORMATION_LARGE) def.shape = PALPATE_SHAPE_VOLUME;
  def.max_tools = def.max_points = kMostDiscs, def.max_contact_nodes = kContactNodes;
  def.force_limit = def.force_slew = INFINITY;
  return def;
}

palpate_grip grip_at(const Bundle& bundle, Vec3 at, Vec3 displacement) {
  const auto found = accuracy::closest_point(
      {bundle.nodes(), {bundle.triangles(), 3 * static_cast<std::size_t>(bundle.describe().triangle_count)}}, at);
  palpate_grip grip = palpate_default_grip();
  grip.kind = PALPATE_GRIP_SURFACE_POINT, grip.triangle = found.on.triangle;
  std::copy(found.on.barycentric, found.on.barycentric + 3, grip.barycentric);
  store3(displacement, grip.displacement);
  return grip;
}

}  // namespace

Player::Player(const Bundle& bundle, palpate_deformation_model deformation, double radius)
    : bundle_(bundle),
      radius_(radius),
      scene_([&] {
        const auto begun = studies::Clock::now();
        Scene made(bundle, definition(deformation));
        create_ms_ = 1e3 * studies::seconds_since(begun);
        return made;
      }()),
      contacts_(scene_.make_contacts()),
      u_(3 * static_cast<std::size_t>(deformation == PALPATE_DEFORMATION_LARGE
                                          ? bundle.describe().node_count
                                          : bundle.describe().surface_node_count)) {}

void Player::look(Reached* reached, StepTimes* times) {
  palpate_shape_out out = palpate_default_shape_out();
  out.displacements = u_.data(), out.node_capacity = static_cast<std::int32_t>(u_.size() / 3);
  const auto begun = studies::Clock::now();
  reached->flags |= scene_.shape(contacts_, out);
  if (times) times->shape.push_back(1e6 * studies::seconds_since(begun));
  reached->u.resize(static_cast<Eigen::Index>(u_.size()));
  for (std::size_t i = 0; i < u_.size(); ++i) reached->u[static_cast<Eigen::Index>(i)] = static_cast<double>(u_[i]);
  reached->force.resize(3 * contacts_->tool_count);
  for (std::int32_t t = 0; t < contacts_->tool_count; ++t)
    for (int i = 0; i < 3; ++i) reached->force[3 * t + i] = -contacts_.tool(t).force_raw[i];
  reached->residual = contacts_->body_residual, reached->least_volume = contacts_->least_volume;
}

std::vector<Reached> Player::play(const Move& move, const Pace& pace, StepTimes* times) {
  scene_.reset();
  std::vector<palpate_grip> grips;
  for (const DiscMove& disc : move.discs) grips.push_back(grip_at(bundle_, disc.at, {}));
  std::vector<palpate_tool> tools(grips.size(), palpate_default_tool());
  for (std::size_t t = 0; t < tools.size(); ++t)
    tools[t].grips = &grips[t], tools[t].grip_count = 1, tools[t].disc_radius = radius_;
  std::vector<Reached> all;
  const double step = pace.speed * kTick;
  for (int tick = 0; all.size() < pace.depths.size(); ++tick) {
    // The last touch before a depth ends there.
    const double depth = std::min(tick * step, pace.depths[all.size()]);
    for (std::size_t t = 0; t < tools.size(); ++t) store3(depth * move.discs[t].way, grips[t].displacement);
    const auto begun = studies::Clock::now();
    const double thread_begun = studies::thread_seconds();
    const unsigned flags = scene_.touch(tools.data(), static_cast<std::int32_t>(tools.size()), kTick, contacts_);
    const double thread_took = studies::thread_seconds() - thread_begun, took = studies::seconds_since(begun);
    if (tick > 0) times->touch.push_back(1e6 * took), times->touch_thread.push_back(1e6 * thread_took);
    if (depth < pace.depths[all.size()]) continue;
    all.emplace_back();
    all.back().flags = flags;
    look(&all.back(), times);
  }
  return all;
}

HeldDiscs Player::hold(const std::vector<DiscMove>& discs) {
  constexpr double move = 1e-3;  // m
  const std::size_t count = discs.size();
  const auto rows = static_cast<Eigen::Index>(3 * count);
  HeldDiscs held;
  held.discs.resize(count);
  Eigen::MatrixXd force(rows, rows), missed(rows, rows);
  std::vector<Eigen::VectorXd> us;  // of the surface, for each row
  for (Eigen::Index row = 0; row < rows; ++row) {
    std::vector<palpate_grip> grips;
    for (std::size_t t = 0; t < count; ++t) {
      Vec3 displacement;
      if (static_cast<Eigen::Index>(t) == row / 3) displacement[static_cast<int>(row % 3)] = move;
      grips.push_back(grip_at(bundle_, discs[t].at, displacement));
    }
    std::vector<palpate_tool> tools(count, palpate_default_tool());
    for (std::size_t t = 0; t < count; ++t)
      tools[t].grips = &grips[t], tools[t].grip_count = 1, tools[t].disc_radius = radius_;
    scene_.reset();
    Reached reached;
    reached.flags = scene_.touch(tools.data(), static_cast<std::int32_t>(count), kTick, contacts_);
    look(&reached, nullptr);
    // A disc that reaches held nodes acts on the others.
    if ((reached.flags & ~unsigned{PALPATE_STEP_NOT_TOUCHABLE}) != 0 || contacts_->node_count == 0)
      throw OperationError(fmt::format("holding a disc raised flags {}", reached.flags));
    force.col(row) = reached.force;
    for (std::int32_t n = 0; row % 3 == 0 && n < contacts_->node_count; ++n) {
      const palpate_contact_node& node = contacts_.node(n);
      if (node.index != row / 3) continue;
      // The rows along x, y and z share the weights: the force of a node is its weight of the whole.
      const Eigen::Vector3d part(node.force[0], node.force[1], node.force[2]), whole = reached.force.segment<3>(row);
      auto& [nodes, weights] = held.discs[static_cast<std::size_t>(node.index)];
      nodes.push_back(node.node);
      weights.push_back(part.dot(whole) / whole.squaredNorm());
    }
    us.push_back(reached.u);
  }
  for (Eigen::Index row = 0; row < rows; ++row) {
    missed.col(row) = move * Eigen::VectorXd::Unit(rows, row);
    for (std::size_t t = 0; t < count; ++t)
      for (std::size_t n = 0; n < held.discs[t].nodes.size(); ++n)
        missed.col(row).segment<3>(static_cast<Eigen::Index>(3 * t)) -=
            held.discs[t].weights[n] * us[static_cast<std::size_t>(row)].segment<3>(3 * held.discs[t].nodes[n]);
  }
  // missed = compliance force
  const Eigen::MatrixXd compliance = missed * force.inverse();
  held.compliance = 0.5 * (compliance + compliance.transpose());
  return held;
}

}  // namespace palpate::large
