#include "programs/player/scene_clock.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "formats/errors.h"

namespace palpate {

double duration_of(const SceneConfig& scene) {
  double last = 0;
  for (const auto& tool : scene.tools) {
    last = std::max(last, tool.path.back().time);
    if (!tool.turn.empty()) last = std::max(last, tool.turn.back().time);
    if (tool.given_force) last = std::max(last, tool.given_force->forces.back().time);
    if (tool.grasp && !tool.grasp->closing.empty()) last = std::max(last, tool.grasp->closing.back()[0]);
  }
  for (const auto& link : scene.links)
    for (const auto* rows : {&link.rest_length, &link.stiffness})
      if (!rows->empty()) last = std::max(last, rows->back()[0]);
  for (const auto& motion : scene.motions)
    if (!motion.amounts.empty()) last = std::max(last, motion.amounts.back()[0]);
  for (const auto& load : scene.loads) last = std::max(last, load.vectors.back().time);
  const auto add_ways = [&](const auto& moved) {
    for (const auto& one : moved)
      for (const auto* frames : {&one.path, &one.turn})
        if (!frames->empty()) last = std::max(last, frames->back().time);
  };
  add_ways(scene.obstacles), add_ways(scene.blades);
  for (const auto& blade : scene.blades)
    if (!blade.cuts.empty()) last = std::max(last, blade.cuts.back()[1]);
  for (const auto& removal : scene.removals) last = std::max({last, removal.path.back().time, removal.times.back()[1]});
  return last;
}

std::uint64_t touch_count_of(const SceneConfig& scene) {
  constexpr double rounding = 1e-9;  // relative: 0.3 s at 1000 Hz is 300 steps and one at the start
  return static_cast<std::uint64_t>(std::floor(duration_of(scene) * scene.touch_hz * (1 + rounding))) + 1;
}

void check_touch_count(const SceneConfig& scene) {
  constexpr double most = 1e8;
  if (duration_of(scene) * scene.touch_hz > most)
    throw InputError(fmt::format("{}: rate.touch: expected at most {} steps, found {} s at {} Hz", scene.file.string(),
                                 most, duration_of(scene), scene.touch_hz));
}

std::uint64_t step_of(std::uint64_t index, double rate, const SceneConfig& scene) {
  constexpr double rounding = 1e-9;  // so that 3 * 1000 / 50 is 60, not 61
  return static_cast<std::uint64_t>(std::ceil(static_cast<double>(index) * scene.touch_hz / rate - rounding));
}

std::uint64_t frames_of(const SceneConfig& scene) {
  const std::uint64_t steps = touch_count_of(scene);
  std::uint64_t count = 1;
  while (step_of(count, scene.shape_hz, scene) < steps) ++count;
  return count;
}

}  // namespace palpate
