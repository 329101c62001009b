#include "studies/large/study.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>

#include "formats/atomic_file.h"
#include "formats/checksum.h"
#include "formats/errors.h"
#include "formats/program.h"
#include "studies/accuracy/command.h"
#include "studies/accuracy/results.h"
#include "studies/large/measure.h"
#include "studies/timing/timing.h"

namespace palpate::large {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kVersion = 1;  // of what a kept point holds
constexpr int kSamples = 1;  // the study compares all nodes of the surface

class Study {
 public:
  explicit Study(const LargeStudyOptions& options)
      : options_(options), organ_(options.organ), finest_(organ_.body(organ_.resolutions().back())) {
    sites_ = accuracy::choose_sites(finest_, 1e-3 * options.organ.radius_mm, options.organ.sites, kSamples);
    moves_ = plan_moves(finest_, sites_);
    pace_.speed = 1e-3 * options.speed_mm_s;
    for (const double depth : options.depths_mm) pace_.depths.push_back(1e-3 * depth);
  }

  void run() {
    const auto begun = studies::Clock::now();
    Progress progress("study", organ_.resolutions().size() * options_.poisson.size());
    for (const auto& resolution : organ_.resolutions())
      for (const double poisson : options_.poisson) {
        points_.push_back(kept_or_measured(resolution, poisson));
        progress.advance();
      }
    write(studies::seconds_since(begun));
    accuracy::run_command(
        {organ_.options().python.string(), (organ_.options().source / "studies/large/report.py").string(),
         (folder() / "large-deformation.json").string(), "-o", (folder() / "report.html").string()},
        folder() / "logs" / "report.txt");
    note(fmt::format("{}: the report", (folder() / "report.html").string()));
  }

 private:
  const std::filesystem::path& folder() const { return organ_.options().output; }

  std::filesystem::path bake(const std::string& resolution, double poisson, const std::filesystem::path& organ) const {
    const auto bundle = folder() / "bundles" / fmt::format("{}-nu-{}.h5", resolution, poisson);
    std::filesystem::create_directories(bundle.parent_path());
    accuracy::run_command(
        {(organ_.options().bin / "palpate-precompute").string(), organ_.make_mesh(resolution).string(), "--organ",
         organ.string(), "--boundary", organ_.boundary_file().string(), "--large-deformation", "--locking-probes", "0",
         "-o", bundle.string()},
        folder() / "logs" / fmt::format("{}-nu-{}.txt", resolution, poisson));
    return bundle;
  }

  Json kept_or_measured(const std::string& resolution, double poisson) const {
    const auto organ_file = organ_.organ_file(organ_.element(), poisson);
    const std::string decides = nlohmann::json{
        {"version", kVersion},
        {"mesh", sha256_of_file(organ_.make_mesh(resolution).string())},
        {"organ", sha256_of_file(organ_file.string())},
        {"boundary", sha256_of_file(organ_.boundary_file().string())},
        {"measured_by", own_hash_},
        {"depths", options_.depths_mm},
        {"speed", options_.speed_mm_s},
        {"sites",
         accuracy::json_of(sites_)}}.dump();
    const auto file = folder() / "points" / fmt::format("{:016x}.json", formats::xxh64(decides.data(), decides.size()));
    if (std::ifstream in(file); in)
      if (Json known = Json::parse(in, nullptr, false); known.is_object()) return known;
    say(fmt::format("measuring {}, nu {:g}", resolution, poisson));
    const OrganConfig organ = read_organ_config(organ_file);
    std::vector<double> stiffening;
    for (const auto& region : organ.regions) stiffening.push_back(region.stiffening ? region.stiffening->value : 0);
    const LargeBody body(
        make_elastic_body(read_mesh(organ_.make_mesh(resolution)), organ, read_boundary_config(organ_.boundary_file()),
                          {organ_.make_mesh(resolution), organ_file, organ_.boundary_file()}),
        organ.element == Element::p1_anp, stiffening);
    const auto bundle = bake(resolution, poisson, organ_file);
    Json point = {{"resolution", resolution},
                  {"poisson", poisson},
                  {"vertices", body.elastic().nodes.size()},
                  {"tetrahedra", body.elastic().tetrahedra.size()},
                  {"bundle_MB", 1e-6 * static_cast<double>(std::filesystem::file_size(bundle))}};
    point.update(measure(bundle, body, moves_, sites_.radius, pace_));
    std::filesystem::create_directories(file.parent_path());
    write_text_atomically(file, point.dump(1) + "\n");
    return point;
  }

  void write(double seconds) const {
    std::vector<Json> rows;
    for (const auto& point : points_)
      for (const auto& move : point.at("moves")) {
        Json row = {{"resolution", point.at("resolution")},
                    {"vertices", point.at("vertices")},
                    {"poisson", point.at("poisson")}};
        for (const char* key : {"place", "move", "depth_mm", "force_N", "linear_field", "linear_force", "large_field",
                                "large_force", "flags", "residual", "least_volume", "unsolved"})
          row[key] = move.contains(key) ? move.at(key) : Json();
        rows.push_back(row);
      }
    Json study = {{"program", "large_study"},
                  {"program_version", PALPATE_VERSION},
                  {"organ", organ_.options().organ},
                  {"boundary", organ_.options().boundary},
                  {"element", organ_.element()},
                  {"radius_mm", organ_.options().radius_mm},
                  {"speed_mm_s", options_.speed_mm_s},
                  {"places", sites_.touch.size()},
                  {"machine", accuracy::machine_json()},
                  {"took_s", seconds}};
    study["meshes"] = Json::array();
    for (Json point : points_) {
      point.erase("moves");
      study["meshes"].push_back(point);
    }
    accuracy::write_results(folder(), "large-deformation", study, rows);
  }

  const LargeStudyOptions options_;
  const accuracy::OrganCase organ_;
  const ElasticBody finest_;
  accuracy::StudySites sites_;
  std::vector<Move> moves_;
  Pace pace_;
  std::vector<Json> points_;
  const std::string own_hash_ = sha256_of_file("/proc/self/exe");  // the runtime that is measured is inside
};

}  // namespace

void run_study(LargeStudyOptions options) {
  if (options.organ.output.empty())
    options.organ.output = options.organ.data / options.organ.organ / "large-deformation" / options.organ.boundary;
  if (!std::is_sorted(options.depths_mm.begin(), options.depths_mm.end()))
    throw InputError("--depths: expected depths that grow, for example 10,20,30");
  Study(options).run();
}

}  // namespace palpate::large
