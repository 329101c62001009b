#include "bench/worst_step.h"
#include <palpate/palpate_scene_def.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "studies/timing/timing.h"
#include "tests/support/wandering_points.h"

namespace {

using palpate::studies::thread_seconds;
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
  // Of all steps; and what no step may count.
  std::int64_t counted = 0, bound = 0;
};

// The tools of each step of a scene.
class Tools {
 public:
  virtual ~Tools() = default;
  virtual const std::vector<palpate_tool>& next() = 0;
};
using MakeTools = std::unique_ptr<Tools> (*)(const palpate_bundle*, double disc_radius);

// Points that hover, press, slide and jump.
class Wanderers : public Tools {
 public:
  Wanderers(const palpate_bundle* bundle, double disc_radius)
      : surface_(bundle),
        wanderers_(kTools * kPointsOfATool, WanderingPoint(surface_, random_)),
        points_(wanderers_.size()),
        tools_(kTools, palpate_default_tool()) {
    for (int t = 0; t < kTools; ++t) {
      tools_[t].points = points_[t * kPointsOfATool].data(), tools_[t].point_count = kPointsOfATool;
      tools_[t].disc_radius = disc_radius, tools_[t].friction = 0.3;
    }
  }
  const std::vector<palpate_tool>& next() override {
    for (std::size_t p = 0; p < points_.size(); ++p) points_[p] = wanderers_[p].step();
    return tools_;
  }

 private:
  const VisitedSurface surface_;
  WanderingRandom random_;
  std::vector<WanderingPoint> wanderers_;
  std::vector<VisitedSurface::Point> points_;
  std::vector<palpate_tool> tools_;
};

// Grips in one triangle, each with a displacement of its own, that move to other places of it, and go, all at once.
class GripCrowd : public Tools {
 public:
  static constexpr int kGrips = 350;
  GripCrowd(const palpate_bundle* bundle, double) : tools_(1, palpate_default_tool()), grips_(kGrips) {
    const VisitedSurface surface(bundle);
    const std::int32_t node = surface.touchable[surface.touchable.size() / 2];
    for (std::int32_t t = 0; t < palpate_bundle_describe(bundle).triangle_count; ++t)
      for (int v = 0; v < 3; ++v)
        if (palpate_bundle_triangles(bundle)[3 * t + v] == node) triangle_ = t;
    tools_[0].grips = grips_.data();
  }
  const std::vector<palpate_tool>& next() override {
    if (step_ % 10 == 0)
      for (palpate_grip& grip : grips_) {
        grip = palpate_default_grip();
        grip.kind = PALPATE_GRIP_SURFACE_POINT, grip.triangle = triangle_;
        grip.barycentric[0] = random_(0, 1), grip.barycentric[1] = random_(0, 1 - grip.barycentric[0]);
        grip.barycentric[2] = 1 - grip.barycentric[0] - grip.barycentric[1];
        for (double& d : grip.displacement) d = random_(-1e-3, 1e-3);
      }
    tools_[0].grip_count = step_++ % 100 < 90 ? kGrips : 0;
    return tools_;
  }

 private:
  WanderingRandom random_;
  std::vector<palpate_tool> tools_;
  std::vector<palpate_grip> grips_;
  std::int32_t triangle_ = 0;
  int step_ = 0;
};

// Points that hover 1 mm over a surface that grips dent.
class Hoverers : public Tools {
 public:
  Hoverers(const palpate_bundle* bundle, double)
      : surface_(bundle), tools_(2, palpate_default_tool()), grips_(20), points_(43) {
    tools_[0].grips = grips_.data(), tools_[0].grip_count = static_cast<std::int32_t>(grips_.size());
    tools_[1].points = points_[0].data(), tools_[1].point_count = static_cast<std::int32_t>(points_.size());
  }
  const std::vector<palpate_tool>& next() override {
    const auto node = [&](std::size_t i) { return surface_.touchable[i * 997 % surface_.touchable.size()]; };
    for (std::size_t g = 0; g < grips_.size(); ++g) {
      grips_[g] = palpate_default_grip();
      grips_[g].kind = PALPATE_GRIP_NODE, grips_[g].node = node(g);
      for (int d = 0; d < 3; ++d)
        grips_[g].displacement[d] =
            -3e-3 * std::sin(0.05 * step_ + static_cast<double>(g)) * surface_.normal[node(g)][d];
    }
    for (std::size_t p = 0; p < points_.size(); ++p)
      for (int d = 0; d < 3; ++d)
        points_[p][d] = surface_.place[node(p)][d] + 1e-3 * surface_.normal[node(p)][d] + random_(-1e-4, 1e-4);
    ++step_;
    return tools_;
  }

 private:
  const VisitedSurface surface_;
  WanderingRandom random_;
  std::vector<palpate_tool> tools_;
  std::vector<palpate_grip> grips_;
  std::vector<VisitedSurface::Point> points_;
  int step_ = 0;
};

template <class T>
std::unique_ptr<Tools> make(const palpate_bundle* bundle, double disc_radius) {
  return std::make_unique<T>(bundle, disc_radius);
}

// Adds up the time of each pass of a step.
struct PassTimes {
  std::vector<double> seconds;
  double last = 0;
  static void watch(void* self, std::int32_t pass) {
    auto& times = *static_cast<PassTimes*>(self);
    const double now = thread_seconds();
    times.seconds[pass] += now - times.last;
    times.last = now;
  }
};

// Plays the scene. A step's time is the less of this play's and what *seconds holds: what else the machine does falls out.
Worst play(palpate_bundle* bundle, const palpate::SceneDef& def, Tools& tools, std::vector<double>* seconds) {
  palpate_scene* scene = nullptr;
  palpate_error error = {};
  if (palpate_scene_create(bundle, &def, &scene, &error) != PALPATE_OK) {
    std::fprintf(stderr, "runtime_bench: %s\n", error.text);
    std::exit(2);
  }
  const std::unique_ptr<palpate_scene, decltype(&palpate_scene_destroy)> owner(scene, &palpate_scene_destroy);
  std::vector<std::uint64_t> memory(palpate_contacts_bytes(scene) / 8 + 1);
  auto* contacts = reinterpret_cast<palpate_contacts*>(memory.data());
  std::int32_t pass_count = 0;
  while (palpate_scene_plan(scene, pass_count)) ++pass_count;
  PassTimes times;
  palpate_watch_passes(scene, &PassTimes::watch, &times);
  Worst worst;
  worst.bound = palpate_scene_most_operations(scene);
  for (std::size_t s = 0; s < seconds->size(); ++s) {
    const std::vector<palpate_tool>& sent = tools.next();
    times.seconds.assign(static_cast<std::size_t>(pass_count), 0);
    const double start = times.last = thread_seconds();
    Load load;
    load.flags = palpate_scene_touch(scene, sent.data(), static_cast<std::int32_t>(sent.size()), kTick, contacts,
                                     memory.size() * sizeof memory[0]);
    worst.counted = std::max<std::int64_t>(worst.counted, contacts->operations);
    (*seconds)[s] = std::min((*seconds)[s], thread_seconds() - start);
    if ((*seconds)[s] <= worst.seconds) continue;
    load.nodes = contacts->node_count, load.sweeps = contacts->sweeps;
    for (int t = 0; t < contacts->tool_count; ++t) {
      load.contacts += palpate_contacts_tool(contacts, t)->contact_count;
      load.slips += palpate_contacts_tool(contacts, t)->slip_count;
    }
    const auto most = std::max_element(times.seconds.begin(), times.seconds.end());
    const auto pass = static_cast<std::int32_t>(most - times.seconds.begin());
    worst.seconds = (*seconds)[s], worst.pass_seconds = *most, worst.step = s, worst.load = load;
    worst.pass = palpate_scene_plan(scene, pass)->name;
  }
  return worst;
}

void report(palpate_bundle* bundle, const char* name, const palpate::SceneDef& def, MakeTools make_tools,
            double disc_radius, long steps) {
  std::vector<double> seconds(static_cast<std::size_t>(steps), HUGE_VAL);
  play(bundle, def, *make_tools(bundle, disc_radius), &seconds);
  const Worst worst = play(bundle, def, *make_tools(bundle, disc_radius), &seconds);
  std::sort(seconds.begin(), seconds.end());
  const auto at = [&](double share) {
    return 1e6 * seconds[static_cast<std::size_t>(share * static_cast<double>(steps - 1))];
  };
  const auto late = std::count_if(seconds.begin(), seconds.end(), [](double s) { return s > kTick; });
  std::printf("%-28s %8.1f %8.1f %8.1f %8.1f %8.2f %% %8lld of %8lld", name, at(0.5), at(0.99), at(0.999), at(1),
              100.0 * static_cast<double>(late) / static_cast<double>(steps), static_cast<long long>(worst.counted),
              static_cast<long long>(worst.bound));
  std::printf("   step %zu: contacts %d, nodes %d, slips %d, sweeps %d, flags %u; %.0f us in %s\n", worst.step,
              worst.load.contacts, worst.load.nodes, worst.load.slips, worst.load.sweeps, worst.load.flags,
              1e6 * worst.pass_seconds, worst.pass.c_str());
}

}  // namespace

void report_worst_steps(palpate_bundle* bundle, long steps) {
  std::printf(
      "%ld touches of each scene; us of processor time, the less of two plays; operations counted at most, and the "
      "bound that the scene states\n",
      steps);
  std::printf("%-28s %8s %8s %8s %8s %10s %20s   the worst step\n", "", "median", "99 %", "99.9 %", "worst",
              "over 1 ms", "operations");
  const std::array<const char*, 4> laws = {"sticking", "sliding", "unilateral", "coulomb"};
  palpate::SceneDef def;
  def.collision = PALPATE_COLLISION_DEFORMED, def.shape = PALPATE_SHAPE_OFF;
  for (const double disc_radius : {0.0, 0.005})
    for (const palpate_contact_law law : {PALPATE_LAW_STICKING, PALPATE_LAW_COULOMB}) {
      def.law = law;
      char name[64];
      std::snprintf(name, sizeof name, "%s, 64 %s", laws[law], disc_radius > 0 ? "discs of 5 mm" : "points");
      report(bundle, name, def, &make<Wanderers>, disc_radius, steps);
    }
  def.law = PALPATE_LAW_STICKING;
  report(bundle, "43 points hover over dents", def, &make<Hoverers>, 0, steps);
  def.collision = PALPATE_COLLISION_OFF, def.contact = PALPATE_CONTACT_POINT;
  def.max_points = GripCrowd::kGrips, def.max_contact_nodes = 3 * GripCrowd::kGrips;
  report(bundle, "350 grips in one triangle", def, &make<GripCrowd>, 0, steps);
}
