/* palpate_watchdog.h - takes the force of a device away where the touch steps stop.
 *
 * palpate_device.h has the loop in which it stands.
 */
#ifndef PALPATE_WATCHDOG_H
#define PALPATE_WATCHDOG_H

#include "palpate_device.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Lets the force go where the contacts come no more: a touch thread that hangs, a link that is lost. It belongs into the thread
 * that sends forces to the device, which must not be the one that it watches. */
typedef struct palpate_watchdog_def {
  uint32_t struct_bytes; /* sizeof(palpate_watchdog_def) */
  int32_t reserved;      /* 0 */
  double timeout;        /* default 0.02 s: input that is older is silent */
  double fade;           /* default 0.1 s: from then on the force goes to zero in a straight line */
  double slew;           /* default 20 N/s: how fast the force comes back once input comes again */
} palpate_watchdog_def;
PALPATE_API void palpate_init_watchdog_def(palpate_watchdog_def* def, size_t struct_bytes);
static inline palpate_watchdog_def palpate_default_watchdog_def(void) {
  palpate_watchdog_def def;
  palpate_init_watchdog_def(&def, sizeof def);
  return def;
}

/* A watchdog. A host may read the fields; the functions alone write them. */
typedef struct palpate_watchdog {
  double age;                           /* s since the newest input */
  double device_force[3];               /* N, last sent */
  double timeout, fade, slew;           /* as initialised */
  double newest_force[3], silent_force; /* the library's own */
  uint64_t sequence;
  int32_t is_resuming, reserved_number;
  double reserved[8];
} palpate_watchdog;

PALPATE_API palpate_status palpate_watchdog_init(palpate_watchdog* watchdog, const palpate_watchdog_def* def,
                                                 palpate_error* error);

/* One tick of the device's thread. sequence: that of the newest input, such as palpate_contacts.step; input is new where the
 * sequence changes, and there is none yet while it is 0. force: of that input. dt: s since the last call, above 0. Writes the
 * force to send; both may be one array. While input comes, that is `force` to the bit. A force that is not finite is no input. */
PALPATE_API palpate_device_flags palpate_watchdog_step(palpate_watchdog* watchdog, uint64_t sequence,
                                                       const double force[3], double dt, double device_force[3]);

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_WATCHDOG_H */
