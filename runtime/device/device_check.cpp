#include "runtime/device/device_check.h"

namespace palpate {

palpate_status refuse(palpate_error* error, const char* name, const char* expected, double found) {
  return fail(error, PALPATE_ERROR_ARGUMENT, 0, "expected %s %s, found %g; set it", name, expected, found);
}

palpate_status take_device(const palpate_device* from, palpate_device* to, palpate_error* error) {
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

}  // namespace palpate
