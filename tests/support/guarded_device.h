// Coupling, watchdog and passivity controller in a row, as palpate_device.h shows, for tests that feed them steps of a scene.
#pragma once

#include "runtime/include/palpate/palpate_passivity.h"
#include "runtime/include/palpate/palpate_watchdog.h"

namespace palpate::tests {

struct GuardedDevice {
  GuardedDevice() {
    palpate_device device = palpate_default_device();
    device.mass = 0.1, device.damping = 0.5;
    palpate_passivity_def account = palpate_default_passivity_def();
    account.controller = 10;
    palpate_coupling_init(&coupling, &device, nullptr, nullptr);
    palpate_passivity_init(&passivity, &device, &account, nullptr);
    palpate_watchdog_init(&watchdog, nullptr, nullptr);
  }
  palpate_device_flags step(const double position[3], const double organ_force[3], std::uint64_t sequence) {
    palpate_device_flags flags = palpate_coupling_step(&coupling, position, organ_force, tool, force);
    flags |= palpate_watchdog_step(&watchdog, sequence, force, 1e-3, force);
    return flags | palpate_passivity_step(&passivity, position, force, coupling.energy, force);
  }
  palpate_coupling coupling = {};
  palpate_passivity passivity = {};
  palpate_watchdog watchdog = {};
  double tool[3] = {}, force[3] = {};
};

}  // namespace palpate::tests
