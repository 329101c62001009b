// One push of a node, answered by Palpate, by CHOLMOD with a kept factor and by Bullet's deformable body. Prints JSON: the push, for the
// peers that run in Node (peers.mjs), the static answer, and a row for each system. `make -f Makefile.data bench-peers` runs all.
//
//   peers_bench MESH.msh --organ organ.toml --boundary bc.toml --bundle BUNDLE.h5 > push.json
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "formats/command_line.h"
#include "studies/peers/measured.h"
#include "studies/peers/palpate_peer.h"
#include "studies/peers/peers.h"
#ifdef PALPATE_PEERS_BULLET
#include "bench/peers/bullet_peer.h"
#endif

namespace palpate::bench {
namespace {

using namespace studies;
using Json = nlohmann::ordered_json;

constexpr double kDepth = 5e-3;       // m, along the surface's normal
constexpr std::size_t kInward = 250;  // ticks until it is reached; then it is held
constexpr std::size_t kTicks = 500;
// kg/m^3; Bullet and MuJoCo are dynamic.
constexpr double kDensity = 1060;

// The push of the study, on another way: straight in, and held.
Push straight_push(const std::filesystem::path& mesh, const std::filesystem::path& organ,
                   const std::filesystem::path& boundary) {
  const OrganConfig config = read_organ_config(organ);
  Push push =
      make_push(make_elastic_body(read_mesh(mesh), config, read_boundary_config(boundary), {mesh, organ, boundary}),
                config.element);
  push.displacements.clear();
  for (std::size_t tick = 1; tick <= kTicks; ++tick)
    push.displacements.push_back(-kDepth * std::min(1.0, static_cast<double>(tick) / kInward) * push.outward);
  return push;
}

// Plays the push in steps of step_ms. tick returns its seconds. has_force: whether the system tells the force that holds the node.
template <typename Tick>
Json row(const char* name, const Push& push, const Answer& exact, double step_ms, bool has_force, const Tick& tick) {
  std::vector<double> seconds;
  Answer answer;
  answer.surface.resize(3 * push.body.surface_count);
  double peak = 0;
  for (double at = step_ms; at < kTicks + 1e-6; at += step_ms) {
    const Eigen::Vector3d& displacement = push.displacements[static_cast<std::size_t>(at + 1e-6) - 1];
    seconds.push_back(tick(displacement, answer));
    if (has_force) peak = std::max(peak, answer.force.norm());
  }
  return {{"name", name},
          {"step_ms", step_ms},
          {"time_ms", 1e3 * percentile(seconds, .5)},
          {"error", (answer.surface - exact.surface).norm() / exact.surface.norm()},
          {"peak_force_N", has_force ? Json(peak) : Json()},
          {"surface", answer.surface}};
}

// Processor time, s.
template <typename Call>
double timed(const Call& call) {
  const double start = thread_seconds();
  call();
  return thread_seconds() - start;
}

Json measure(const Push& push, const std::filesystem::path& bundle) {
  const Answer exact = Exact(push).at(push.displacements.back());
  const ElasticBody& body = push.body;
  double volume = 0;
  for (const auto& t : body.tetrahedra) {
    const auto at = [&](int corner) { return Eigen::Vector3d(body.nodes[t[corner]].data()); };
    volume += std::abs((at(1) - at(0)).cross(at(2) - at(0)).dot(at(3) - at(0))) / 6;
  }
  std::vector<std::int32_t> held;
  for (std::size_t n = 0; n < body.fixed.size(); ++n)
    if (body.fixed[n][0] || body.fixed[n][1] || body.fixed[n][2]) held.push_back(static_cast<std::int32_t>(n));
  const Material& material = body.materials[0];
  Json result = {{"node", push.node},
                 {"outward", push.outward},
                 {"displacements", push.displacements},
                 {"surface_count", body.surface_count},
                 {"young", material.young},
                 {"poisson", material.poisson},
                 {"mass", kDensity * volume},
                 {"nodes", body.nodes},
                 {"tetrahedra", body.tetrahedra},
                 {"triangles", body.triangles},
                 {"held", held},
                 {"exact", exact.surface},
                 {"exact_force_N", exact.force.norm()},
                 {"rows", Json::array()}};
  Json& rows = result["rows"];
  PalpatePeer palpate(bundle, push, node_contact_scene());
  rows.push_back(row("Palpate", push, exact, 1, true,
                     [&](const Eigen::Vector3d& d, Answer& answer) { return palpate.grip(push.node, d, answer); }));
  const FreeSystem system(push);
  KeptFactor kept(push, system);
  kept.hold(push.node);
  rows.push_back(row("CHOLMOD, kept factor", push, exact, 1, true,
                     [&](const Eigen::Vector3d& d, Answer& answer) { return timed([&] { kept.tick(d, answer); }); }));
#ifdef PALPATE_PEERS_BULLET
  constexpr double kFrame = 1e3 / 60;  // ms
  BulletBody bullet(push, kFrame / 1e3);
  rows.push_back(row("Bullet 3.24, deformable body", push, exact, kFrame, false,
                     [&](const Eigen::Vector3d& d, Answer& answer) { return timed([&] { bullet.tick(d, answer); }); }));
#endif
  return result;
}

}  // namespace
}  // namespace palpate::bench

int main(int argc, char** argv) {
  std::filesystem::path mesh, organ, boundary, bundle;
  return palpate::run_program(
      argc, argv, "peers_bench", "One push with Palpate and with what a user would take instead.",
      [&](CLI::App& app) {
        app.add_option("MESH.msh", mesh, "the mesh that the bundle was computed from")->required();
        app.add_option("--organ", organ, "its organ.toml")->required();
        app.add_option("--boundary", boundary, "its boundary set, of fixed nodes alone")->required();
        app.add_option("--bundle", bundle, "the bundle")->required();
      },
      [&] {
        const palpate::studies::Push push = palpate::bench::straight_push(mesh, organ, boundary);
        fmt::print("{}\n", palpate::bench::measure(push, bundle).dump());
      });
}
