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

namespace {

using Point = std::array<double, 3>;
constexpr int kTools = 4, kPointsOfATool = 16;
constexpr double kTick = 1e-3;

// Reproducible: both plays get the same tools.
class Random {
 public:
  double operator()(double from, double to) {
    state_ = state_ * 6364136223846793005u + 1442695040888963407u;
    return from + (to - from) * static_cast<double>(state_ >> 11) * 0x1p-53;
  }
  int below(int count) { return std::min(count - 1, static_cast<int>((*this)(0, count))); }

 private:
  std::uint64_t state_ = 1;
};

// The surface's vertices with their outward normals and neighbours, of which those that can be touched are visited.
struct Surface {
  explicit Surface(const palpate_bundle* bundle) {
    const palpate_bundle_info info = palpate_bundle_describe(bundle);
    const double* nodes = palpate_bundle_nodes(bundle);
    place.resize(info.surface_node_count), normal.resize(place.size()), near.resize(place.size());
    touchable.assign(palpate_bundle_touchable(bundle), palpate_bundle_touchable(bundle) + info.touchable_count);
    for (std::size_t n = 0; n < place.size(); ++n) std::copy_n(nodes + 3 * n, 3, place[n].begin());
    for (int t = 0; t < info.triangle_count; ++t) {
      const std::int32_t* v = palpate_bundle_triangles(bundle) + 3 * t;
      const Point &a = place[v[0]], &b = place[v[1]], &c = place[v[2]];
      for (int d = 0; d < 3; ++d) {
        const int e = (d + 1) % 3, f = (d + 2) % 3;
        const double area = (b[e] - a[e]) * (c[f] - a[f]) - (b[f] - a[f]) * (c[e] - a[e]);
        for (int i = 0; i < 3; ++i) normal[v[i]][d] += area;
      }
      for (int i = 0; i < 3; ++i) near[v[i]].push_back(v[(i + 1) % 3]);
    }
    for (Point& n : normal) {
      const double l = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
      for (double& x : n) x /= l > 0 ? l : 1;
    }
  }
  std::vector<Point> place, normal;
  std::vector<std::vector<std::int32_t>> near;
  std::vector<std::int32_t> touchable;
};

// A tool point that hovers, presses, slides at its depth over the surface, and jumps to another place, in any order.
class Wanderer {
 public:
  Wanderer(const Surface& surface, Random& random) : surface_(surface), random_(random) { jump(); }
  Point step() {
    if (left_-- == 0) choose();
    height_ += std::clamp(wanted_ - height_, -5e-5, 5e-5);  // 50 mm/s
    if (slides_ && (along_ += 0.02) > 1) from_ = to_, to_ = neighbour(from_), along_ = 0;
    Point p;
    for (int d = 0; d < 3; ++d)
      p[d] = (1 - along_) * (surface_.place[from_][d] + height_ * surface_.normal[from_][d]) +
             along_ * (surface_.place[to_][d] + height_ * surface_.normal[to_][d]);
    return p;
  }

 private:
  std::int32_t neighbour(std::int32_t of) {
    const auto& near = surface_.near[of];
    return near.empty() ? of : near[random_.below(static_cast<int>(near.size()))];
  }
  void jump() {
    from_ = surface_.touchable[random_.below(static_cast<int>(surface_.touchable.size()))];
    to_ = neighbour(from_);
    along_ = 0, height_ = wanted_ = 1e-3;
  }
  void choose() {
    left_ = 20 + random_.below(300);
    const double what = random_(0, 1);
    if (what < 0.1) jump();
    slides_ = what > 0.5;
    wanted_ = what < 0.25 ? 1e-3 : random_(-5e-3, 0);  // a quarter hovers 1 mm above
  }
  const Surface& surface_;
  Random& random_;
  std::int32_t from_ = 0, to_ = 0;
  double along_ = 0, height_ = 0, wanted_ = 0;
  bool slides_ = false;
  int left_ = 0;
};

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
  const Surface surface(bundle);
  Random random;
  std::vector<Wanderer> wanderers(kTools * kPointsOfATool, Wanderer(surface, random));
  std::vector<Point> points(wanderers.size());
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
