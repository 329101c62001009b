// Tools that press a box under large deformation, and the surface as it is drawn.
#pragma once

#include "tests/runtime/large/large_scene.h"

namespace palpate::tests {

inline const TouchedBox& large_box() {
  static const TouchedBox shared({}, with_large(false));
  return shared;
}

// Tools of one point each. Under LARGE_BESIDE a step is solved to its end before the next one, unless solve_every or most_solves says
// otherwise.
class Play {
 public:
  explicit Play(const palpate_scene_def& def, const TouchedBody& body = large_box())
      : scene(body.scene(def)), contacts(scene.get()), body_(body) {}
  palpate_step_flags move(const std::vector<Eigen::Vector3d>& to, double radius = 0.006) {
    points = to;
    std::vector<palpate_tool> tools(to.size(), palpate_default_tool());
    for (std::size_t i = 0; i < to.size(); ++i) {
      tools[i].points = points[i].data(), tools[i].point_count = 1;
      tools[i].disc_radius = radius, tools[i].friction = 0.3;
    }
    return step(tools.data(), static_cast<std::int32_t>(tools.size()));
  }
  palpate_step_flags touch(const palpate_tool& tool) { return step(&tool, 1); }
  int touching(int tool) { return palpate_contacts_tool(contacts, tool)->contact_count; }
  Eigen::Vector3d force(int tool) { return Eigen::Vector3d(palpate_contacts_tool(contacts, tool)->force_raw); }
  std::vector<Eigen::Vector3d> places() {
    const auto u = displacements(scene.get(), contacts, body_.body.surface_nodes);
    std::vector<Eigen::Vector3d> at;
    for (std::int32_t n = 0; n < body_.body.surface_nodes; ++n)
      at.push_back(body_.node(n) + Eigen::Map<const Eigen::Vector3f>(u.data() + 3 * n).cast<double>());
    return at;
  }
  // The largest x at which a ray along x through (y, z) meets the deformed surface.
  double front(double y, double z) {
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
  ScenePointer scene;
  Contacts contacts;
  std::vector<Eigen::Vector3d> points;
  int solve_every = 1, most_solves = 100;

 private:
  palpate_step_flags step(const palpate_tool* tools, std::int32_t count) {
    const palpate_step_flags flags =
        palpate_scene_touch(scene.get(), tools, count, 1e-3, contacts.get(), contacts.bytes());
    for (int i = ++steps_ % solve_every == 0 ? 0 : most_solves; i < most_solves; ++i)
      if (palpate_scene_deform(scene.get()) <= 0) break;
    return flags;
  }
  int steps_ = 0;
  const TouchedBody& body_;
};

}  // namespace palpate::tests
