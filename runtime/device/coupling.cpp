// The virtual coupling: a spring and a damper between the device and a virtual tool of some mass.
#include "runtime/device/device_check.h"

namespace palpate {
namespace {

// D(c) = (1 - cos(n t)) / (1 - c) with c = cos t, by the recurrence of Chebyshev's polynomials: no division by zero at c = 1.
double delay_factor(int n, double c) {
  double before = 0, now = 1;
  for (int i = 1; i < n; ++i) {
    const double next = 2 * c * now - before + 2;
    before = now, now = next;
  }
  return now;
}

// The stiffest coupling of palpate_required_damping <= b, for each delay: stiffness = kStiffness b / tick, damping = kDamping b.
// DeviceHelp.DefaultsAreTheStiffestCoupling computes them again.
constexpr double kStiffness[] = {2, 0.76980, 0.48345, 0.35485};
constexpr double kDamping[] = {0, 0.28178, 0.38004, 0.43061};
constexpr double kShareOfTheLimit =
    0.9;  // the rest lets vibrations decay, and covers what a device's damping varies by

// A damper that one tick of a wrong force could raise without bound would freeze the tool in the organ. This one leaves 1/50 of
// the tool's velocity. It is exact for organs up to 100 tool_mass / tick^2: a million newtons per metre for 10 g at 1 kHz.
constexpr double kMostOrganDamping = 50;  // tool masses per tick

// Twice the energy that the organ gave too much in the last tick, over the square of the last move: the organ's stiffness.
double measured_stiffness(Vec3 force_change, Vec3 move) {
  const double squared = dot(move, move);
  return squared > 0 ? std::max(0.0, -dot(force_change, move) / squared) : 0;
}

// Of a spring whose force ends at `limit`.
double spring_energy(double stretch, double stiffness, double limit) {
  const double end = limit / stiffness;
  return stretch <= end ? 0.5 * stiffness * stretch * stretch : limit * (stretch - 0.5 * end);
}

void place_tool(palpate_coupling& c, Vec3 at) {
  const palpate_coupling old = c;
  c = palpate_coupling{};
  c.stiffness = old.stiffness, c.damping = old.damping, c.tool_mass = old.tool_mass;
  c.tick = old.tick, c.force_limit = old.force_limit, c.velocity_limit = old.velocity_limit;
  c.has_position = 1;
  store3(at, c.device_position);
  store3(at, c.tool_position);
}

// Takes the organ's force on the tool. One that is not finite is no force.
palpate_device_flags take_organ_force(palpate_coupling& c, Vec3 force) {
  palpate_device_flags flags = 0;
  if (!is_finite(force)) force = {}, flags |= PALPATE_DEVICE_BAD_INPUT;
  // The device pulls with force_limit at most, so an organ that pushes with twice as much still wins.
  bool was_longer = false;
  force = within(force, 2 * c.force_limit, &was_longer);
  if (was_longer) flags |= PALPATE_DEVICE_FORCE_LIMITED;
  store3(load3(c.organ_force), c.organ_force_before);
  store3(force, c.organ_force);
  return flags;
}

// Moves device_position and returns by how much.
Vec3 take_device_position(palpate_coupling& c, Vec3 position, palpate_device_flags* flags) {
  const Vec3 last = load3(c.device_position);
  if (!is_finite(position)) position = last, *flags |= PALPATE_DEVICE_BAD_INPUT;
  bool was_longer = false;
  const Vec3 move = within(position - last, c.velocity_limit * c.tick, &was_longer);
  if (was_longer) *flags |= PALPATE_DEVICE_VELOCITY_LIMITED;
  store3(last + move, c.device_position);
  return move;
}

}  // namespace
}  // namespace palpate

using namespace palpate;

void palpate_init_device(palpate_device* device, size_t struct_bytes) {
  palpate_device defaults = {};
  defaults.delay_ticks = 1, defaults.tick = 1e-3;
  defaults.force_limit = 3, defaults.velocity_limit = 2;
  write_host_struct(defaults, device, struct_bytes);
}

double palpate_required_damping(double stiffness, double damping, double tick, int32_t delay_ticks) {
  if (!is_positive(stiffness) || !(damping >= 0 && std::isfinite(damping)) || !is_positive(tick) || delay_ticks < 0 ||
      delay_ticks > kMostDelayTicks)
    return NAN;
  const double s = 0.5 * stiffness * tick, y = s + damping;
  double most = 0;
  constexpr int kSteps = 1000;  // a polynomial of degree 4 in c: its maximum is missed by less than 1e-5 of it
  for (int i = 0; i <= kSteps; ++i) {
    const double c = (2.0 * i - kSteps) / kSteps;
    most = std::max(most, delay_factor(delay_ticks + 1, c) * (y * y * (1 - c) + s * s * (1 + c)) / (2 * y));
  }
  return most;
}

void palpate_init_coupling_def(palpate_coupling_def* def, size_t struct_bytes, const palpate_device* device) {
  palpate_coupling_def defaults = {};
  palpate_device known;
  if (take_device(device, &known, nullptr) == PALPATE_OK) {
    defaults.stiffness = kShareOfTheLimit * kStiffness[known.delay_ticks] * known.damping / known.tick;
    defaults.damping = kShareOfTheLimit * kDamping[known.delay_ticks] * known.damping;
    defaults.tool_mass = 0.1 * known.mass;
  }
  write_host_struct(defaults, def, struct_bytes);
}

palpate_status palpate_coupling_init(palpate_coupling* coupling, const palpate_device* device,
                                     const palpate_coupling_def* def, palpate_error* error) {
  if (!coupling)
    return fail(error, PALPATE_ERROR_ARGUMENT, 0, "expected room for a palpate_coupling, found NULL; pass its address");
  *coupling = palpate_coupling{};
  palpate_device known;
  if (const palpate_status status = take_device(device, &known, error); status != PALPATE_OK) return status;
  palpate_coupling_def chosen = palpate_default_coupling_def(&known);
  if (def)
    if (const palpate_status status = read_host_struct("coupling_def", def, &chosen, error); status != PALPATE_OK)
      return status;
  if (!is_positive(chosen.stiffness)) return refuse(error, "the coupling's stiffness", "above 0 N/m", chosen.stiffness);
  if (!(chosen.damping >= 0 && std::isfinite(chosen.damping)))
    return refuse(error, "the coupling's damping", "0 or more, in N s/m", chosen.damping);
  if (!is_positive(chosen.tool_mass)) return refuse(error, "tool_mass", "above 0 kg", chosen.tool_mass);
  const double required = palpate_required_damping(chosen.stiffness, chosen.damping, known.tick, known.delay_ticks);
  if (!(required <= known.damping))
    return fail(
        error, PALPATE_ERROR_ARGUMENT, 0,
        "expected a coupling that needs at most the device's damping of %g N s/m; one of %g N/m and %g N s/m needs %g; "
        "lower its stiffness, or take palpate_default_coupling_def",
        known.damping, chosen.stiffness, chosen.damping, required);
  coupling->stiffness = chosen.stiffness, coupling->damping = chosen.damping, coupling->tool_mass = chosen.tool_mass;
  coupling->tick = known.tick, coupling->force_limit = known.force_limit;
  coupling->velocity_limit = known.velocity_limit;
  return PALPATE_OK;
}

palpate_device_flags palpate_coupling_step(palpate_coupling* coupling, const double device_position[3],
                                           const double organ_force[3], double tool_position[3],
                                           double device_force[3]) {
  palpate_coupling& c = *coupling;
  const Vec3 position = load3(device_position), organ = load3(organ_force);
  if (!c.has_position) {
    if (is_finite(position)) place_tool(c, position);
    store3(load3(c.tool_position), tool_position);
    store3({}, device_force);
    return is_finite(position) ? 0 : PALPATE_DEVICE_BAD_INPUT;
  }
  palpate_device_flags flags = take_organ_force(c, organ);
  const double tick = c.tick, inertia = c.tool_mass / tick;
  const Vec3 device_velocity = (1 / tick) * take_device_position(c, position, &flags);
  const double stiffness = measured_stiffness(load3(c.organ_force) - load3(c.organ_force_before), load3(c.last_move));
  c.organ_damping = std::min(0.5 * tick * stiffness, kMostOrganDamping * inertia);

  // The tool's velocity v after this tick: inertia (v - last v) = organ force + pull - organ_damping v, where the pull of spring
  // and damper is that after the tick, stretch - tick v and device_velocity - v. (Implicit Euler; the organ alone is explicit.)
  const Vec3 stretch = load3(c.device_position) - load3(c.tool_position);
  const Vec3 driven = inertia * load3(c.tool_velocity) + load3(c.organ_force);
  const double own = inertia + c.organ_damping, coupled = c.stiffness * tick + c.damping;
  const Vec3 pulled = c.stiffness * stretch + c.damping * device_velocity;
  Vec3 velocity = (1 / (own + coupled)) * (driven + pulled);
  Vec3 pull = pulled - coupled * velocity;
  bool was_longer = false;
  pull = within(pull, c.force_limit, &was_longer);
  if (was_longer) {
    velocity = (1 / own) * (driven + pull);
    flags |= PALPATE_DEVICE_FORCE_LIMITED;
  }

  const Vec3 move = tick * velocity;
  store3(move, c.last_move);
  store3(velocity, c.tool_velocity);
  store3(load3(c.tool_position) + move, c.tool_position);
  store3(-1 * pull, c.device_force);
  c.energy =
      0.5 * c.tool_mass * dot(velocity, velocity) + spring_energy(length(stretch - move), c.stiffness, c.force_limit);
  store3(load3(c.tool_position), tool_position);
  store3(load3(c.device_force), device_force);
  return flags;
}

void palpate_coupling_reset(palpate_coupling* coupling) {
  coupling->has_position = 0;
}
