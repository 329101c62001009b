// Checks that the objects of palpate_device.h share.
#pragma once

#include "runtime/base/host_struct.h"
#include "runtime/base/vec3.h"
#include "runtime/include/palpate/palpate_passivity.h"
#include "runtime/include/palpate/palpate_watchdog.h"

namespace palpate {

// The end of the fields that have no default (runtime/base/host_struct.h).
template <>
inline constexpr std::size_t kLeastStructBytes<palpate_device> = offsetof(palpate_device, force_limit);
template <>
inline constexpr std::size_t kLeastStructBytes<palpate_coupling_def> = sizeof(palpate_coupling_def);
template <>
inline constexpr std::size_t kLeastStructBytes<palpate_passivity_def> = offsetof(palpate_passivity_def, rest_force);
template <>
inline constexpr std::size_t kLeastStructBytes<palpate_watchdog_def> = offsetof(palpate_watchdog_def, timeout);

inline bool is_positive(double x) {
  return x > 0 && std::isfinite(x);
}

constexpr std::int32_t kMostDelayTicks = 3;

// "expected tick above 0 s, found -1; set it"
palpate_status refuse(palpate_error* error, const char* name, const char* expected, double found);

// Reads and checks the host's device.
palpate_status take_device(const palpate_device* from, palpate_device* to, palpate_error* error);

// v, or a vector along it of length `most` where v is longer.
inline Vec3 within(Vec3 v, double most, bool* was_longer) {
  const double l = length(v);
  *was_longer = l > most;
  return *was_longer ? (most / l) * v : v;
}

}  // namespace palpate
