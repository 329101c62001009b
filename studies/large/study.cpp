#include "studies/large/study.h"

#include <fmt/format.h>

#include <algorithm>

#include "formats/errors.h"
#include "formats/program.h"
#include "studies/large/composed.h"
#include "studies/large/measure.h"
#include "studies/large/study_folder.h"
#include "studies/timing/timing.h"

namespace palpate::large {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kVersion = 2;  // of what a kept point holds
constexpr int kSamples = 1;  // the study compares all nodes of the surface

class Study {
 public:
  explicit Study(const LargeStudyOptions& options)
      : options_(options), organ_(options.organ), folder_(organ_), finest_(organ_.body(organ_.resolutions().back())) {
    sites_ = accuracy::choose_sites(finest_, 1e-3 * options.organ.radius_mm, options.organ.sites, kSamples);
    moves_ = plan_moves(finest_, sites_);
    pace_.speed = 1e-3 * options.speed_mm_s;
    for (const double depth : options.depths_mm) pace_.depths.push_back(1e-3 * depth);
  }

  void run() {
    const auto begun = studies::Clock::now();
    for (const auto& resolution : organ_.resolutions())
      for (const double poisson : options_.poisson) points_.push_back(point(resolution, poisson));
    write(studies::seconds_since(begun));
  }

 private:
  Json point(const std::string& resolution, double poisson) const {
    const auto mesh = organ_.make_mesh(resolution), organ_file = organ_.organ_file(organ_.element(), poisson);
    const Json settings = {{"version", kVersion},
                           {"depths", options_.depths_mm},
                           {"speed", options_.speed_mm_s},
                           {"composed", options_.composed},
                           {"sites", accuracy::json_of(sites_)}};
    return folder_.kept_or_measured({mesh, organ_file}, settings, [&](const std::filesystem::path& parts) {
      say(fmt::format("measuring {}, nu {:g}", resolution, poisson));
      const LargeBody body = folder_.body(mesh, organ_file);
      const auto bundle = folder_.bake(mesh, organ_file, fmt::format("{}-nu-{}", resolution, poisson));
      Json measured = {{"resolution", resolution},
                       {"poisson", poisson},
                       {"vertices", body.elastic().nodes.size()},
                       {"tetrahedra", body.elastic().tetrahedra.size()},
                       {"bundle_MB", 1e-6 * static_cast<double>(std::filesystem::file_size(bundle))}};
      measured.update(measure(bundle, body, moves_, {sites_.radius, pace_, options_.threads, parts}));
      if (options_.composed > 0)
        measured["composed"] =
            measure_composed(bundle, body, sites_, static_cast<std::size_t>(options_.composed), pace_);
      measured["threads"] = options_.threads;
      return measured;
    });
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
    Json study = {{"element", organ_.element()},
                  {"speed_mm_s", options_.speed_mm_s},
                  {"places", sites_.touch.size()},
                  {"took_s", seconds}};
    study["meshes"] = Json::array();
    for (Json point : points_) {
      point.erase("moves");
      study["meshes"].push_back(point);
    }
    folder_.write("large-deformation", study, rows);
  }

  const LargeStudyOptions options_;
  const accuracy::OrganCase organ_;
  const StudyFolder folder_;
  const ElasticBody finest_;
  accuracy::StudySites sites_;
  std::vector<Move> moves_;
  Pace pace_;
  std::vector<Json> points_;
};

LargeStudyOptions with_defaults(LargeStudyOptions options) {
  if (options.organ.output.empty())
    options.organ.output = options.organ.data / options.organ.organ / "large-deformation" / options.organ.boundary;
  if (!std::is_sorted(options.depths_mm.begin(), options.depths_mm.end()))
    throw InputError("--depths: expected depths that grow, for example 10,20,30");
  return options;
}

}  // namespace

void run_study(const LargeStudyOptions& options) {
  Study(with_defaults(options)).run();
}

}  // namespace palpate::large
