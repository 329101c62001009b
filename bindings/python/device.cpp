// palpate.Device, Coupling, Passivity and Watchdog: what stands between a force-feedback device and a scene.
#include <palpate/palpate_complete.h>

#include <optional>

#include "bindings/python/tools.h"

namespace palpate::python {
namespace {

// Three numbers that a call reads.
struct Three {
  double at[3];
  Three(const Numbers& from, const char* name) { set_numbers(at, from, name); }
};

palpate_device make_device(double mass, double damping, double tick, std::int32_t delay_ticks, double force_limit,
                           double velocity_limit) {
  palpate_device device = palpate_default_device();
  device.mass = mass, device.damping = damping, device.tick = tick, device.delay_ticks = delay_ticks;
  device.force_limit = force_limit, device.velocity_limit = velocity_limit;
  return device;
}

palpate_coupling make_coupling(const palpate_device& device, std::optional<double> stiffness,
                               std::optional<double> damping, std::optional<double> tool_mass) {
  palpate_coupling_def def = palpate_default_coupling_def(&device);
  if (stiffness) def.stiffness = *stiffness;
  if (damping) def.damping = *damping;
  if (tool_mass) def.tool_mass = *tool_mass;
  palpate_coupling coupling;
  throw_unless_ok([&](palpate_error* error) { return palpate_coupling_init(&coupling, &device, &def, error); });
  return coupling;
}

// The device's energy account, and the force that its last step gave out.
struct HeldPassivity {
  palpate_passivity passivity;
  double device_force[3] = {};
};

HeldPassivity make_passivity(const palpate_device& device, double rest_force, double tolerance, double controller) {
  palpate_passivity_def def = palpate_default_passivity_def();
  def.rest_force = rest_force, def.tolerance = tolerance, def.controller = controller;
  HeldPassivity held;
  throw_unless_ok([&](palpate_error* error) { return palpate_passivity_init(&held.passivity, &device, &def, error); });
  return held;
}

palpate_watchdog make_watchdog(double timeout, double fade, double slew) {
  palpate_watchdog_def def = palpate_default_watchdog_def();
  def.timeout = timeout, def.fade = fade, def.slew = slew;
  palpate_watchdog watchdog;
  throw_unless_ok([&](palpate_error* error) { return palpate_watchdog_init(&watchdog, &def, error); });
  return watchdog;
}

// A copy: the numbers of a step stay as they are when the next one runs.
py::array_t<double> copy_of(const double (&three)[3]) {
  return py::array_t<double>(3, three);
}

}  // namespace

void add_device(py::module_& module) {
  const palpate_device device = palpate_default_device();
  py::class_<palpate_device>(module, "Device", "What Coupling and Passivity know of a force-feedback device.")
      .def(py::init(&make_device), py::kw_only(), py::arg("mass"), py::arg("damping"), py::arg("tick") = device.tick,
           py::arg("delay_ticks") = device.delay_ticks, py::arg("force_limit") = device.force_limit,
           py::arg("velocity_limit") = device.velocity_limit,
           "mass: kg, of the handle; damping: N s/m, with nobody holding it; tick: s, from one force to the next;\n"
           "delay_ticks: 0 .. 3, from a position to the force that answers it; force_limit: N; velocity_limit: m/s")
      .def_readwrite("mass", &palpate_device::mass, "kg")
      .def_readwrite("damping", &palpate_device::damping, "N s/m, with nobody holding the handle")
      .def_readwrite("tick", &palpate_device::tick, "s")
      .def_readwrite("delay_ticks", &palpate_device::delay_ticks, "0 .. 3")
      .def_readwrite("force_limit", &palpate_device::force_limit, "N")
      .def_readwrite("velocity_limit", &palpate_device::velocity_limit, "m/s");

  py::class_<palpate_coupling>(module, "Coupling",
                               "A spring and a damper that pull a virtual tool after the device; the scene sees the "
                               "tool.")
      .def(py::init(&make_coupling), py::arg("device"), py::kw_only(), py::arg("stiffness") = py::none(),
           py::arg("damping") = py::none(), py::arg("tool_mass") = py::none(),
           "stiffness: N/m; damping: N s/m; tool_mass: kg; None: the stiffest coupling that the device's damping\n"
           "allows, less a tenth. Raises Error where the coupling needs more damping than the device has.")
      .def(
          "step",
          [](palpate_coupling& self, const Numbers& device_position, const Numbers& organ_force) {
            double tool[3], force[3];
            return device_flags(palpate_coupling_step(&self, Three(device_position, "device_position").at,
                                                      Three(organ_force, "organ_force").at, tool, force));
          },
          py::arg("device_position"), py::arg("organ_force"),
          "One tick. organ_force: N, on the tool, from the touch at the last tool_position. Returns DeviceFlags.")
      .def("reset", &palpate_coupling_reset, "The tool is where the device is in the next step, at rest.")
      .def_static("required_damping", &palpate_required_damping, py::arg("stiffness"), py::arg("damping"),
                  py::arg("tick"), py::arg("delay_ticks"),
                  "N s/m: the least damping of a device with which such a coupling is stable for every passive tool "
                  "and hand.")
      .def_property_readonly(
          "tool_position", [](const palpate_coupling& self) { return copy_of(self.tool_position); },
          "float64 [3], m: what the scene is sent")
      .def_property_readonly(
          "tool_velocity", [](const palpate_coupling& self) { return copy_of(self.tool_velocity); }, "float64 [3], m/s")
      .def_property_readonly(
          "device_force", [](const palpate_coupling& self) { return copy_of(self.device_force); },
          "float64 [3], N: what the device is sent")
      .def_readonly("organ_damping", &palpate_coupling::organ_damping, "N s/m: that the last step added to the tool")
      .def_readonly("energy", &palpate_coupling::energy, "J, in the spring and the moving tool")
      .def_readonly("stiffness", &palpate_coupling::stiffness, "N/m")
      .def_readonly("damping", &palpate_coupling::damping, "N s/m")
      .def_readonly("tool_mass", &palpate_coupling::tool_mass, "kg");

  const palpate_passivity_def account = palpate_default_passivity_def();
  py::class_<HeldPassivity>(module, "Passivity",
                            "Keeps the account of the energy that the device gets back beyond what it gave.")
      .def(py::init(&make_passivity), py::arg("device"), py::kw_only(), py::arg("rest_force") = account.rest_force,
           py::arg("tolerance") = account.tolerance, py::arg("controller") = account.controller,
           "rest_force: N, no longer force is at rest; tolerance: J, more raises ACTIVE; controller: N s/m, the most\n"
           "damping that is injected to balance the account; 0: none")
      .def(
          "step",
          [](HeldPassivity& self, const Numbers& device_position, const Numbers& force, double stored_energy) {
            return device_flags(palpate_passivity_step(&self.passivity, Three(device_position, "device_position").at,
                                                       Three(force, "force").at, stored_energy, self.device_force));
          },
          py::arg("device_position"), py::arg("force"), py::arg("stored_energy") = 0.0,
          "One tick. force: N, about to be sent; stored_energy: J, Coupling.energy. Returns DeviceFlags.")
      .def_property_readonly(
          "device_force", [](const HeldPassivity& self) { return copy_of(self.device_force); },
          "float64 [3], N: the force to send")
      .def_property_readonly(
          "energy", [](const HeldPassivity& self) { return self.passivity.energy; },
          "J: the account since the force was last at rest; above 0: generated")
      .def_property_readonly(
          "generated", [](const HeldPassivity& self) { return self.passivity.generated; }, "J, of all accounts")
      .def_property_readonly(
          "injected", [](const HeldPassivity& self) { return self.passivity.injected; },
          "N s/m: the damping of the last step");

  const palpate_watchdog_def silence = palpate_default_watchdog_def();
  py::class_<palpate_watchdog>(module, "Watchdog", "Lets the force go where no new input comes.")
      .def(py::init(&make_watchdog), py::kw_only(), py::arg("timeout") = silence.timeout,
           py::arg("fade") = silence.fade, py::arg("slew") = silence.slew,
           "timeout: s, older input is silent; fade: s, in which the force then goes to zero; slew: N/s, with which it "
           "comes back")
      .def(
          "step",
          [](palpate_watchdog& self, std::uint64_t sequence, const Numbers& force, double dt) {
            double sent[3];
            return device_flags(palpate_watchdog_step(&self, sequence, Three(force, "force").at, dt, sent));
          },
          py::arg("sequence"), py::arg("force"), py::arg("dt"),
          "One tick. sequence: that of the newest input, Contacts.step; 0: none yet; dt: s. Returns DeviceFlags.")
      .def_property_readonly(
          "device_force", [](const palpate_watchdog& self) { return copy_of(self.device_force); },
          "float64 [3], N: the force to send")
      .def_readonly("age", &palpate_watchdog::age, "s since the newest input");
}

}  // namespace palpate::python
