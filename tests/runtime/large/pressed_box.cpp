#include "tests/runtime/large/pressed_box.h"

namespace palpate::tests {

const TouchedBox& large_box() {
  static const TouchedBox shared({}, with_large(false));
  return shared;
}

palpate_step_flags Play::move(const std::vector<Eigen::Vector3d>& to, double radius) {
  points = to;
  std::vector<palpate_tool> tools(to.size(), palpate_default_tool());
  for (std::size_t i = 0; i < to.size(); ++i) {
    tools[i].points = points[i].data(), tools[i].point_count = 1;
    tools[i].disc_radius = radius, tools[i].friction = 0.3;
  }
  return step(tools.data(), static_cast<std::int32_t>(tools.size()));
}

std::vector<Eigen::Vector3d> Play::places() {
  const auto u = displacements(scene.get(), contacts, body_.body.surface_nodes);
  std::vector<Eigen::Vector3d> at;
  for (std::int32_t n = 0; n < body_.body.surface_nodes; ++n)
    at.push_back(body_.node(n) + Eigen::Map<const Eigen::Vector3f>(u.data() + 3 * n).cast<double>());
  return at;
}

double Play::front(double y, double z) {
  const auto at = places();
  double most = -1;
  for (const auto& t : body_.body.triangles) {
    const Eigen::Vector3d &a = at[t[0]], &b = at[t[1]], &c = at[t[2]];
    Eigen::Matrix2d m;
    m << b[1] - a[1], c[1] - a[1], b[2] - a[2], c[2] - a[2];
    if (std::abs(m.determinant()) < 1e-14) continue;
    const Eigen::Vector2d k = m.inverse() * Eigen::Vector2d(y - a[1], z - a[2]);
    if (k[0] >= 0 && k[1] >= 0 && k.sum() <= 1)
      most = std::max(most, a[0] + k[0] * (b[0] - a[0]) + k[1] * (c[0] - a[0]));
  }
  return most;
}

palpate_step_flags Play::step(const palpate_tool* tools, std::int32_t count) {
  const palpate_step_flags flags =
      palpate_scene_touch(scene.get(), tools, count, 1e-3, contacts.get(), contacts.bytes());
  for (int i = ++steps_ % solve_every == 0 ? 0 : most_solves; i < most_solves; ++i)
    if (palpate_scene_deform(scene.get()) <= 0) break;
  return flags;
}

}  // namespace palpate::tests
