// 64 discs of 3 mm radius on the far face of a box, in rows of eight, pressed in by a millimetre.
#pragma once

#include <palpate/palpate_scene_def.hpp>

#include "tests/runtime/touched_box.h"

namespace palpate::tests {

struct ManyDiscs {
  static constexpr int kDiscs = 64;
  // A box whose far face is wide enough.
  static const TouchedBox& box() {
    static const TouchedBox shared({.cells = {3, 8, 7}});
    return shared;
  }
  // max_contact_nodes: below 0 for the default.
  explicit ManyDiscs(std::int32_t max_contact_nodes) : points(kDiscs) {
    SceneDef def = unlimited_def();
    if (max_contact_nodes >= 0) def.max_contact_nodes = max_contact_nodes;
    scene = box().scene(def);
    contacts = std::make_unique<Contacts>(scene.get());
    tool.points = points[0].data(), tool.point_count = kDiscs, tool.disc_radius = 0.003;
    press(-1e-4), press(1e-3);
  }
  void press(double depth) {
    for (int i = 0; i < kDiscs; ++i)
      points[i] = Eigen::Vector3d(0.06 - depth, 0.008 + 0.0045 * (i / 8), 0.006 + 0.004 * (i % 8));
    flags = palpate_scene_touch(scene.get(), &tool, 1, 1e-3, contacts->get(), contacts->bytes());
  }
  const palpate_tool_state& state() { return *palpate_contacts_tool(*contacts, 0); }
  Eigen::Vector3d force() { return Eigen::Vector3d(state().force_raw); }

  ScenePointer scene;
  std::unique_ptr<Contacts> contacts;
  std::vector<Eigen::Vector3d> points;
  palpate_tool tool = palpate_default_tool();
  palpate_step_flags flags = 0;
};

}  // namespace palpate::tests
