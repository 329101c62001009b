// A short run that uses all effects of a scene.
#pragma once

#include "tests/runtime/touched_box.h"
#include "tests/support/bundle_forms.h"

namespace palpate::tests {

// A tool that comes down on the far face, slides a little and goes out again, and a grip beside it.
template <class Each>
void play(const TouchedBox& box, palpate_scene* scene, Contacts& contacts, int steps, Each each,
          double radius = 0.004) {
  const std::int32_t triangle = box.far_triangle(5);
  const Eigen::Vector3d place = box.place(triangle, {.3, .3, .4}), out = box.outward(triangle);
  for (int s = 0; s < steps; ++s) {
    const Eigen::Vector3d p =
        place + (0.002 * std::cos(0.05 * s)) * out + Eigen::Vector3d(0, 0.0005 * std::sin(0.03 * s), 0);
    const palpate_grip grip = grip_at_node(box.touchable[4], {0, 0, 0.001 * std::sin(0.02 * s)});
    const palpate_tool tools[2] = {point_tool(p.data(), 1, radius, 0.2), grip_tool(&grip)};
    each(palpate_scene_touch(scene, tools, 2, 1e-3, contacts.get(), contacts.bytes()));
  }
}

}  // namespace palpate::tests
