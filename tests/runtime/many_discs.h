// 64 discs of 3 mm radius on the far face of a box, in rows of eight, pressed in by a millimetre.
#pragma once

#include <palpate/palpate_scene_def.hpp>

#include "tests/runtime/touched_box.h"

namespace palpate::tests {

struct ManyDiscs : TouchedScene {
  static constexpr int kDiscs = 64;
  // A box whose far face is wide enough.
  static const TouchedBox& box() {
    static const TouchedBox shared({.cells = {3, 8, 7}});
    return shared;
  }
  // max_contact_nodes: below 0 for the default.
  explicit ManyDiscs(std::int32_t max_contact_nodes) : TouchedScene(box(), def_of(max_contact_nodes)) {
    press(-1e-4), press(1e-3);
  }
  void press(double depth) {
    std::vector<Eigen::Vector3d> points;
    for (int i = 0; i < kDiscs; ++i)
      points.emplace_back(0.06 - depth, 0.008 + 0.0045 * (i / 8), 0.006 + 0.004 * (i % 8));
    touch({point_tool(points[0].data(), kDiscs, 0.003)});
  }

 private:
  static SceneDef def_of(std::int32_t max_contact_nodes) {
    SceneDef def = unlimited_def();
    if (max_contact_nodes >= 0) def.max_contact_nodes = max_contact_nodes;
    return def;
  }
};

}  // namespace palpate::tests
