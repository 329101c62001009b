#include "studies/accuracy/calculix_push.h"

#include <fmt/format.h>
#include <fmt/os.h>

#include <algorithm>
#include <fstream>
#include <sstream>

#include "formats/errors.h"
#include "studies/accuracy/calculix.h"

namespace palpate::accuracy {
namespace {

void write_input(const std::filesystem::path& file, const ElasticBody& body, const DeepPush& push,
                 std::span<const double> depths, const std::function<std::string(const Material&)>& words, bool exact) {
  auto out = fmt::output_file(file.string());
  write_calculix_model(out, body, linear_model(body, words));
  out.print("*NSET, NSET=SURFACE, GENERATE\n1,{},1\n*NSET, NSET=DISC\n", body.surface_count);
  for (const auto n : push.nodes) out.print("{},\n", n + 1);
  for (const double depth : depths) {
    out.print("*STEP, NLGEOM, INC=200\n*STATIC\n0.5,1.,1e-4,1.\n");
    if (exact) out.print("*CONTROLS, PARAMETERS=FIELD\n1e-10,1e-10\n");
    out.print("*BOUNDARY\n");
    for (const auto n : push.nodes)
      for (int d = 0; d < 3; ++d) out.print("{},{},{},{:.12e}\n", n + 1, d + 1, d + 1, depth * push.inward[d]);
    out.print(
        "*NODE PRINT, NSET=SURFACE, FREQUENCY=1000\nU\n*NODE PRINT, NSET=DISC, TOTALS=ONLY, FREQUENCY=1000\nRF\n*END "
        "STEP\n");
  }
}

// One state for each step that CalculiX finished.
std::vector<PushedState> read_states(const std::filesystem::path& file, const ElasticBody& body) {
  std::ifstream in(file);
  std::vector<PushedState> states;
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
  while (!states.empty() && !(length(states.back().force) > 0)) states.pop_back();  // a step that was not finished
  return states;
}

}  // namespace

DeepPush push_at(const ElasticBody& body, const TouchSite& site, double radius) {
  std::vector<std::pair<double, std::int32_t>> near;
  for (const auto n : body.touchable) {
    const auto& fixed = body.fixed[static_cast<std::size_t>(n)];
    if (!fixed[0] && !fixed[1] && !fixed[2])
      near.push_back({length(load3(body.nodes[static_cast<std::size_t>(n)].data()) - site.at), n});
  }
  std::sort(near.begin(), near.end());
  DeepPush push = {site.inward, {}};
  for (const auto& [distance, n] : near)
    if (distance <= radius || push.nodes.size() < 3) push.nodes.push_back(n);
  return push;
}

std::function<std::string(const Material&)> neo_hookean_words(double poisson) {
  return [poisson](const Material& material) {
    const double shear = material.young / (2 * (1 + poisson)), bulk = material.young / (3 * (1 - 2 * poisson));
    return fmt::format("*HYPERELASTIC, NEO HOOKE\n{:.12e},{:.12e}\n", shear / 2, 2 / bulk);
  };
}

PushedByCalculix push_by_calculix(const std::filesystem::path& folder, const ElasticBody& body, const DeepPush& push,
                                  std::span<const double> depths,
                                  const std::function<std::string(const Material&)>& words, bool exact) {
  std::filesystem::create_directories(folder);
  write_input(folder / "push.inp", body, push, depths, words, exact);
  PushedByCalculix result;
  try {
    run_calculix(folder, "push");
  } catch (const OperationError& error) {
    result.ended = error.what();  // the deepest steps may not converge; the steps before them are kept
  }
  result.states = read_states(folder / "push.dat", body);
  if (!result.states.empty()) std::filesystem::remove_all(folder);
  return result;
}

}  // namespace palpate::accuracy
