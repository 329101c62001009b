// Tools that press a box under large deformation, and the surface as it is drawn.
#pragma once

#include <palpate/palpate_scene_def.hpp>

#include "tests/runtime/large/large_scene.h"

namespace palpate::tests {

const TouchedBox& large_box();

// Tools of one point each. Under LARGE_BESIDE a step is solved to its end before the next one, unless solve_every or most_solves says
// otherwise.
class Play {
 public:
  explicit Play(const SceneDef& def, const TouchedBody& body = large_box())
      : scene(body.scene(def)), contacts(scene.get()), body_(body) {}
  palpate_step_flags move(const std::vector<Eigen::Vector3d>& to, double radius = 0.006);
  palpate_step_flags touch(const palpate_tool& tool) { return step(&tool, 1); }
  int touching(int tool) { return palpate_contacts_tool(contacts, tool)->contact_count; }
  Eigen::Vector3d force(int tool) { return Eigen::Vector3d(palpate_contacts_tool(contacts, tool)->force_raw); }
  std::vector<Eigen::Vector3d> places();
  // The largest x at which a ray along x through (y, z) meets the deformed surface.
  double front(double y, double z);
  ScenePointer scene;
  Contacts contacts;
  std::vector<Eigen::Vector3d> points;
  int solve_every = 1, most_solves = 100;

 private:
  palpate_step_flags step(const palpate_tool* tools, std::int32_t count);
  int steps_ = 0;
  const TouchedBody& body_;
};

}  // namespace palpate::tests
