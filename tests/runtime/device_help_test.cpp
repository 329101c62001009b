// palpate_device.h without an organ: its bounds, its refusals, bad input, the watchdog.
#include "runtime/include/palpate/palpate_complete.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <complex>
#include <cstring>
#include <palpate/palpate.hpp>
#include <string>

namespace {

using Complex = std::complex<double>;
using Eigen::Vector3d;

palpate_device known_device() {
  palpate_device device = palpate_default_device();
  device.mass = 0.1, device.damping = 0.5;
  return device;
}
palpate_coupling coupling_of(const palpate_device& device) {
  palpate_coupling coupling;
  EXPECT_EQ(palpate_coupling_init(&coupling, &device, nullptr, nullptr), PALPATE_OK);
  return coupling;
}

// The damping that a sampled impedance Z (force over velocity, both at the ticks) asks of a device at the frequency t / tick:
// Colgate and Schenkel 1997, with the factor of the delay.
double asked(Complex impedance, double t, int delay) {
  return -(std::exp(Complex(0, -(delay + 1) * t)) * impedance).real();
}
Complex spring_and_damper(double stiffness, double damping, double tick, double t) {
  return stiffness * tick / (1.0 - std::exp(Complex(0, -t))) + damping;
}
Complex in_series(Complex a, Complex b) {
  return a * b / (a + b);
}

TEST(DeviceHelp, RequiredDampingIsThatOfColgateAndSchenkelForNoDelay) {
  for (const double stiffness : {10.0, 300.0, 1e5})
    for (const double damping : {0.0, 0.1, 3.0})
      EXPECT_NEAR(palpate_required_damping(stiffness, damping, 1e-3, 0), 0.5e-3 * stiffness + damping,
                  1e-12 * stiffness + 1e-12);
}

TEST(DeviceHelp, RequiredDampingIsTheLeastForEveryPassiveTool) {
  for (const int delay : {0, 1, 2, 3})
    for (const double damping : {0.0, 0.05, 0.2, 1.0}) {
      const double stiffness = 400, tick = 1e-3;
      double most = 0;
      for (double t = 1e-3; t < M_PI; t += 1e-3)
        for (double turn = 0; turn < 1; turn += 0.005) {
          // Lossless tools are the hardest: a reactance of any size, from -infinity to infinity.
          const Complex tool(0, std::tan(M_PI * (turn - 0.4999)) * 0.5 * stiffness * tick);
          most = std::max(most, asked(in_series(spring_and_damper(stiffness, damping, tick, t), tool), t, delay));
        }
      const double required = palpate_required_damping(stiffness, damping, tick, delay);
      EXPECT_LE(most, required * (1 + 1e-9));
      EXPECT_GE(most, required * (1 - 0.01)) << "the grids of t and of the reactances miss at most this";
    }
}

TEST(DeviceHelp, RequiredDampingCoversTheVirtualToolAtASpringOfAnyStiffness) {
  const palpate_device device = known_device();
  for (const int delay : {0, 1, 2, 3})
    for (const double mass : {1e-4, 0.01, 1.0})
      for (double organ = 1; organ < 1e7; organ *= 3) {
        palpate_device late = device;
        late.delay_ticks = delay;
        const palpate_coupling_def def = palpate_default_coupling_def(&late);
        const double tick = device.tick;
        for (double t = 1e-3; t < M_PI; t += 1e-3) {
          // The tool's mass by backward differences, the organ a tick late, and the damping that the step adds.
          const Complex z = std::exp(Complex(0, t)), difference = 1.0 - 1.0 / z;
          const Complex tool = mass * difference / tick + organ * tick / (z * difference) + 0.5 * organ * tick;
          ASSERT_GE(tool.real(), -1e-9 * std::abs(tool)) << "the tool is passive";
          const Complex whole = in_series(spring_and_damper(def.stiffness, def.damping, tick, t), tool);
          ASSERT_LE(asked(whole, t, delay), device.damping);
        }
      }
}

TEST(DeviceHelp, DefaultsAreTheStiffestCoupling) {
  for (const int delay : {0, 1, 2, 3}) {
    palpate_device device = known_device();
    device.delay_ticks = delay;
    const palpate_coupling_def def = palpate_default_coupling_def(&device);
    const auto required = [&](double damping_per_stiffness) {  // of a coupling of 1 N/m
      return palpate_required_damping(1, damping_per_stiffness, device.tick, delay);
    };
    double least = INFINITY;
    for (int i = 0; i <= 4000; ++i) least = std::min(least, required(1e-6 * i));
    EXPECT_NEAR(def.stiffness, 0.9 * device.damping / least, 2e-4 * def.stiffness);
    EXPECT_NEAR(palpate_required_damping(def.stiffness, def.damping, device.tick, delay), 0.9 * device.damping, 1e-4);
    EXPECT_DOUBLE_EQ(def.tool_mass, 0.1 * device.mass);
  }
}

TEST(DeviceHelp, RefusesWhatItCannotUseWithASentence) {
  palpate_error error = {};
  palpate_coupling coupling;
  palpate_passivity passivity;
  palpate_watchdog watchdog;
  const auto refused = [&](auto change, const char* words) {
    palpate_device device = known_device();
    change(device);
    EXPECT_EQ(palpate_coupling_init(&coupling, &device, nullptr, &error), PALPATE_ERROR_ARGUMENT);
    EXPECT_NE(std::string(error.text).find(words), std::string::npos) << error.text;
    EXPECT_EQ(palpate_passivity_init(&passivity, &device, nullptr, &error), PALPATE_ERROR_ARGUMENT);
    EXPECT_NE(std::string(error.text).find(words), std::string::npos) << error.text;
    EXPECT_EQ(palpate_default_coupling_def(&device).stiffness, 0);
  };
  for (const double bad : {0.0, -1.0, double(NAN), double(INFINITY)}) {
    refused([=](palpate_device& d) { d.tick = bad; }, "tick");
    refused([=](palpate_device& d) { d.mass = bad; }, "mass");
    refused([=](palpate_device& d) { d.damping = bad; }, "damping");
    refused([=](palpate_device& d) { d.force_limit = bad; }, "force_limit");
    refused([=](palpate_device& d) { d.velocity_limit = bad; }, "velocity_limit");
  }
  for (const int bad : {-1, 4, INT32_MAX}) refused([=](palpate_device& d) { d.delay_ticks = bad; }, "delay_ticks");
  const palpate_device untouched = palpate_default_device();  // neither mass nor damping: the host has to know them
  EXPECT_EQ(palpate_coupling_init(&coupling, &untouched, nullptr, nullptr), PALPATE_ERROR_ARGUMENT);
  EXPECT_EQ(palpate_coupling_init(&coupling, nullptr, nullptr, &error), PALPATE_ERROR_ARGUMENT);

  const palpate_device device = known_device();
  const palpate_coupling_def good = palpate_default_coupling_def(&device);
  const auto bad_coupling = [&](double palpate_coupling_def::*field, std::initializer_list<double> values,
                                const char* word) {
    for (const double bad : values) {
      palpate_coupling_def def = good;
      def.*field = bad;
      EXPECT_EQ(palpate_coupling_init(&coupling, &device, &def, &error), PALPATE_ERROR_ARGUMENT) << bad;
      EXPECT_NE(std::string(error.text).find(word), std::string::npos) << error.text;
    }
  };
  bad_coupling(&palpate_coupling_def::stiffness, {0, -1, NAN, INFINITY, 10 * good.stiffness}, "stiffness");
  bad_coupling(&palpate_coupling_def::damping, {-1, NAN, INFINITY, 5}, "damping");
  bad_coupling(&palpate_coupling_def::tool_mass, {0, -1, NAN}, "tool_mass");
  for (const double bad : {0.0, -1.0, double(NAN)}) {
    palpate_watchdog_def w = palpate_default_watchdog_def();
    (bad == 0 ? w.timeout : bad < 0 ? w.fade : w.slew) = bad;
    EXPECT_EQ(palpate_watchdog_init(&watchdog, &w, &error), PALPATE_ERROR_ARGUMENT);
  }
  for (const double bad : {-1.0, double(NAN), 26.0}) {  // 0.1 kg / (2 * 1 ms * 2) = 25 N s/m
    palpate_passivity_def def = palpate_default_passivity_def();
    def.controller = bad;
    EXPECT_EQ(palpate_passivity_init(&passivity, &device, &def, &error), PALPATE_ERROR_ARGUMENT);
    EXPECT_NE(std::string(error.text).find("25 N s/m"), std::string::npos) << error.text;
  }
  EXPECT_EQ(palpate_coupling_init(nullptr, &device, nullptr, &error), PALPATE_ERROR_ARGUMENT);
  EXPECT_EQ(palpate_passivity_init(nullptr, &device, nullptr, &error), PALPATE_ERROR_ARGUMENT);
  EXPECT_EQ(palpate_watchdog_init(nullptr, nullptr, &error), PALPATE_ERROR_ARGUMENT);
}

// A struct as a later header declares it.
template <class Struct>
struct Later {
  Struct known;
  double added = 0;

  explicit Later(Struct from) : known(from) { known.struct_bytes = sizeof *this; }
};

// Takes `good` from any header, and refuses it without its size or with a field that is not known.
template <class Struct, class Init>
void expect_grows(const Struct& good, const char* name, Init init) {
  palpate_error error = {};
  Later<Struct> later(good);
  EXPECT_EQ(init(&later.known, &error), PALPATE_OK) << error.text;
  later.added = 1;
  EXPECT_EQ(init(&later.known, &error), PALPATE_ERROR_ARGUMENT);
  for (const std::uint32_t bytes : {0u, 4u, 12u, 0xccccccccu}) {
    Struct bad = good;
    bad.struct_bytes = bytes;
    EXPECT_EQ(init(&bad, &error), PALPATE_ERROR_ARGUMENT) << bytes;
    EXPECT_NE(std::string(error.text).find(name), std::string::npos) << error.text;
  }
}

TEST(DeviceHelp, StructsOfTheHostMayGrow) {
  const palpate_device device = known_device();
  palpate_coupling coupling;
  palpate_passivity passivity;
  palpate_watchdog watchdog;
  expect_grows(device, "palpate_default_device()", [&](const palpate_device* d, palpate_error* error) {
    return palpate_coupling_init(&coupling, d, nullptr, error);
  });
  expect_grows(palpate_default_coupling_def(&device), "palpate_default_coupling_def()",
               [&](const palpate_coupling_def* def, palpate_error* error) {
                 return palpate_coupling_init(&coupling, &device, def, error);
               });
  expect_grows(palpate_default_passivity_def(), "palpate_default_passivity_def()",
               [&](const palpate_passivity_def* def, palpate_error* error) {
                 return palpate_passivity_init(&passivity, &device, def, error);
               });
  expect_grows(palpate_default_watchdog_def(), "palpate_default_watchdog_def()",
               [&](const palpate_watchdog_def* def, palpate_error* error) {
                 return palpate_watchdog_init(&watchdog, def, error);
               });
  palpate_device earlier = device;
  earlier.struct_bytes = offsetof(palpate_device, force_limit);
  earlier.force_limit = -1, earlier.velocity_limit = NAN;  // what happens to lie there
  ASSERT_EQ(palpate_coupling_init(&coupling, &earlier, nullptr, nullptr), PALPATE_OK);
  EXPECT_EQ(coupling.force_limit, 3);
  EXPECT_EQ(coupling.velocity_limit, 2);
}

TEST(DeviceHelp, CouplingFollowsTheFreeHandAndWeighsWhatItSays) {
  palpate_coupling coupling = coupling_of(known_device());
  const double zero[3] = {};
  double tool[3], force[3];
  Vector3d at(1, 2, 3);
  EXPECT_EQ(palpate_coupling_step(&coupling, at.data(), zero, tool, force), 0u);
  EXPECT_EQ(Vector3d(tool), at) << "begins where the device is";
  EXPECT_EQ(Vector3d(force).norm(), 0);
  for (int k = 0; k < 2000; ++k) at[0] += 1e-4, palpate_coupling_step(&coupling, at.data(), zero, tool, force);
  EXPECT_NEAR(tool[0], at[0], 1e-9) << "0.1 m/s: no drag";
  EXPECT_NEAR(force[0], 0, 1e-9);
  double speed = 0.1;
  for (int k = 0; k < 1000; ++k) {
    speed += 1e-3;  // 1 m/s2
    at[0] += 1e-3 * speed;
    palpate_coupling_step(&coupling, at.data(), zero, tool, force);
  }
  EXPECT_NEAR(force[0], -0.1 * 0.1, 1e-6);  // N: tool_mass, 10 g, times the acceleration
  EXPECT_EQ(coupling.organ_damping, 0);
}

TEST(DeviceHelp, CouplingAndOrganFeelLikeTwoSpringsInARow) {
  palpate_coupling coupling = coupling_of(known_device());
  for (const double organ : {20.0, 100.0, 5000.0}) {
    palpate_coupling_reset(&coupling);
    double at[3] = {}, tool[3] = {}, force[3] = {}, organ_force[3] = {};
    palpate_coupling_step(&coupling, at, organ_force, tool, force);
    at[1] = 5e-3;
    for (int k = 0; k < 5000; ++k) {
      palpate_coupling_step(&coupling, at, organ_force, tool, force);
      organ_force[1] = -organ * tool[1];
    }
    EXPECT_NEAR(force[1], -5e-3 * organ * coupling.stiffness / (organ + coupling.stiffness), 1e-9);
    const double spring = 0.5 * force[1] * force[1] / coupling.stiffness;
    EXPECT_NEAR(coupling.energy, spring, 1e-9 * spring) << "the tool is still";
  }
}

TEST(DeviceHelp, CouplingIsBoundedAndFlaggedUnderEveryKindOfBadInput) {
  const palpate_device device = known_device();
  std::uint32_t state = 1;
  const auto random = [&] {  // any reproducible noise
    state = state * 1664525u + 1013904223u;
    return (state >> 8) * (1.0 / (1 << 24)) - 0.5;
  };
  const double odd[] = {NAN, INFINITY, -INFINITY, 1e300, -1e300, 5e-324, 1e18};
  palpate_coupling coupling = coupling_of(device);
  Vector3d at = Vector3d::Zero(), organ = at, tool = at, force = at, last = at;
  for (int k = 0; k < 200000; ++k) {
    at = Vector3d(random(), random(), random()) * (k % 7 == 0 ? 1.0 : 1e-3);
    organ = Vector3d(random(), random(), random()) * (k % 5 == 0 ? 1e3 : 1.0);
    const bool bad_position = k % 11 == 3, bad_force = k % 13 == 4;
    if (bad_position) at[k % 3] = odd[k % 7];
    if (bad_force) organ[k % 3] = odd[k % 5];
    const bool finite = at.allFinite(), finite_force = organ.allFinite();
    const double asked_to_move = (at - last).norm();
    const palpate_device_flags flags =
        palpate_coupling_step(&coupling, at.data(), organ.data(), tool.data(), force.data());
    ASSERT_TRUE(tool.allFinite() && force.allFinite() && std::isfinite(coupling.energy)) << k;
    ASSERT_LE(force.norm(), device.force_limit * (1 + 1e-12)) << k;
    const Vector3d now(coupling.device_position);
    if (k > 0) {
      ASSERT_LE((now - last).norm(), device.velocity_limit * device.tick * (1 + 1e-9)) << k;
    }
    ASSERT_EQ((flags & PALPATE_DEVICE_BAD_INPUT) != 0, !finite || (k > 0 && !finite_force)) << k;
    if (k > 0 && finite) {
      ASSERT_EQ((flags & PALPATE_DEVICE_VELOCITY_LIMITED) != 0, asked_to_move > device.velocity_limit * device.tick);
    }
    last = now;
  }
}

TEST(DeviceHelp, OneTickOfAnEndlessOrganForceMovesTheToolByWhatTwiceTheLimitWould) {
  const palpate_device device = known_device();
  palpate_coupling coupling = coupling_of(device);
  const double at[3] = {}, none[3] = {}, organ[3] = {0, 0, -1e9};
  double tool[3], force[3];
  palpate_coupling_step(&coupling, at, none, tool, force);
  EXPECT_EQ(palpate_coupling_step(&coupling, at, organ, tool, force),
            palpate_device_flags{PALPATE_DEVICE_FORCE_LIMITED});
  EXPECT_LE(-tool[2], 2 * device.force_limit * device.tick * device.tick / coupling.tool_mass);
}

TEST(DeviceHelp, PassivityForgetsWhatWasPaidInOnceTheForceIsAtRest) {
  const palpate_device device = known_device();
  palpate_passivity passivity;
  ASSERT_EQ(palpate_passivity_init(&passivity, &device, nullptr, nullptr), PALPATE_OK);
  double at[3] = {}, force[3] = {-1, 0, 0}, sent[3];
  for (int k = 0; k < 100; ++k) at[0] += 1e-4, palpate_passivity_step(&passivity, at, force, 0, sent);
  EXPECT_LT(passivity.energy, -9e-3);  // 1 N over 10 mm, and the device's friction
  force[0] = 0;
  for (int k = 0; k < 6; ++k) palpate_passivity_step(&passivity, at, force, 0, sent);
  EXPECT_EQ(passivity.energy, 0);
  EXPECT_EQ(passivity.generated, 0);
  // A force that pushes along the motion at once returns energy that nothing paid for.
  force[0] = 1;
  palpate_device_flags flags = 0;
  for (int k = 0; k < 50; ++k) at[0] += 1e-5, flags |= palpate_passivity_step(&passivity, at, force, 0, sent);
  EXPECT_EQ(flags, palpate_device_flags{PALPATE_DEVICE_ACTIVE});
  EXPECT_NEAR(passivity.generated, 48 * (1e-5 - 0.5 * 1e-10 / 1e-3), 1e-6);  // the first force is held a tick late
  EXPECT_EQ(passivity.generated, passivity.energy);
}

TEST(DeviceHelp, PassivityPassesBadInputOnAsNoForce) {
  const palpate_device device = known_device();
  palpate_passivity passivity;
  ASSERT_EQ(palpate_passivity_init(&passivity, &device, nullptr, nullptr), PALPATE_OK);
  const double good[3] = {0.1, 0, 0};
  double sent[3];
  for (const double bad : {double(NAN), double(INFINITY)}) {
    const double odd[3] = {0, bad, 0};
    EXPECT_EQ(palpate_passivity_step(&passivity, odd, good, 0, sent), PALPATE_DEVICE_BAD_INPUT);
    EXPECT_EQ(Vector3d(sent), Vector3d(good));
    EXPECT_EQ(palpate_passivity_step(&passivity, good, odd, 0, sent), PALPATE_DEVICE_BAD_INPUT);
    EXPECT_EQ(Vector3d(sent).norm(), 0);
    EXPECT_EQ(palpate_passivity_step(&passivity, good, good, bad, sent), PALPATE_DEVICE_BAD_INPUT);
    EXPECT_EQ(palpate_passivity_step(&passivity, good, good, 0, sent), 0u);
  }
  const double large[3] = {0, 40, 30};
  EXPECT_EQ(palpate_passivity_step(&passivity, good, large, 0, sent), PALPATE_DEVICE_FORCE_LIMITED);
  EXPECT_NEAR(Vector3d(sent).norm(), 3, 1e-12);
}

TEST(DeviceHelp, InjectedDampingLeavesAFreeHandleStableUpToThreeTimesItsLimit) {
  // mass v' = -damping v, the velocity by a backward difference, and the force held and late.
  for (const int delay : {0, 1, 2, 3}) {
    const double most = 1.0 / (2 * (1 + delay));  // times mass / tick
    const auto grows = [&](double damping) {
      double v[8] = {1, 1, 1, 1, 1, 1, 1, 1};
      for (int k = 0; k < 4000; ++k) {
        const double next = v[0] - damping * 0.5 * (v[delay] + v[delay + 1]);
        for (int i = 7; i > 0; --i) v[i] = v[i - 1];
        v[0] = next;
      }
      return !(std::abs(v[0]) + std::abs(v[1]) < 1e-3);
    };
    EXPECT_FALSE(grows(3 * most));
    EXPECT_TRUE(grows(5 * most));
  }
}

constexpr palpate_device_flags kSilent = PALPATE_DEVICE_SILENT;

struct Watched {
  Watched() { EXPECT_EQ(palpate_watchdog_init(&dog, nullptr, nullptr), PALPATE_OK); }
  palpate_device_flags step(std::uint64_t sequence, const Vector3d& force, double dt = 1e-3) {
    return palpate_watchdog_step(&dog, sequence, force.data(), dt, sent.data());
  }
  palpate_watchdog dog;
  Vector3d sent = Vector3d::Constant(NAN);
};

TEST(Watchdog, PassesForcesToTheBitWhileInputComes) {
  Watched w;
  for (std::uint64_t k = 1; k < 1000; ++k) {
    const Vector3d force(std::sin(0.1 * k), 1e-17 * k, -3.0 / k);
    // The device's thread runs three times as fast as the touch thread.
    for (int again = 0; again < 3; ++again) {
      EXPECT_EQ(w.step(k, force), 0u);
      EXPECT_EQ(w.sent, force);
    }
  }
}

TEST(Watchdog, LetsTheForceGoInTheStatedTimeWhenInputEnds) {
  Watched w;
  const Vector3d force(0, 2, -1);
  EXPECT_EQ(w.step(0, force), PALPATE_DEVICE_SILENT) << "nothing has come yet";
  EXPECT_EQ(w.sent.norm(), 0);
  w.step(7, force, 1.0);  // input that is new, however long it took: the force begins at the slew
  for (int k = 0; k < 1000; ++k) w.step(8 + k, force);
  ASSERT_EQ(w.sent, force);
  for (int k = 1; k <= 200; ++k) {
    const palpate_device_flags flags = w.step(1007, force);
    const double silent = 1e-3 * k - 0.02;  // s beyond the timeout
    if (std::abs(silent) < 1e-9) continue;  // either is right
    EXPECT_EQ(flags, silent > 0 ? kSilent : 0u) << k;
    const double left = silent > 0 ? std::max(0.0, 1 - silent / 0.1) : 1;
    EXPECT_NEAR((w.sent - left * force).norm(), 0, 1e-12) << k;
  }
  EXPECT_EQ(w.sent.norm(), 0);
}

TEST(Watchdog, LetsTheForceComeBackAtItsSlewAndIsThenOutOfTheWay) {
  Watched w;
  const Vector3d force(2, 0, 0);
  std::uint64_t sequence = 1;
  for (int k = 0; k < 200; ++k) w.step(sequence++, force);
  for (int k = 0; k < 300; ++k) w.step(sequence, force);
  double last = 0;
  int ticks = 0;
  for (; w.sent != -force && ticks < 1000; ++ticks) {
    EXPECT_EQ(w.step(++sequence, -force), 0u);
    EXPECT_LE(std::abs(w.sent[0] - last), 20 * 1e-3 * (1 + 1e-12));
    last = w.sent[0];
  }
  EXPECT_NEAR(ticks, 100, 2);  // 2 N at 20 N/s
  w.step(++sequence, force);
  EXPECT_EQ(w.sent, force) << "a change of any size passes as long as input comes";
}

TEST(Watchdog, TakesForcesThatAreNotFiniteAndTimesThatAreNotAboveZeroAsNoInput) {
  Watched w;
  const Vector3d force(1, 0, 0), bad(NAN, 0, INFINITY);
  std::uint64_t sequence = 1;
  for (int k = 0; k < 200; ++k) w.step(sequence++, force);
  for (int k = 1; k <= 300; ++k) {
    const palpate_device_flags flags = w.step(sequence++, bad);
    EXPECT_TRUE(flags & PALPATE_DEVICE_BAD_INPUT);
    ASSERT_TRUE(w.sent.allFinite());
  }
  EXPECT_EQ(w.sent.norm(), 0);
  for (int k = 0; k < 200; ++k) w.step(sequence++, force);
  ASSERT_EQ(w.sent, force);
  for (const double dt : {0.0, -1.0, double(NAN), double(INFINITY), 0.0, 0.0, 0.0}) {  // each counts as a timeout
    EXPECT_TRUE(w.step(sequence, force, dt) & PALPATE_DEVICE_BAD_INPUT);
    EXPECT_LE(w.sent.norm(), 1);
  }
  EXPECT_EQ(w.sent.norm(), 0) << "a clock that stands still does not keep the force";
}

// ---- palpate.hpp; tests/embed/without_exceptions.cpp plays its steps -----------------------------------------------------

// The words of the refusal that `make` throws; empty where it throws none.
template <class Make>
std::string thrown_by(Make make) {
  try {
    make();
  } catch (const palpate::Error& error) {
    EXPECT_EQ(error.detail.status, PALPATE_ERROR_ARGUMENT);
    return error.what();
  }
  return "";
}

TEST(DeviceHelpInCpp, ConstructorsThrowWhatTheFunctionsRefuse) {
  const palpate_device unknown = palpate_default_device(), known = known_device();
  EXPECT_NE(thrown_by([&] { palpate::Coupling{unknown}; }), "");
  EXPECT_NE(thrown_by([&] { palpate::PassivityObserver{unknown}; }), "");
  palpate_watchdog_def def = palpate_default_watchdog_def();
  EXPECT_EQ(thrown_by([&] { palpate::Watchdog{def}; }), "");
  def.slew = NAN;
  EXPECT_NE(thrown_by([&] { palpate::Watchdog{def}; }), "");

  EXPECT_TRUE(palpate::Coupling(known) && palpate::PassivityObserver(known));
  EXPECT_FALSE(palpate::Coupling() || palpate::PassivityObserver() || palpate::Watchdog());
  palpate_coupling_def stiff = palpate_default_coupling_def(&known);
  stiff.stiffness *= 2;
  EXPECT_NE(thrown_by([&] { palpate::Coupling(known, &stiff); }).find("lower its stiffness"), std::string::npos);
}

TEST(DeviceHelpInCpp, StepsAreThoseOfTheFunctions) {
  const palpate_device device = known_device();
  palpate::Coupling coupling(device);
  palpate_coupling expected = coupling_of(device);
  double at[3], organ[3] = {}, tool[3], force[3], expected_tool[3], expected_force[3];
  for (int tick = 0; tick < 50; ++tick) {
    for (int d = 0; d < 3; ++d) at[d] = 1e-4 * tick * (d + 1), organ[d] = -100 * at[d];
    EXPECT_EQ(coupling.step(at, organ, tool, force),
              palpate_coupling_step(&expected, at, organ, expected_tool, expected_force));
    EXPECT_TRUE(std::equal(tool, tool + 3, expected_tool) && std::equal(force, force + 3, expected_force));
    EXPECT_EQ(coupling->energy, expected.energy);
  }
}

}  // namespace
