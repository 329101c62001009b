// Tissue that a grip, jaws or a clip hold above its rest, and a tool that presses it beside them.
#pragma once

#include "tests/runtime/linked_scene.h"

namespace palpate::tests {

enum class Holds { grip, jaws, clip };

// Holds a node on an edge of the box's top, lifts it by 6 mm, and presses the top beside it by 1.1 mm.
// A node under linear elasticity, a disc beside jaws and under large deformation, where a node is not the place that a tool touches.
struct Lifted : LinkedScene {
  Lifted(const TouchedBody& box, Holds with, palpate_contact_law law,
         palpate_deformation_model deformation = PALPATE_DEFORMATION_LINEAR)
      : LinkedScene(box, def_of(with, law, deformation)), holds(with) {}
  std::int32_t nearest(const Eigen::Vector3d& to) const {
    std::int32_t found = 0;
    for (std::int32_t n = 1; n < body.body.surface_nodes; ++n)
      if ((body.node(n) - to).norm() < (body.node(found) - to).norm()) found = n;
    return found;
  }
  static SceneDef def_of(Holds holds, palpate_contact_law law, palpate_deformation_model deformation) {
    const bool jaws = holds == Holds::jaws, disc = jaws || deformation != PALPATE_DEFORMATION_LINEAR;
    SceneDef def = unlimited_def(PALPATE_COLLISION_DEFORMED, disc ? PALPATE_CONTACT_PATCH : PALPATE_CONTACT_NODE,
                                 PALPATE_SHAPE_VOLUME, law, deformation);
    def.grasps.grasps = jaws, def.links.max_links = holds == Holds::clip;
    return def;
  }
  void step(double lift, const Eigen::Vector3d* pressed) {
    const Eigen::Vector3d to = body.node(held) + Eigen::Vector3d(0, 0, lift);
    palpate_grip grip = grip_at_place(place.triangle, place.weights, {0, 0, lift});
    palpate_grasp jaws = palpate_default_grasp();
    jaws.triangle = place.triangle, jaws.radius = 0.004;
    Eigen::Map<Eigen::Vector3d>(jaws.barycentric) = place.weights, Eigen::Map<Eigen::Vector3d>(jaws.position) = to;
    std::vector<palpate_tool> tools;
    if (pressed) tools = tools_of({pressed, 1}, 0.004);
    if (holds == Holds::grip) tools.push_back(grip_tool(&grip, 1));
    if (holds == Holds::jaws) tools.push_back(palpate_default_tool()), tools.back().parts = &jaws.part;
    if (holds == Holds::clip)
      set({link_of(PALPATE_LINK_CLIP, on_surface(place.triangle, place.weights), in_world(to), 0, INFINITY)});
    for (std::size_t t = 0; t < tools.size(); ++t) tools[t].id = static_cast<std::int32_t>(t);
    ASSERT_EQ(touch(tools), 0u);
  }
  // N, along z, on the tool.
  double press() {
    for (int s = 0; s <= 60; ++s) step(1e-4 * s, nullptr);
    for (int i = 0; i < 3; ++i) point[i] = body.node(top)[i] + shape()[3 * top + i] + (i == 2) * 1e-4;
    for (int s = 0; s < 60; ++s) point[2] -= 2e-5, step(6e-3, &point);
    return force(0)[2];
  }

  const Holds holds;
  const std::int32_t held = nearest({0.06, 0.015, 0.04}), top = nearest(body.node(held) - Eigen::Vector3d(0.012, 0, 0));
  const PlaceOnFace place = place_at(body, {0, 0, 1}, body.node(held));
  Eigen::Vector3d point;
};

}  // namespace palpate::tests
