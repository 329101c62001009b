// How long a scene is played, and at which touch steps what is due.
#pragma once

#include <chrono>
#include <cstdint>
#include <vector>

#include "formats/scene_config.h"

namespace palpate {

// s, the last key frame of all tools, links, motions, loads, obstacles, blades and removals.
double duration_of(const SceneConfig& scene);
// Steps of the whole scene, both ends included.
std::uint64_t touch_count_of(const SceneConfig& scene);
// Errors: InputError where these are more than 1e8.
void check_touch_count(const SceneConfig& scene);

// The touch step at which number `index` of what happens `rate` times a second is due.
std::uint64_t step_of(std::uint64_t index, double rate, const SceneConfig& scene);
// Shapes that are due while the scene is played.
std::uint64_t frames_of(const SceneConfig& scene);

// The value of call, whose time is appended.
template <typename Call>
auto timed(std::vector<double>& microseconds, const Call& call) {
  using Clock = std::chrono::steady_clock;
  const auto start = Clock::now();
  const auto value = call();
  microseconds.push_back(std::chrono::duration<double, std::micro>(Clock::now() - start).count());
  return value;
}

}  // namespace palpate
