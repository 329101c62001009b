// Makes a scene definition and moving tools from a fuzzer's bytes.
#pragma once

#include <algorithm>
#include <array>

#include <palpate/palpate_scene_def.hpp>
#include "tests/fuzz/fuzz_input.h"

namespace palpate::tests {

// Any effects. The limits are small, so that steps reach them.
inline SceneDef fuzzed_effects(FuzzInput& input) {
  SceneDef def;
  def.collision = static_cast<palpate_collision>(input.below(3));
  def.contact = static_cast<palpate_contact_model>(input.below(4));
  def.law = static_cast<palpate_contact_law>(input.below(4));
  def.force = static_cast<palpate_force_model>(input.below(3));
  def.shape = static_cast<palpate_shape_model>(input.below(3));
  if (def.shape != PALPATE_SHAPE_OFF) def.radial = static_cast<palpate_radial_model>(input.below(2));
  def.preload = static_cast<palpate_preload_model>(input.below(2));
  if (def.shape == PALPATE_SHAPE_VOLUME && def.preload == PALPATE_PRELOAD_ON) def.inside.inside = PALPATE_INSIDE_ON;
  if (def.force != PALPATE_FORCE_OFF && input.flag()) {
    def.relaxation.terms = 1;
    def.relaxation.share[0] = 0.5, def.relaxation.time[0] = 0.01;
  }
  def.max_tools = 3, def.max_points = 8;
  // 0, or as many as the points need, or some more.
  const auto nodes = static_cast<std::int32_t>(input.below(41));
  const std::int32_t fewest = (def.contact == PALPATE_CONTACT_TRIANGLE ? 3 : 1) * def.max_points;
  def.max_contact_nodes = nodes == 0 ? 0 : std::max(nodes, fewest);
  return def;
}

// Tools, each with its own points and grips.
class FuzzedTools {
 public:
  static constexpr std::int32_t kTools = 4, kPoints = 6;  // more than the scene allows

  // surface_nodes, triangles: the bundle's counts; half: half the size of the body, m: points move about the body's middle.
  void take(FuzzInput& input, std::int32_t surface_nodes, std::int32_t triangles, const double middle[3], double half) {
    count = static_cast<std::int32_t>(input.below(kTools + 1));
    dt = input.below(8) == 0 ? input.number(1) : 1e-3;
    for (std::int32_t t = 0; t < count; ++t) {
      palpate_tool& tool = tools[t];
      tool = palpate_default_tool();
      tool.points = points[t].data(), tool.grips = grips[t].data();
      tool.point_count = static_cast<std::int32_t>(input.below(kPoints + 1));
      tool.grip_count = static_cast<std::int32_t>(input.below(3));
      tool.hold = input.flag();
      tool.disc_radius = input.flag() ? std::fabs(input.number(half)) : 0;
      tool.friction = input.flag() ? std::fabs(input.number(1)) : 0;
      for (std::int32_t i = 0; i < 3 * tool.point_count; ++i) points[t][i] = middle[i % 3] + input.number(1.3 * half);
      for (std::int32_t g = 0; g < tool.grip_count; ++g) {
        palpate_grip& grip = grips[t][g];
        grip = palpate_default_grip();
        grip.kind = input.flag() ? PALPATE_GRIP_NODE : PALPATE_GRIP_SURFACE_POINT;
        if (grip.kind == PALPATE_GRIP_NODE) grip.node = input.integer(surface_nodes);
        grip.triangle = input.integer(triangles);
        const double k = input.below(256) / 255.0, l = (1 - k) * (input.below(256) / 255.0);
        grip.barycentric[0] = k, grip.barycentric[1] = l, grip.barycentric[2] = 1 - k - l;
        for (double& u : grip.displacement) u = input.number(0.1 * half);
        grip.axes = input.below(9);
      }
    }
  }

  std::int32_t count = 0;
  double dt = 1e-3;
  std::array<palpate_tool, kTools> tools = {};  // the first `count` are set

 protected:
  std::array<std::array<double, 3 * kPoints>, kTools> points = {};
  std::array<std::array<palpate_grip, 3>, kTools> grips = {};
};

}  // namespace palpate::tests
