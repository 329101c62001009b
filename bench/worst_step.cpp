#include "bench/worst_step.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <memory>
#include <string>
#include <vector>

#include "tests/support/wandering_points.h"

namespace {

using palpate::tests::VisitedSurface, palpate::tests::WanderingPoint, palpate::tests::WanderingRandom;
constexpr int kTools = 4, kPointsOfATool = 16;
constexpr double kTick = 1e-3;

struct Load {
  int contacts = 0, nodes = 0, slips = 0, sweeps = 0;
  palpate_step_flags flags = 0;
};

// The worst step of a play, and the name and processor time of its most expensive pass.
struct Worst {
  double seconds = 0, pass_seconds = 0;
  std::size_t step = 0;
  Load load;
  std::string pass;
};

double processor_seconds() {
  timespec now = {};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// Adds up the time of each pass of a step.
struct PassTimes {
  std::vector<double> seconds;
  double last = 0;
  static void watch(void* self, std::int32_t pass) {
    auto& times = *static_cast<PassTimes*>(self);
    const double now = processor_seconds();
    times.seconds[pass] += now - times.last;
    times.last = now;
  }
};

// Plays the scene. A step's time is the less of this play's and what *seconds holds: what else the machine does falls out.
Worst play(palpate_bundle* bundle, const palpate_scene_def& def, double disc_radius, std::vector<double>* seconds) {
  palpate_scene* scene = nullptr;
  palpate_error error = {};
  if (palpate_scene_create(bundle, &def, &scene, &error) != PALPATE_OK) {
    std::fprintf(stderr, "runtime_bench: %s\n", error.text);
    std::exit(2);
  }
  const std::unique_ptr<palpate_scene, decltype(&palpate_scene_destroy)> owner(scene, &palpate_scene_destroy);
  std::vector<std::uint64_t> memory(palpate_contacts_bytes(scene) / 8 + 1);
  auto* contacts = reinterpret_cast<palpate_contacts*>(memory.data());
  const VisitedSurface surface(bundle);
  WanderingRandom random;
  std::vector<WanderingPoint> wanderers(kTools * kPointsOfATool, WanderingPoint(surface, random));
  std::vector<VisitedSurface::Point> points(wanderers.size());
  std::vector<palpate_tool> tools(kTools, palpate_default_tool());
  for (int t = 0; t < kTools; ++t) {
    tools[t].points = points[t * kPointsOfATool].data(), tools[t].point_count = kPointsOfATool;
    tools[t].disc_radius = disc_radius, tools[t].friction = 0.3;
  }
  std::int32_t pass_count = 0;
  while (palpate_scene_plan(scene, pass_count)) ++pass_count;
  PassTimes times;
  palpate_watch_passes(scene, &PassTimes::watch, &times);
  Worst worst;
  for (std::size_t s = 0; s < seconds->size(); ++s) {
    for (std::size_t p = 0; p < points.size(); ++p) points[p] = wanderers[p].step();
    times.seconds.assign(static_cast<std::size_t>(pass_count), 0);
    const double start = times.last = processor_seconds();
    Load load;
    load.flags = palpate_scene_touch(scene, tools.data(), kTools, kTick, contacts, memory.size() * sizeof memory[0]);
    (*seconds)[s] = std::min((*seconds)[s], processor_seconds() - start);
    if ((*seconds)[s] <= worst.seconds) continue;
    load.nodes = contacts->node_count, load.sweeps = contacts->sweeps;
    for (int t = 0; t < contacts->tool_count; ++t) {
      load.contacts += palpate_contacts_tool(contacts, t)->contact_count;
      load.slips += palpate_contacts_tool(contacts, t)->slip_count;
    }
    const auto most = std::max_element(times.seconds.begin(), times.seconds.end());
    const auto pass = static_cast<std::int32_t>(most - times.seconds.begin());
    worst = {(*seconds)[s], *most, s, load, palpate_scene_plan(scene, pass)->name};
  }
  return worst;
}

void report(palpate_bundle* bundle, const char* name, const palpate_scene_def& def, double disc_radius, long steps) {
  std::vector<double> seconds(static_cast<std::size_t>(steps), HUGE_VAL);
  play(bundle, def, disc_radius, &seconds);
  const Worst worst = play(bundle, def, disc_radius, &seconds);
  std::sort(seconds.begin(), seconds.end());
  const auto at = [&](double share) { return 1e6 * seconds[static_cast<std::size_t>(share * (steps - 1))]; };
  const auto late = std::count_if(seconds.begin(), seconds.end(), [](double s) { return s > kTick; });
  std::printf("%-22s %8.1f %8.1f %8.1f %8.1f %8.2f %%", name, at(0.5), at(0.99), at(0.999), at(1),
              100.0 * static_cast<double>(late) / static_cast<double>(steps));
  std::printf("   step %zu: contacts %d, nodes %d, slips %d, sweeps %d, flags %u; %.0f us in %s\n", worst.step,
              worst.load.contacts, worst.load.nodes, worst.load.slips, worst.load.sweeps, worst.load.flags,
              1e6 * worst.pass_seconds, worst.pass.c_str());
}

}  // namespace

void report_worst_steps(palpate_bundle* bundle, long steps) {
  std::printf(
      "%ld touches of %d points that hover, press, slide and jump; us of processor time, the less of two plays\n",
      steps, kTools * kPointsOfATool);
  std::printf("%-22s %8s %8s %8s %8s %10s   the worst step\n", "", "median", "99 %", "99.9 %", "worst", "over 1 ms");
  const std::array<const char*, 4> laws = {"sticking", "sliding", "unilateral", "coulomb"};
  for (const double disc_radius : {0.0, 0.005})
    for (const palpate_contact_law law : {PALPATE_LAW_STICKING, PALPATE_LAW_COULOMB}) {
      palpate_scene_def def = palpate_default_scene_def();
      def.collision = PALPATE_COLLISION_DEFORMED, def.law = law, def.shape = PALPATE_SHAPE_OFF;
      char name[64];
      std::snprintf(name, sizeof name, "%s, %s", laws[law], disc_radius > 0 ? "discs of 5 mm" : "points");
      report(bundle, name, def, disc_radius, steps);
    }
}
