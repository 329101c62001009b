/* palpate_passivity.h - a passivity observer and controller between a force-feedback device and a scene.
 *
 * palpate_device.h has the loop in which it stands, and its sources.
 */
#ifndef PALPATE_PASSIVITY_H
#define PALPATE_PASSIVITY_H

#include "palpate_device.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Keeps the account of the energy that the device gets: the sum over the ticks of applied force times motion, which is exact
 * for a force that is held over a tick (Stramigioli et al. 2005), less what the device's own damping takes. An organ that is at
 * rest has no energy to give, so the account begins anew after the force was at rest for 5 ticks. */
typedef struct palpate_passivity_def {
  uint32_t struct_bytes; /* sizeof(palpate_passivity_def) */
  int32_t reserved;      /* 0 */
  double rest_force;     /* default 0.01 N: a force that is not longer is at rest */
  double tolerance;      /* default 1e-4 J: more than this on the account raises ACTIVE */
  double controller;     /* default 0: observe alone. Above 0, N s/m: damp the device, by at most this much, until the
                            account is balanced (Hannaford and Ryu 2002). At most mass / (2 tick (1 + delay_ticks)) */
} palpate_passivity_def;
PALPATE_API void palpate_init_passivity_def(palpate_passivity_def* def, size_t struct_bytes);
static inline palpate_passivity_def palpate_default_passivity_def(void) {
  palpate_passivity_def def;
  palpate_init_passivity_def(&def, sizeof def);
  return def;
}

/* An observer. A host may read the fields; the functions alone write them. */
typedef struct palpate_passivity {
  double energy;    /* J: the account since the force was last at rest; above 0: generated */
  double generated; /* J: of all accounts together, above 0 alone */
  double injected;  /* N s/m: the damping of the last step */
  double rest_force, tolerance, controller, tick, device_damping, force_limit; /* as initialised */
  double device_position[3], held_force[4][3], stored_energy;                  /* the library's own */
  int32_t delay_ticks, has_position, ticks_at_rest, reserved_number;
  double reserved[8];
} palpate_passivity;

PALPATE_API palpate_status palpate_passivity_init(palpate_passivity* passivity, const palpate_device* device,
                                                  const palpate_passivity_def* def, palpate_error* error);

/* One tick. force: about to be sent. stored_energy: coupling.energy, or 0 without a coupling. Writes the force to send, which
 * is `force` unless the controller damps; both may be one array. */
PALPATE_API palpate_device_flags palpate_passivity_step(palpate_passivity* passivity, const double device_position[3],
                                                        const double force[3], double stored_energy,
                                                        double device_force[3]);

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_PASSIVITY_H */
