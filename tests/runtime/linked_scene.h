// A scene with links, and what their laws ask for in a dense body.
#pragma once

#include <palpate/palpate_scene_def.hpp>

#include "tests/runtime/touched_box.h"

namespace palpate::tests {

inline const Eigen::Vector3d kMiddle(.3, .3, .4);

palpate_link_end on_surface(std::int32_t triangle, Eigen::Vector3d k = kMiddle);
palpate_link_end in_world(Eigen::Vector3d point);
palpate_link link_of(palpate_link_kind kind, palpate_link_end a, palpate_link_end b, double rest_length = 0,
                     double stiffness = INFINITY);

struct LinkedScene : TouchedScene {
  LinkedScene(const TouchedBody& on, const SceneDef& def) : TouchedScene(on, def), body(on) {}
  void set(const std::vector<palpate_link>& wanted);
  // Without tools. The flags of the last one.
  palpate_step_flags steps(int count);
  const palpate_link_state& state(std::int32_t i = 0) const { return *palpate_scene_link_state(scene.get(), i); }
  Eigen::Vector3d place_of(const palpate_link_end& end, const Eigen::VectorXd& u) const;
  // The equilibrium: u is the displacement of the dense body under the forces that the links report, and these are those that the links' laws
  // ask for at these places. off: m, of the ends. within: N, of the forces' directions and sizes; share: of each tension, beside it.
  void expect_laws(const Eigen::VectorXd& u, double off, double within, double share = 0) const;

  const TouchedBody& body;
  std::vector<palpate_link> links;
};

}  // namespace palpate::tests
