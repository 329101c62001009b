// Lets the force go where no new input comes.
#include "runtime/device/device_check.h"

using namespace palpate;

void palpate_init_watchdog_def(palpate_watchdog_def* def, size_t struct_bytes) {
  palpate_watchdog_def defaults = {};
  defaults.timeout = 0.02, defaults.fade = 0.1, defaults.slew = 20;
  write_host_struct(defaults, def, struct_bytes);
}

palpate_status palpate_watchdog_init(palpate_watchdog* watchdog, const palpate_watchdog_def* def,
                                     palpate_error* error) {
  if (!watchdog)
    return fail(error, PALPATE_ERROR_ARGUMENT, 0, "expected room for a palpate_watchdog, found NULL; pass its address");
  *watchdog = palpate_watchdog{};
  palpate_watchdog_def chosen = palpate_default_watchdog_def();
  if (def)
    if (const palpate_status status = read_host_struct("watchdog_def", def, &chosen, error); status != PALPATE_OK)
      return status;
  if (!is_positive(chosen.timeout)) return refuse(error, "timeout", "above 0 s", chosen.timeout);
  if (!is_positive(chosen.fade)) return refuse(error, "fade", "above 0 s", chosen.fade);
  if (!is_positive(chosen.slew)) return refuse(error, "slew", "above 0 N/s", chosen.slew);
  watchdog->timeout = chosen.timeout, watchdog->fade = chosen.fade, watchdog->slew = chosen.slew;
  return succeed(error);
}

palpate_device_flags palpate_watchdog_step(palpate_watchdog* watchdog, uint64_t sequence, const double force[3],
                                           double dt, double device_force[3]) {
  palpate_watchdog& w = *watchdog;
  palpate_device_flags flags = 0;
  const Vec3 given = load3(force);
  if (!is_positive(dt)) dt = w.timeout, flags |= PALPATE_DEVICE_BAD_INPUT;
  const bool is_new = sequence != w.sequence, is_usable = is_finite(given);
  if (!is_usable) flags |= PALPATE_DEVICE_BAD_INPUT;
  w.age += dt;
  if (is_new && is_usable) {
    w.sequence = sequence;
    w.age = 0;
    store3(given, w.newest_force);
  }

  Vec3 send = load3(w.newest_force);
  if (w.sequence == 0 || w.age > w.timeout) {
    // The force that was sent when silence began shrinks to zero; it never grows, even where the host changes `force`.
    const double left = std::max(0.0, 1 - (w.age - w.timeout) / w.fade);
    const double longest = w.sequence == 0 ? 0 : left * w.silent_force;
    bool was_longer = false;
    send = within(load3(w.device_force), longest, &was_longer);
    w.is_resuming = 1;
    flags |= PALPATE_DEVICE_SILENT;
  } else if (w.is_resuming) {
    bool is_far = false;
    const Vec3 last = load3(w.device_force);
    send = last + within(send - last, w.slew * dt, &is_far);
    w.is_resuming = is_far;
  }
  if (!(flags & PALPATE_DEVICE_SILENT)) w.silent_force = length(send);
  store3(send, w.device_force);
  store3(send, device_force);
  return flags;
}
