#include "studies/accuracy/large_strain.h"

#include <fmt/format.h>

#include <cmath>
#include <fstream>

#include "formats/atomic_file.h"
#include "formats/checksum.h"
#include "formats/errors.h"
#include "formats/program.h"
#include "studies/accuracy/calculix_push.h"
#include "studies/accuracy/held_nodes.h"

namespace palpate::accuracy {
namespace {

constexpr double kDepths[] = {0.05, 0.1, 0.25, 0.5, 0.75, 1, 1.25, 1.5, 2};  // of the radius
constexpr double kShares[] = {0.01, 0.05, 0.10};
constexpr std::pair<HeldModel, const char*> kModels[] = {
    {HeldModel::linear, "linear"}, {HeldModel::response, "response"}, {HeldModel::large, "large"}};

struct PushError {
  double force, field, field_most;  // relative; relative; m
};
PushError error_of(const HeldAnswer& found, const PushedState& exact) {
  double off = 0, all = 0, most = 0;
  for (std::size_t n = 0; n < exact.u.size(); ++n) {
    const Vec3 d = found.u[n] - exact.u[n];
    off += dot(d, d), all += dot(exact.u[n], exact.u[n]);
    most = std::max(most, length(d));
  }
  return {length(found.force - exact.force) / length(exact.force), std::sqrt(off / all), most};
}

nlohmann::json compare(const HeldAnswer& linear, const PushedState& exact, double depth) {
  const PushError error = error_of(linear, exact);
  return {{"depth_mm", 1e3 * depth},    {"force_N", length(linear.force)}, {"force_large_N", length(exact.force)},
          {"force_error", error.force}, {"field_error", error.field},      {"field_error_mm", 1e3 * error.field_most}};
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
  const BundleSetting plain = large_strain_bundle(organ);
  BundleSetting large = plain;
  large.large = true;
  const std::string decides = nlohmann::json{
      {"bundle", bakery.look(plain).fingerprint},
      {"large", bakery.look(large).fingerprint},
      {"measured_by", sha256_of_file("/proc/self/exe")},
      {"sites", json_of(sites)},
      {"site", site},
      {"version", 2}}.dump();
  const auto name = fmt::format("large-strain-{:016x}", formats::xxh64(decides.data(), decides.size()));
  const auto file = organ.options().output / "points" / (name + ".json");
  if (std::ifstream in(file); in)
    if (auto known = nlohmann::json::parse(in, nullptr, false); known.is_object()) return known;

  bakery.bake(plain), bakery.bake(large);
  const ElasticBody body = organ.body(plain.resolution);
  const DeepPush push = push_at(body, sites.touch.at(site), sites.radius);
  const auto folder = organ.options().output / "calculix" / name;
  std::vector<double> depths;
  for (const double depth : kDepths) depths.push_back(depth * sites.radius);
  const auto [states, ended] = push_by_calculix(folder, body, push, depths, neo_hookean_words(kLargeStrainPoisson));
  if (states.empty())
    throw OperationError(
        fmt::format("CalculiX solved nothing in {}; is calculix-ccx installed? {}", folder.string(), ended));
  depths.resize(states.size());
  nlohmann::json result = {{"site", site},
                           {"nodes", push.nodes.size()},
                           {"resolution", plain.resolution},
                           {"poisson", kLargeStrainPoisson},
                           {"steps", nlohmann::json::array()},
                           {"models", nlohmann::json::object()}};
  for (const auto& [model, key] : kModels) {
    if (model == HeldModel::response && !organ.has_response()) continue;
    const auto bundle = bakery.look(model == HeldModel::large ? large : plain).bundle;
    const HeldPath path = move_nodes(bundle, push.nodes, push.inward, depths, model);
    nlohmann::json steps = nlohmann::json::array();
    for (std::size_t s = 0; s < states.size(); ++s) {
      const PushError error = error_of(path.at[s], states[s]);
      steps.push_back({{"depth_mm", 1e3 * depths[s]}, {"force_error", error.force}, {"field_error", error.field}});
      if (model == HeldModel::linear) result["steps"].push_back(compare(path.at[s], states[s], depths[s]));
    }
    result["models"][key] = {{"steps", steps},
                             {"touch_us", path.touch_us},
                             {"touch_us_99", path.touch_us_most},
                             {"shape_us", path.shape_us},
                             {"scene_MB", 1e-6 * path.scene_bytes},
                             {"bundle_MB", 1e-6 * static_cast<double>(std::filesystem::file_size(bundle))}};
  }
  for (const double share : kShares)
    result["depth_mm_at"][fmt::format("{:g}", 100 * share)] = {
        {"force", depth_at(result["steps"], "force_error", share)},
        {"field", depth_at(result["steps"], "field_error", share)}};
  result["ended"] = states.size() < std::size(kDepths) ? fmt::format("at {:.3g} mm CalculiX found no solution",
                                                                     1e3 * sites.radius * kDepths[states.size()])
                                                       : "";
  write_text_atomically(file, result.dump(1) + "\n");
  return result;
}

}  // namespace palpate::accuracy
