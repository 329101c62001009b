#include "studies/accuracy/large_strain.h"

#include <fmt/format.h>
#include <fmt/os.h>

#include <cmath>
#include <fstream>
#include <sstream>

#include "formats/atomic_file.h"
#include "formats/checksum.h"
#include "formats/errors.h"
#include "studies/accuracy/calculix.h"
#include "studies/accuracy/held_nodes.h"

namespace palpate::accuracy {
namespace {

constexpr double kDepths[] = {0.05, 0.1, 0.25, 0.5, 0.75, 1, 1.25, 1.5, 2};  // of the radius
constexpr double kShares[] = {0.01, 0.05, 0.10};

struct Push {
  Vec3 inward;
  std::vector<std::int32_t> nodes;
};

// One depth of the push: the surface's displacement and the force on the imposed nodes.
struct State {
  std::vector<Vec3> u;
  Vec3 force;
};

// Nodes under the disc, on the side of the surface that faces the disc; at least the nearest three.
Push push_at(const ElasticBody& body, const TouchSite& site, double radius) {
  std::vector<std::pair<double, std::int32_t>> near;
  for (const auto n : body.touchable) {
    const auto& fixed = body.fixed[static_cast<std::size_t>(n)];
    if (!fixed[0] && !fixed[1] && !fixed[2])
      near.push_back({length(load3(body.nodes[static_cast<std::size_t>(n)].data()) - site.at), n});
  }
  std::sort(near.begin(), near.end());
  Push push = {site.inward, {}};
  for (const auto& [distance, n] : near)
    if (distance <= radius || push.nodes.size() < 3) push.nodes.push_back(n);
  return push;
}

// ---- CalculiX -------------------------------------------------------------------------------------------------------

std::string neo_hookean_words(const Material& material) {
  const double nu = kLargeStrainPoisson;
  const double shear = material.young / (2 * (1 + nu)), bulk = material.young / (3 * (1 - 2 * nu));
  return fmt::format("*HYPERELASTIC, NEO HOOKE\n{:.12e},{:.12e}\n", shear / 2, 2 / bulk);
}

void write_input(const std::filesystem::path& file, const ElasticBody& body, const Push& push, double radius) {
  auto out = fmt::output_file(file.string());
  write_calculix_model(out, body, linear_model(body, neo_hookean_words));
  out.print("*NSET, NSET=SURFACE, GENERATE\n1,{},1\n*NSET, NSET=DISC\n", body.surface_count);
  for (const auto n : push.nodes) out.print("{},\n", n + 1);
  for (const double depth : kDepths) {
    out.print("*STEP, NLGEOM, INC=200\n*STATIC\n0.5,1.,1e-4,1.\n*BOUNDARY\n");
    for (const auto n : push.nodes)
      for (int d = 0; d < 3; ++d) out.print("{},{},{},{:.12e}\n", n + 1, d + 1, d + 1, depth * radius * push.inward[d]);
    out.print(
        "*NODE PRINT, NSET=SURFACE, FREQUENCY=1000\nU\n*NODE PRINT, NSET=DISC, TOTALS=ONLY, FREQUENCY=1000\nRF\n*END "
        "STEP\n");
  }
}

// One state for each step that CalculiX finished; it prints seven digits.
std::vector<State> read_states(const std::filesystem::path& file, const ElasticBody& body) {
  std::ifstream in(file);
  std::vector<State> states;
  bool reads_displacements = false, reads_force = false;
  for (std::string line; std::getline(in, line);) {
    if (line.find("displacements") != std::string::npos) {
      states.push_back({std::vector<Vec3>(static_cast<std::size_t>(body.surface_count)), {}});
      reads_displacements = true;
    } else if (line.find("total force") != std::string::npos) {
      reads_displacements = false, reads_force = true;
    } else if (std::istringstream cells(line); reads_force && !states.empty()) {
      if (Vec3 f; cells >> f.x >> f.y >> f.z) states.back().force = f, reads_force = false;
    } else if (reads_displacements) {
      std::size_t n = 0;
      Vec3 u;
      if (cells >> n >> u.x >> u.y >> u.z && n >= 1 && n <= states.back().u.size()) states.back().u[n - 1] = u;
    }
  }
  return states;
}

// ---- Palpate --------------------------------------------------------------------------------------------------------

// The same nodes moved by one metre: the answer is linear in the depth. The force is that on the organ, as CalculiX's reaction.
State unit_push(const std::filesystem::path& file, const Push& push) {
  HeldAnswer held = hold_nodes(file, push.nodes, std::vector<Vec3>(push.nodes.size(), push.inward));
  return {std::move(held.u), held.force};
}

// ---- comparison -----------------------------------------------------------------------------------------------

nlohmann::json compare(const State& unit, const State& large, double depth) {
  double off = 0, all = 0, most = 0;
  for (std::size_t n = 0; n < large.u.size(); ++n) {
    const Vec3 d = depth * unit.u[n] - large.u[n];
    off += dot(d, d), all += dot(large.u[n], large.u[n]);
    most = std::max(most, length(d));
  }
  const double force_off = length(depth * unit.force - large.force);
  return {{"depth_mm", 1e3 * depth},
          {"force_N", depth * length(unit.force)},
          {"force_large_N", length(large.force)},
          {"force_error", force_off / length(large.force)},
          {"field_error", std::sqrt(off / all)},
          {"field_error_mm", 1e3 * most}};
}

// The depth at which the error first reaches the share, by linear interpolation; null if it does not.
nlohmann::json depth_at(const nlohmann::json& steps, const char* error, double share) {
  double depth = 0, before = 0;
  for (const auto& step : steps) {
    const double here = step.at(error), at = step.at("depth_mm");
    if (here >= share) return depth + (at - depth) * (share - before) / (here - before);
    depth = at, before = here;
  }
  return nullptr;
}

}  // namespace

BundleSetting large_strain_bundle(const OrganCase& organ) {
  BundleSetting setting;
  setting.resolution = organ.base_resolution(), setting.element = "p1";
  setting.poisson = kLargeStrainPoisson, setting.everywhere = false;
  return setting;
}

nlohmann::json push_deep(const OrganCase& organ, const Bakery& bakery, const StudySites& sites, std::size_t site) {
  const BundleSetting setting = large_strain_bundle(organ);
  const Baked baked = bakery.look(setting);
  const std::string decides =
      nlohmann::json{{"bundle", baked.fingerprint}, {"sites", json_of(sites)}, {"site", site}, {"version", 1}}.dump();
  const auto name = fmt::format("large-strain-{:016x}", formats::xxh64(decides.data(), decides.size()));
  const auto file = organ.options().output / "points" / (name + ".json");
  if (std::ifstream in(file); in)
    if (auto known = nlohmann::json::parse(in, nullptr, false); known.is_object()) return known;

  bakery.bake(setting);
  const ElasticBody body = organ.body(setting.resolution);
  const Push push = push_at(body, sites.touch.at(site), sites.radius);
  const auto folder = organ.options().output / "calculix" / name;
  std::filesystem::create_directories(folder);
  write_input(folder / "push.inp", body, push, sites.radius);
  std::string ended;
  try {
    run_calculix(folder, "push");
  } catch (const OperationError& error) {
    ended = error.what();  // the deepest steps may not converge; the steps before them are kept
  }
  const auto states = read_states(folder / "push.dat", body);
  if (states.empty())
    throw OperationError(
        fmt::format("CalculiX solved nothing in {}; is calculix-ccx installed? {}", folder.string(), ended));
  const State unit = unit_push(baked.bundle, push);
  nlohmann::json result = {{"site", site},
                           {"nodes", push.nodes.size()},
                           {"resolution", setting.resolution},
                           {"poisson", kLargeStrainPoisson},
                           {"steps", nlohmann::json::array()}};
  for (std::size_t s = 0; s < states.size() && length(states[s].force) > 0; ++s)
    result["steps"].push_back(compare(unit, states[s], kDepths[s] * sites.radius));
  for (const double share : kShares)
    result["depth_mm_at"][fmt::format("{:g}", 100 * share)] = {
        {"force", depth_at(result["steps"], "force_error", share)},
        {"field", depth_at(result["steps"], "field_error", share)}};
  result["ended"] =
      result["steps"].size() < std::size(kDepths)
          ? fmt::format("at {:.3g} mm CalculiX found no solution", 1e3 * sites.radius * kDepths[result["steps"].size()])
          : "";
  std::filesystem::remove_all(folder);
  write_text_atomically(file, result.dump(1) + "\n");
  return result;
}

}  // namespace palpate::accuracy
