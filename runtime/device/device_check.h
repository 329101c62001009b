// Checks that the objects of palpate_device.h share.
#pragma once

#include "runtime/base/host_struct.h"
#include "runtime/base/vec3.h"
#include "runtime/include/palpate/palpate_device.h"

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

inline palpate_status refuse(palpate_error* error, const char* name, const char* expected, double found) {
  return fail(error, PALPATE_ERROR_ARGUMENT, 0, "expected %s %s, found %g; set it", name, expected, found);
}

constexpr std::int32_t kMostDelayTicks = 3;

// Reads and checks the host's device.
inline palpate_status take_device(const palpate_device* from, palpate_device* to, palpate_error* error) {
  if (!from)
    return fail(error, PALPATE_ERROR_ARGUMENT, 0, "expected a palpate_device, found NULL; pass what you know of it");
  *to = palpate_default_device();
  if (const palpate_status status = read_host_struct("device", from, to, error); status != PALPATE_OK) return status;
  to->struct_bytes = sizeof *to;  // not the host's: *to may be read again
  if (!(is_positive(to->tick) && to->tick <= 0.1)) return refuse(error, "tick", "above 0, at most 0.1 s", to->tick);
  if (to->delay_ticks < 0 || to->delay_ticks > kMostDelayTicks)
    return refuse(error, "delay_ticks", "from 0 to 3", to->delay_ticks);
  if (!is_positive(to->mass)) return refuse(error, "the device's mass", "above 0 kg", to->mass);
  if (!is_positive(to->damping)) return refuse(error, "the device's damping", "above 0 N s/m", to->damping);
  if (!is_positive(to->force_limit)) return refuse(error, "force_limit", "above 0 N", to->force_limit);
  if (!is_positive(to->velocity_limit)) return refuse(error, "velocity_limit", "above 0 m/s", to->velocity_limit);
  return succeed(error);
}

// v, or a vector along it of length `most` where v is longer.
inline Vec3 within(Vec3 v, double most, bool* was_longer) {
  const double l = length(v);
  *was_longer = l > most;
  return *was_longer ? (most / l) * v : v;
}

}  // namespace palpate
