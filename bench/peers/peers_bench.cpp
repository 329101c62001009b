// Compares Palpate with what a user would write without it: CHOLMOD with a kept factor, Eigen's conjugate gradients and Bullet's
// deformable body. All answer the same push in the same run; prints times and errors.
//
//   peers_bench MESH.msh --organ organ.toml --boundary bc.toml --bundle BUNDLE.h5
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <numeric>

#ifdef PALPATE_PEERS_BULLET
#include "bench/peers/bullet_peer.h"
#endif
#include "formats/command_line.h"
#include "studies/peers/measured.h"
#include "studies/peers/palpate_peer.h"
#include "studies/peers/peers.h"

namespace palpate::bench {
namespace {

using namespace studies;

struct Options {
  std::filesystem::path mesh, organ, boundary, bundle;
  double seconds = 20;
};

// ---- the table -----------------------------------------------------------------------------------------------------

constexpr std::size_t kOthersBytes =
    64 << 20;  // more than the caches hold: stands for the program's other work between two ticks

class Table {
 public:
  Table(PalpatePeer& palpate, const Exact& exact) : palpate_(palpate), exact_(exact) {
    fmt::print("{:<48} {:>11} {:>9} {:>9} {:>9} {:>10} {:>10} {:>6}\n", "", "ms", "error", "worst", "force", "per tick",
               "per frame", "ticks");
  }

  // Measures Palpate again before each other system; the ratios of the next rows refer to this.
  void palpate() {
    Measured touch, frame;
    palpate_.play(touch, frame, exact_, [] {});
    touch_ = touch.median(), frame_ = frame.median();
    if (shown_) return;
    shown_ = true;
    row("palpate_scene_touch, collision included", touch);
    row("palpate_scene_touch + palpate_scene_shape", frame);
    const std::vector<std::uint64_t> others(kOthersBytes / 8, 1);
    std::uint64_t sum = 0;
    Measured cold_touch, cold_frame;
    palpate_.play(cold_touch, cold_frame, exact_, [&] { sum += std::accumulate(others.begin(), others.end(), sum); });
    row("  touch, 64 MB of other reads before each tick", cold_touch);
    row("  touch + shape, the same", cold_frame);
    if (sum == 0) fmt::print("\n");  // uses the sum, so that the compiler keeps the reads
  }
  void changing(double touch, double frame) { touch_ = touch, frame_ = frame; }

  void row(const std::string& name, const Measured& m) {
    const double median = m.median();
    fmt::print("{:<48} {:>11.5f} {:>9.1e} {:>9.1e} {:>9.1e} {:>9.1f}x {:>9.1f}x {:>6}\n", name, median * 1e3,
               percentile(m.error, .5), percentile(m.error, 1), percentile(m.force_error, .5), median / touch_,
               median / frame_, m.seconds.size());
    std::fflush(stdout);
  }

 private:
  PalpatePeer& palpate_;
  const Exact& exact_;
  double touch_ = 1, frame_ = 1;
  bool shown_ = false;
};

// Another node in every tick. The error is Palpate's answer relative to the kept factor's.
void measure_changing_contact(const Push& push, KeptFactor& kept, PalpatePeer& palpate, Table& table, double budget) {
  Measured factor, touch, frame;
  Answer peer, ours;
  peer.surface.resize(3 * push.body.surface_count);
  const auto start = Clock::now();
  for (int turn = 0; turn < 50 && seconds_since(start) < budget; ++turn) {
    const auto& touchable = push.body.touchable;
    const std::int32_t node = touchable[(static_cast<std::size_t>(turn) * 7919) % touchable.size()];
    const auto& fixed = push.body.fixed[node];
    if (fixed[0] || fixed[1] || fixed[2]) continue;
    const Eigen::Vector3d displacement = push.displacements[static_cast<std::size_t>(turn)];
    const auto begin = Clock::now();
    kept.tick_at_new_node(node, displacement, peer);
    const double spent = seconds_since(begin);
    const auto [touched, shaped] = palpate.grip(node, displacement, ours);
    factor.add(spent, peer, peer);
    touch.add(touched, ours, peer);
    frame.add(shaped, ours, peer);
  }
  table.changing(touch.median(), frame.median());
  fmt::print("another node in every tick (error: palpate against the kept factor)\n");
  table.row("  palpate_scene_touch", touch);
  table.row("  palpate_scene_touch + palpate_scene_shape", frame);
  table.row("  CHOLMOD, factor kept, 3 right-hand sides", factor);
}

#ifdef PALPATE_PEERS_BULLET
// Frames of 1/60 s along the push, 50/3 ticks each. Then holds the end for the rest of the budget, at most 10 s of simulated time;
// the error of that row is the one of the last frame.
void measure_bullet(const Push& push, const Exact& exact, Table& table, double budget) {
  BulletBody bullet(push, 1.0 / 60);
  table.palpate();
  Measured moving, held;
  Answer answer;
  answer.surface.resize(3 * push.body.surface_count);
  const std::size_t last = push.displacements.size() - 1;
  const auto start = Clock::now();
  for (std::size_t frame = 0; seconds_since(start) < budget && held.seconds.size() < 600; ++frame) {
    const std::size_t tick = std::min(frame * 50 / 3, last);
    const auto begin = Clock::now();
    bullet.tick(push.displacements[tick], answer);
    (tick < last ? moving : held).add(seconds_since(begin), answer, exact.at(push.displacements[tick]));
  }
  table.row("Bullet deformable, implicit, 1/60 s, moving", moving);
  if (held.seconds.empty()) return;
  held.error = {held.error.back()};
  table.row(fmt::format("Bullet deformable, after {:.1f} s held", static_cast<double>(held.seconds.size()) / 60), held);
}
#endif

void measure(const Options& options) {
  const TetrahedralMesh mesh = read_mesh(options.mesh);
  const OrganConfig organ = read_organ_config(options.organ);
  const BoundaryConfig boundary = read_boundary_config(options.boundary);
  const Push push = make_push(make_elastic_body(mesh, organ, boundary, {options.mesh, options.organ, options.boundary}),
                              organ.element);
  PalpatePeer palpate(options.bundle, push, node_contact_scene());
  const Exact exact(push);
  fmt::print("{}; node {} pushed 2.5 to 5 mm at 10 mm/s\n", palpate.description(), push.node);
  fmt::print(
      "ms: median of a tick; error: relative L2 of the surface against a direct solve, median and worst tick;\n");
  fmt::print(
      "force: the same of the contact's force; per tick, per frame: time over palpate_scene_touch, over touch + "
      "shape\n");
  Table table(palpate, exact);
  table.palpate();
  {
    const FreeSystem system(push);
    const auto start = Clock::now();
    KeptFactor kept(push, system);
    kept.hold(push.node);
    const double factored = seconds_since(start);
    table.palpate();
    table.row("CHOLMOD, factor kept, 1 back-substitution",
              follow(push, exact, options.seconds, [&](const auto& d, Answer& a) { kept.tick(d, a); }));
    fmt::print("  (factor: {:.2f} s, once)\n", factored);
    for (const double tolerance : {1e-3, 1e-6}) {
      ConjugateGradients gradients(push, tolerance);
      table.palpate();
      table.row(fmt::format("Eigen CG, Jacobi, warm, {:.0e}", tolerance),
                follow(push, exact, options.seconds, [&](const auto& d, Answer& a) { gradients.tick(d, a); }));
    }
    measure_changing_contact(push, kept, palpate, table, options.seconds);
  }
#ifdef PALPATE_PEERS_BULLET
  measure_bullet(push, exact, table, 2 * options.seconds);
#else
  fmt::print("Bullet was not found when this was built: no row of it\n");
#endif
}

}  // namespace
}  // namespace palpate::bench

int main(int argc, char** argv) {
  palpate::bench::Options options;
  return palpate::run_program(
      argc, argv, "peers_bench", "The same push with Palpate and with what a user would write without it.",
      [&](CLI::App& app) {
        app.add_option("MESH.msh", options.mesh, "the mesh the bundle was computed from")->required();
        app.add_option("--organ", options.organ, "its organ.toml")->required();
        app.add_option("--boundary", options.boundary, "its boundary set")->required();
        app.add_option("--bundle", options.bundle, "the bundle")->required();
        app.add_option("--seconds", options.seconds, "most time per system, s")->check(CLI::Range(0.1, 3600.0));
      },
      [&] { palpate::bench::measure(options); });
}
