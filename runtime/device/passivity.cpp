// The account of the energy that a device gets, and the damper that balances it.
#include "runtime/device/device_check.h"

namespace palpate {
namespace {

// So many ticks in a row must the force be at rest before the account closes: a force that passes through zero is not at rest.
constexpr std::int32_t kTicksAtRest = 5;

// The largest damping that a controller may inject: a handle that is free, sampled and late stays stable up to three times this.
double most_damping(const palpate_device& device) {
  return device.mass / (2 * device.tick * (1 + device.delay_ticks));
}

// Books what the device got while it moved: held_force[delay_ticks] is the force that it held meanwhile.
void book(palpate_passivity& p, Vec3 move, double stored_energy) {
  const double got = dot(load3(p.held_force[p.delay_ticks]), move);
  const double taken = p.device_damping * dot(move, move) / p.tick;
  const double change = got - taken + stored_energy - p.stored_energy;
  p.generated += std::max(0.0, p.energy + change) - std::max(0.0, p.energy);
  p.energy += change;
  p.stored_energy = stored_energy;
}

}  // namespace
}  // namespace palpate

using namespace palpate;

void palpate_init_passivity_def(palpate_passivity_def* def, size_t struct_bytes) {
  palpate_passivity_def defaults = {};
  defaults.rest_force = 0.01, defaults.tolerance = 1e-4;
  write_host_struct(defaults, def, struct_bytes);
}

palpate_status palpate_passivity_init(palpate_passivity* passivity, const palpate_device* device,
                                      const palpate_passivity_def* def, palpate_error* error) {
  if (!passivity)
    return fail(error, PALPATE_ERROR_ARGUMENT, 0,
                "expected room for a palpate_passivity, found NULL; pass its address");
  *passivity = palpate_passivity{};
  palpate_device known;
  if (const palpate_status status = take_device(device, &known, error); status != PALPATE_OK) return status;
  palpate_passivity_def chosen = palpate_default_passivity_def();
  if (def)
    if (const palpate_status status = read_host_struct("passivity_def", def, &chosen, error); status != PALPATE_OK)
      return status;
  if (!(chosen.rest_force >= 0)) return refuse(error, "rest_force", "0 or more, in N", chosen.rest_force);
  if (!(chosen.tolerance >= 0)) return refuse(error, "tolerance", "0 or more, in J", chosen.tolerance);
  const double most = most_damping(known);
  if (!(chosen.controller >= 0 && chosen.controller <= most))
    return fail(error, PALPATE_ERROR_ARGUMENT, 0,
                "expected a controller of 0 to mass / (2 tick (1 + delay_ticks)) = %g N s/m, found %g; lower it", most,
                chosen.controller);
  passivity->rest_force = chosen.rest_force, passivity->tolerance = chosen.tolerance;
  passivity->controller = chosen.controller;
  passivity->tick = known.tick, passivity->device_damping = known.damping, passivity->force_limit = known.force_limit;
  passivity->delay_ticks = known.delay_ticks;
  return PALPATE_OK;
}

palpate_device_flags palpate_passivity_step(palpate_passivity* passivity, const double device_position[3],
                                            const double force[3], double stored_energy, double device_force[3]) {
  palpate_passivity& p = *passivity;
  palpate_device_flags flags = 0;
  Vec3 at = load3(device_position), send = load3(force);
  const Vec3 last = p.has_position ? load3(p.device_position) : at;
  if (!is_finite(at)) at = last, flags |= PALPATE_DEVICE_BAD_INPUT;
  if (!is_finite(send)) send = {}, flags |= PALPATE_DEVICE_BAD_INPUT;
  if (!std::isfinite(stored_energy)) stored_energy = p.stored_energy, flags |= PALPATE_DEVICE_BAD_INPUT;
  const Vec3 move = is_finite(last) ? at - last : Vec3{};
  if (p.has_position) book(p, move, stored_energy);
  if (is_finite(at)) {
    if (!p.has_position) p.stored_energy = stored_energy;
    p.has_position = 1;
    store3(at, p.device_position);
  }
  if (p.energy > p.tolerance) flags |= PALPATE_DEVICE_ACTIVE;

  // The damping whose work over a move like the last one is what the device got too much.
  const double squared = dot(move, move);
  p.injected = 0;
  if (p.energy > 0 && squared > 0) p.injected = std::min(p.controller, p.energy * p.tick / squared);
  send = send - (p.injected / p.tick) * move;
  bool was_longer = false;
  send = within(send, p.force_limit, &was_longer);
  if (was_longer) flags |= PALPATE_DEVICE_FORCE_LIMITED;

  for (int d = kMostDelayTicks; d > 0; --d) store3(load3(p.held_force[d - 1]), p.held_force[d]);
  store3(send, p.held_force[0]);
  p.ticks_at_rest = length(send) <= p.rest_force ? p.ticks_at_rest + 1 : 0;
  if (p.ticks_at_rest >= kTicksAtRest) p.energy = 0, p.ticks_at_rest = kTicksAtRest;
  store3(send, device_force);
  return flags;
}
