#include "studies/accuracy/bake.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <map>

#include "formats/atomic_file.h"
#include "formats/checksum.h"
#include "formats/errors.h"
#include "formats/organ_config.h"
#include "formats/program.h"
#include "studies/accuracy/command.h"
#include "studies/timing/timing.h"

namespace palpate::accuracy {
namespace {

constexpr double kShortRun = 3;  // s; a shorter run is repeated, and its median counts

// With a stiffening near zero the law of an element p1 is the split one of CalculiX's NEO HOOKE, to one part in a million; without,
// it would be the compressible one.
constexpr double kLeastStiffening = 1e-6;

bool is_rows(const std::string& storage) {
  return storage == "f32" || storage == "f64";
}

// Each file is hashed once, because programs and meshes do not change during a study.
const std::string& hash_of(const std::filesystem::path& file) {
  static std::map<std::filesystem::path, std::string> known;
  auto& hash = known[file];
  if (hash.empty()) hash = sha256_of_file(file.string());
  return hash;
}

nlohmann::json read_json(const std::filesystem::path& file) {
  std::ifstream in(file);
  return nlohmann::json::parse(in);
}

}  // namespace

Bakery::Inputs Bakery::inputs(const BundleSetting& setting) const {
  return {organ_.make_mesh(setting.resolution),
          organ_.organ_file(setting.element, setting.poisson, setting.large ? kLeastStiffening : 0),
          setting.everywhere ? organ_.boundary_file() : organ_.boundary_file(sites_, setting.resolution)};
}

Baked Bakery::look(const BundleSetting& setting) const {
  const Inputs from = inputs(setting);
  nlohmann::json decides = {{"setting", setting},
                            {"mesh", hash_of(from.mesh)},
                            {"organ", sha256_of_file(from.organ.string())},
                            {"boundary", sha256_of_file(from.boundary.string())},
                            {"palpate-precompute", hash_of(organ_.options().bin / "palpate-precompute")}};
  for (const auto& [key, file] : files_of(read_organ_config(from.organ), read_boundary_config(from.boundary)))
    decides[key] = sha256_of_file(file.string());
  if (!is_rows(setting.storage)) decides["palpate-bundle"] = hash_of(organ_.options().bin / "palpate-bundle");
  const std::string text = decides.dump();
  Baked baked;
  baked.fingerprint = fmt::format("{:016x}", formats::xxh64(text.data(), text.size()));
  baked.bundle = organ_.options().output / "bundles" / (baked.fingerprint + ".h5");
  return baked;
}

std::vector<std::string> Bakery::precompute(const BundleSetting& setting, const Inputs& from) const {
  auto command = precompute_command(
      organ_.options().bin, from.mesh, from.organ, from.boundary,
      {"--tolerance", fmt::format("{}", setting.tolerance), "--store", setting.storage == "f64" ? "f64" : "f32"});
  if (organ_.options().memory_gigabytes > 0) {
    command.push_back("--memory");
    command.push_back(fmt::format("{}", organ_.options().memory_gigabytes));
  }
  if (setting.large) command.push_back("--large-deformation");
  return command;
}

// Of the rows that are packed, if the setting is packed. Neither Poisson's ratio nor the tolerance changes a plan.
const nlohmann::json& Bakery::plan(const BundleSetting& setting, bool everywhere) const {
  BundleSetting planned;
  planned.resolution = setting.resolution, planned.element = setting.element, planned.everywhere = everywhere;
  if (is_rows(setting.storage)) planned.storage = setting.storage;
  auto& plan = plans_[text_of(planned)];
  if (!plan.is_null()) return plan;
  auto command = precompute(planned, inputs(planned));
  const auto report = organ_.options().output / "plan.json";
  command.insert(command.end(), {"--plan", "--json", report.string()});
  run_command(command, organ_.options().output / "logs" / "plan.txt");
  plan = read_json(report);
  std::filesystem::remove(report);
  return plan;
}

nlohmann::json Bakery::predict_full(const BundleSetting& setting) const {
  if (setting.storage.starts_with("low-rank")) return nullptr;
  const auto& full = plan(setting, true);
  const double of_the_rows = setting.storage == "f16" ? 0.5 : 1;
  return {{"seconds", full.at("seconds")}, {"bundle_bytes", of_the_rows * full.at("bundle_bytes").get<double>()}};
}

std::optional<std::string> Bakery::too_large(const BundleSetting& setting) const {
  if (is_baked(look(setting))) return {};
  // The factor is the same for few columns. On the largest meshes planning it takes minutes, so it is planned once.
  if (setting.element == "p2-p0")
    if (const auto& full = plan(setting, true); full.at("solver") == "multigrid")
      return fmt::format("its factor would take {:.1f} GB of {:.1f}",
                         full.at("supernodal_single").at("bytes").get<double>() / 1e9,
                         full.at("available_bytes").get<double>() / 1e9);
  const double seconds = plan(setting, setting.everywhere).at("seconds");
  // The reference of the organ's own material may take twice the time, because every scene is compared with it.
  const double most = (setting.poisson == 0 && !setting.everywhere ? 2 : 1) * organ_.options().most_seconds;
  if (seconds > most)
    return fmt::format("it would take {:.0f} s of at most {:.0f} (--most-seconds{})", seconds, most,
                       most > organ_.options().most_seconds ? ", twice for the organ's own reference" : "");
  return {};
}

BakeCost Bakery::bake_rows(const BundleSetting& setting, const Baked& to) const {
  auto command = precompute(setting, inputs(setting));
  const auto report = organ_.options().output / "bundles" / (to.fingerprint + ".run.json");
  command.insert(command.end(), {"-o", to.bundle.string(), "--json", report.string()});
  if (setting.solver == "multigrid") command.insert(command.end(), {"--", "-column_pc_type", "multigrid"});
  std::vector<double> seconds;
  nlohmann::json run;
  do {
    run_command(command, organ_.options().output / "logs" / (to.fingerprint + ".txt"));
    run = read_json(report);
    seconds.push_back(run.at("seconds"));
  } while (static_cast<int>(seconds.size()) < organ_.options().repeats && seconds[0] < kShortRun);
  std::filesystem::remove(report);
  std::sort(seconds.begin(), seconds.end());
  const auto& certificate = run.at("certificate");
  return {{"mesh_sha256", hash_of(inputs(setting).mesh)},
          {"vertices", run.at("nodes")},
          {"columns", run.at("columns")},
          {"seconds", seconds[seconds.size() / 2]},
          {"peak_bytes", run.at("peak_bytes")},
          {"bundle_bytes", run.at("bundle_bytes")},
          {"reciprocity_error", certificate.at("reciprocity_error")},
          {"worst_residual", certificate.at("worst_residual")},
          {"most_iterations", certificate.at("most_iterations")},
          {"solver", run.at("solver")}};
}

BakeCost Bakery::pack(const BundleSetting& setting, const Baked& to) const {
  BundleSetting rows = setting;
  rows.storage = "f32";
  BakeCost cost = bake(rows);
  std::vector<std::string> command = {(organ_.options().bin / "palpate-bundle").string(), "pack",
                                      look(rows).bundle.string(), "-o", to.bundle.string()};
  if (setting.storage == "f16")
    command.insert(command.end(), {"--precision", "f16"});
  else  // "low-rank 1e-3"
    command.insert(command.end(), {"--low-rank", setting.storage.substr(setting.storage.find(' ') + 1)});
  const auto start = studies::Clock::now();
  run_command(command, organ_.options().output / "logs" / (to.fingerprint + ".txt"));
  cost["pack_seconds"] = studies::seconds_since(start);
  cost["seconds"] = cost.at("seconds").get<double>() + cost.at("pack_seconds").get<double>();
  cost["bundle_bytes"] = std::filesystem::file_size(to.bundle);
  return cost;
}

std::filesystem::path Bakery::record_of(const Baked& baked) const {
  return organ_.options().output / "bundles" / (baked.fingerprint + ".json");
}

bool Bakery::is_baked(const Baked& baked) const {
  return std::filesystem::exists(baked.bundle) && std::filesystem::exists(record_of(baked));
}

BakeCost Bakery::bake(const BundleSetting& setting) const {
  const Baked to = look(setting);
  if (is_baked(to)) return read_json(record_of(to));
  std::filesystem::create_directories(to.bundle.parent_path());
  BakeCost cost = is_rows(setting.storage) ? bake_rows(setting, to) : pack(setting, to);
  cost["bundle"] = to.bundle.filename();
  write_text_atomically(record_of(to), cost.dump(2) + "\n");
  return cost;
}

}  // namespace palpate::accuracy
