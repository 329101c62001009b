/* palpate_device.h - between a force-feedback device and a scene: a virtual coupling; beside it a passivity observer (palpate_passivity.h) and
 * a watchdog (palpate_watchdog.h).
 *
 * A device is sampled: it holds each force for a tick and gets the next one late. A stiff organ then returns more energy than
 * it got, and the device buzzes or kicks. The force of a spring of stiffness K, sent as it is, generates no energy as long as
 *
 *     K <= damping / (tick (1/2 + delay_ticks))                                                                          (1)
 *
 * (Colgate and Schenkel 1997; with delay: Gil et al. 2009, Hulin et al. 2014). For a stiffer organ put the virtual coupling
 * between the two: a spring and a damper that pull a virtual tool after the device. The scene sees the virtual tool, and the
 * device feels the spring and the damper. The loop is then stable with every passive hand, if the device's damping is at least
 * palpate_required_damping() of the coupling, and the organ's stiffness at most
 *
 *     4 tool_mass / tick^2      40,000 N/m for a virtual tool of 10 g at 1 kHz; a liver under a fingertip has about 100    (2)
 *
 * The price: an organ of stiffness K feels like one of K stiffness / (K + stiffness), and the virtual tool has a mass.
 *
 *   each tick    position = ...                                                  read the device
 *                palpate_coupling_step(&coupling, position, organ_force, tool_position, force);
 *                flags = palpate_scene_touch(scene, ...tool_position..., contacts);
 *                organ_force = flags are trusted ? palpate_contacts_tool(contacts, 0)->force_raw : zero
 *                palpate_watchdog_step(&watchdog, contacts->step, force, dt, force);      where another thread touches
 *                palpate_passivity_step(&passivity, position, force, coupling.energy, force);
 *                ... = force                                                     send it
 *
 * Each of the three works without the others. They are plain structs in the host's memory, with nothing to release. A step
 * never allocates, locks, prints or makes a system call. Vectors are x y z in one frame; SI units. One thread at a time for
 * each struct. The coupling moves a place; a tool that also turns keeps the device's own orientation.
 *
 * Sources
 *   Colgate and Schenkel 1997, Passivity of a class of sampled-data systems, Journal of Robotic Systems 14(1).
 *   Adams and Hannaford 1999, Stable haptic interaction with virtual environments, IEEE Trans. Robotics and Automation 15(3).
 *   Hannaford and Ryu 2002, Time-domain passivity control of haptic interfaces, IEEE Trans. Robotics and Automation 18(1).
 *   Stramigioli et al. 2005, Sampled data systems passivity and discrete port-Hamiltonian systems, IEEE Trans. Robotics 21(4).
 *   Gil et al. 2009, Stability of haptic rendering: discretization, quantization, time delay and Coulomb effects, and
 *   Hulin et al. 2014, Passivity and stability boundaries for haptic systems with time delay, IEEE Trans. CST 22(4).
 */
#ifndef PALPATE_DEVICE_H
#define PALPATE_DEVICE_H

#include "palpate.h"

#ifdef __cplusplus
extern "C" {
#endif

/* What the three know of the device. */
typedef struct palpate_device {
  uint32_t struct_bytes; /* sizeof(palpate_device) */
  int32_t delay_ticks;   /* default 1: whole ticks from reading a position to the force that answers it  [0 .. 3] */
  double tick;           /* default 0.001 s: from one force to the next. A tick that comes late counts as delay */
  double mass;           /* kg, of the handle and what moves with it. The default 0 is refused: the host must know it */
  double damping;        /* N s/m, in every direction, with nobody holding the handle. The default 0 is refused. To
                            measure it, raise the stiffness of a virtual wall until the free handle buzzes at it; eq. (1) */
  double force_limit;    /* default 3 N: largest length of the force that the device is sent */
  double velocity_limit; /* default 2 m/s: a position that moves faster counts as a fault of the device */
} palpate_device;
PALPATE_API void palpate_init_device(palpate_device* device, size_t struct_bytes);
static inline palpate_device palpate_default_device(void) {
  palpate_device device;
  palpate_init_device(&device, sizeof device);
  return device;
}

/* Bits that a step returns; 0: nothing to report. */
/* clang-format off */
enum {
  PALPATE_DEVICE_BAD_INPUT        = 1 << 0, /* NaN or infinity, or a time step that is not above 0: the last good input was used */
  PALPATE_DEVICE_FORCE_LIMITED    = 1 << 1, /* a force was cut to force_limit */
  PALPATE_DEVICE_VELOCITY_LIMITED = 1 << 2, /* the device moved faster than velocity_limit: the step follows at that speed */
  PALPATE_DEVICE_ACTIVE           = 1 << 3, /* the device got back more energy than it gave: the loop is not stable */
  PALPATE_DEVICE_SILENT           = 1 << 4  /* the watchdog has had no new input for its timeout */
};
/* clang-format on */
typedef uint32_t palpate_device_flags;

/* ---- virtual coupling -------------------------------------------------------------------------------------------- */

/* The least damping of a device, N s/m, with which a coupling is stable for every passive tool and hand, and every mass:
 *
 *     max over -1 <= c <= 1 of  D(c) ((s + B)^2 (1 - c) + s^2 (1 + c)) / (2 (s + B)),   s = K tick / 2
 *
 * with K and B the coupling's stiffness and damping, D(c) = (1 - cos(n t)) / (1 - c), c = cos t, n = delay_ticks + 1. This is
 * Llewellyn's criterion, as Adams and Hannaford use it, for the sampled coupling, its held force and its delay. Without delay it
 * is the bound of Colgate and Schenkel, B + K tick / 2. NaN where an argument is out of its range. */
PALPATE_API double palpate_required_damping(double stiffness, double damping, double tick, int32_t delay_ticks);

typedef struct palpate_coupling_def {
  uint32_t struct_bytes; /* sizeof(palpate_coupling_def) */
  int32_t reserved;      /* 0 */
  double stiffness;      /* N/m, above 0: of the spring; default: 0.9 times the most that the device's damping allows */
  double damping;        /* N s/m, 0 or more: of the damper beside it; default: what allows the stiffest spring */
  double tool_mass;      /* kg, above 0: of the virtual tool; the user feels it too; default: 0.1 times the device's */
} palpate_coupling_def;

/* The defaults for a device of damping b: with a delay of 0, 1, 2 and 3 ticks, stiffness = 1.80, 0.69, 0.44 and 0.32 b / tick
 * and damping = 0, 0.25, 0.34 and 0.39 b. A device that palpate_coupling_init would refuse: all 0. */
PALPATE_API void palpate_init_coupling_def(palpate_coupling_def* def, size_t struct_bytes,
                                           const palpate_device* device);
static inline palpate_coupling_def palpate_default_coupling_def(const palpate_device* device) {
  palpate_coupling_def def;
  palpate_init_coupling_def(&def, sizeof def, device);
  return def;
}

/* A coupling. A host may read the fields; the functions alone write them. */
typedef struct palpate_coupling {
  double tool_position[3]; /* m: what the scene is sent */
  double tool_velocity[3]; /* m/s */
  double device_force[3];  /* N: what the device is sent */
  double organ_damping;    /* N s/m: that the last step added, see below */
  double energy;           /* J, in the spring and the moving tool: an argument of palpate_passivity_step */
  double stiffness, damping, tool_mass, tick, force_limit, velocity_limit;        /* as initialised */
  double device_position[3], organ_force[3], organ_force_before[3], last_move[3]; /* the library's own */
  int32_t has_position, reserved_number;
  double reserved[8];
} palpate_coupling;

/* Checks device and def (NULL: the defaults for the device) and makes a coupling at rest. Refuses a coupling that needs more
 * damping than the device has. error may be NULL. */
PALPATE_API palpate_status palpate_coupling_init(palpate_coupling* coupling, const palpate_device* device,
                                                 const palpate_coupling_def* def, palpate_error* error);

/* One tick. device_position: where the device is now. organ_force: on the tool, from the touch at the last tool_position; its
 * length counts up to twice force_limit. Writes where the tool is now, for the next touch, and the force on the device. The
 * first step puts the tool where the device is. device_force may be the array of organ_force.
 *
 * The organ is evaluated at the tool's last place, so it gives the moving tool the energy -1/2 dF.dx too much in each tick, dF
 * and dx being the changes of force and place. The step measures that energy and takes it out again with a damper of
 * -tick dF.dx / (2 |dx|^2) on the tool. A tool in an organ that is a spring, whatever its stiffness, then gains no energy;
 * one that meets the organ from outside gains none up to eq. (2). */
PALPATE_API palpate_device_flags palpate_coupling_step(palpate_coupling* coupling, const double device_position[3],
                                                       const double organ_force[3], double tool_position[3],
                                                       double device_force[3]);

/* The tool is where the device is in the next step, at rest. For a device that was moved by other means. */
PALPATE_API void palpate_coupling_reset(palpate_coupling* coupling);

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_DEVICE_H */
