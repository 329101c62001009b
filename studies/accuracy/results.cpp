#include "studies/accuracy/results.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <fstream>

#include "formats/atomic_file.h"

namespace palpate::accuracy {
namespace {

std::string cell(const nlohmann::ordered_json& value) {
  if (!value.is_string()) return value.is_null() ? "" : value.dump();
  const auto text = value.get<std::string>();
  return text.find(',') == std::string::npos ? text : '"' + text + '"';
}

}  // namespace

nlohmann::ordered_json with_nulls(nlohmann::ordered_json object) {
  for (auto& value : object)
    if (value.is_number_float() && !std::isfinite(value.get<double>())) value = nullptr;
  return object;
}

nlohmann::ordered_json record_of(const JudgedPoint& judged, double own_poisson) {
  const MeasuredPoint& p = *judged.point;
  const BundleSetting& b = p.setting.bundle;
  const SceneSetting& s = p.setting.scene;
  const Observation& seen = p.seen;
  nlohmann::ordered_json r;
  r["name"] = name_of(p.setting);
  r["axes"] = fmt::format("{}", fmt::join(judged.axes, " "));
  r["is_reference"] = judged.is_reference;
  r["shares_reference"] = judged.shares_reference;
  r["resolution"] = b.resolution;
  r["vertices"] = p.cost.at("vertices");
  r["element"] = b.element;
  r["poisson"] = b.poisson != 0 ? b.poisson : own_poisson;
  r["own_material"] = b.poisson == 0;
  r["solver"] = b.solver;
  r["tolerance"] = b.tolerance;
  r["storage"] = b.storage;
  r["columns_everywhere"] = b.everywhere;
  r["exercise"] = s.exercise;
  r["law"] = s.law;
  r["contacts"] = s.contacts;
  r["contact"] = s.contact;
  r["collision"] = s.collision;
  r["surface"] = s.surface;
  r["response"] = s.response;
  r["relaxation"] = s.relaxation;
  r["force_N"] = judged.force_newtons;
  r["force_error"] = judged.error.force;
  r["force_error_worst"] = judged.error.force_worst;
  r["force_error_N"] = judged.error.force_newtons;
  r["field_error"] = judged.error.field;
  r["field_error_worst"] = judged.error.field_worst;
  r["field_error_mm"] = judged.error.field_mm;
  r["reference_force_error"] = judged.reference_error.force.error;
  r["reference_field_error"] = judged.reference_error.field.error;
  r["added_force_error"] = judged.added.force;
  r["added_field_error"] = judged.added.field;
  r["reciprocity_error"] = p.cost.at("reciprocity_error");
  r["worst_residual"] = p.cost.at("worst_residual");
  r["most_iterations"] = p.cost.at("most_iterations");
  r["touch_us"] = seen.touch.median_us;
  r["touch_us_99"] = seen.touch.most_us;
  r["shape_us"] = seen.shape.median_us;
  r["shape_us_99"] = seen.shape.most_us;
  r["open_ms"] = seen.open_ms;
  r["precompute_s"] = p.cost.at("seconds");
  r["precompute_GB"] = p.cost.at("peak_bytes").get<double>() / 1e9;
  r["bundle_MB"] = p.cost.at("bundle_bytes").get<double>() / 1e6;
  // Where only columns near the sites were measured: what those of every touchable node would take.
  const auto full = p.cost.value("full", nlohmann::json::object());
  r["full_precompute_s"] = full.value("seconds", NAN);
  r["full_bundle_MB"] = full.value("bundle_bytes", NAN) / 1e6;
  r["columns"] = p.cost.at("columns");
  r["contact_nodes"] = seen.contact_nodes;
  r["flags"] = seen.flags;
  r["farthest_site_mm"] = 1e3 * seen.farthest_site;
  r["bundle"] = "bundles/" + p.cost.at("bundle").get<std::string>();
  r["mesh_sha256"] = p.cost.at("mesh_sha256");
  r["solved_by"] = p.cost.at("solver");
  return with_nulls(std::move(r));
}

nlohmann::ordered_json json_of(const Extrapolated& estimate) {
  return with_nulls({{"error", estimate.error},
                     {"order", estimate.order},
                     {"order_observed", estimate.order_observed},
                     {"scatter", estimate.scatter}});
}

nlohmann::ordered_json json_of(const EstimateCheck& check) {
  return with_nulls({{"vertices", check.vertices},
                     {"estimated_force", check.estimated_force},
                     {"found_force", check.found_force},
                     {"estimated_field", check.estimated_field},
                     {"found_field", check.found_field}});
}

nlohmann::ordered_json json_of(const EstimateRange& range) {
  return with_nulls({{"least_force", range.least_force},
                     {"most_force", range.most_force},
                     {"least_field", range.least_field},
                     {"most_field", range.most_field}});
}

nlohmann::ordered_json json_of(const OtherReference& other) {
  if (!other.point) return nullptr;
  return {{"name", name_of(other.point->setting)},
          {"force", json_of(other.force)},
          {"field", json_of(other.field)},
          {"force_distance", other.distance.force},
          {"field_distance", other.distance.field}};
}

nlohmann::ordered_json machine_json() {
  std::string processor = "unknown processor";
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);)
    if (line.rfind("model name", 0) == 0) {
      processor = line.substr(line.find(':') + 2);
      break;
    }
  double load[3] = {};
  const bool known = ::getloadavg(load, 3) == 3;
  const double pages = static_cast<double>(::sysconf(_SC_PHYS_PAGES));
  return {{"processor", processor},
          {"cores", ::sysconf(_SC_NPROCESSORS_ONLN)},
          {"memory_GB", pages * static_cast<double>(::sysconf(_SC_PAGESIZE)) / 1e9},
          {"load", known ? nlohmann::ordered_json(load[0]) : nlohmann::ordered_json()}};
}

void write_results(const std::filesystem::path& folder, const std::string& name, nlohmann::ordered_json study,
                   const std::vector<nlohmann::ordered_json>& points) {
  study["points"] = points;
  write_text_atomically(folder / (name + ".json"), study.dump(1) + "\n");
  std::string csv;
  for (const auto& point : points) {
    std::vector<std::string> names, cells;
    for (const auto& [key, value] : point.items()) names.push_back(key), cells.push_back(cell(value));
    if (csv.empty()) csv = fmt::format("{}\n", fmt::join(names, ","));
    csv += fmt::format("{}\n", fmt::join(cells, ","));
  }
  write_text_atomically(folder / (name + ".csv"), csv);
}

}  // namespace palpate::accuracy
