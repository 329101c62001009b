// A force or a torque as a haptic device may get it.
#pragma once

#include <algorithm>
#include <cstdint>

#include "runtime/base/vec3.h"
#include "runtime/include/palpate/palpate.h"

namespace palpate {

// s, the longest time over which one step may change a force at its slew. A haptic loop slower than 50 Hz does not feel like
// contact, so a longer time is a loop that stood still.
inline constexpr double kLongestSlew = 0.02;

// Whether a vector is longer than this. Of most forces squares tell it, without the root that takes as long as all else here.
inline bool is_longer(Vec3 v, double most) {
  return dot(v, v) > 0.99 * most * most && length(v) > most;
}

// raw: at most `limit` long, and changed by at most `slew` per second since the last step, whose result *last is and becomes this one's.
// A long dt (a wrong clock, or a loop that stood still) allows no larger change than kLongestSlew. Adds step flags to *flags.
inline Vec3 within_limits(Vec3 raw, double limit, double slew, double dt, Vec3* last, std::uint32_t* flags) {
  if (!is_finite(raw)) {
    *flags |= PALPATE_STEP_UNSOLVED;
    raw = Vec3{};
  }
  Vec3 sent = raw;
  if (is_longer(sent, limit)) {
    sent = (limit / length(sent)) * sent;
    *flags |= PALPATE_STEP_FORCE_LIMITED;
  }
  const Vec3 change = sent - *last;
  const double most = slew * std::min(dt, kLongestSlew);
  if (is_longer(change, most)) {
    sent = *last + (most / length(change)) * change;
    *flags |= PALPATE_STEP_FORCE_LIMITED;
  }
  return *last = sent;
}

}  // namespace palpate
