#include "studies/accuracy/study.h"

#include <fmt/format.h>

#include <fstream>
#include <list>

#include "formats/atomic_file.h"
#include "formats/checksum.h"
#include "formats/errors.h"
#include "formats/program.h"
#include "studies/accuracy/bake.h"
#include "studies/accuracy/choose.h"
#include "studies/accuracy/command.h"
#include "studies/accuracy/errors_of_points.h"
#include "studies/accuracy/large_strain.h"
#include "studies/accuracy/measured.h"
#include "studies/accuracy/results.h"
#include "studies/accuracy/study_plan.h"
#include "studies/timing/timing.h"

namespace palpate::accuracy {
namespace {

// Raise it when the exercises or the recorded values change: points of another version are measured anew.
constexpr int kStudyVersion = 7;
constexpr int kMostTogether = 100;  // contacts

class Study {
 public:
  explicit Study(const StudyOptions& options)
      : organ_(options),
        measured_(folder() / "points"),
        sites_(choose_or_read("sites.json",
                              [&](const ElasticBody& body, double radius) {
                                return choose_sites(body, radius, options.sites, options.samples);
                              })),
        crowd_(choose_or_read("crowd.json",
                              [&](const ElasticBody& body, double radius) {
                                return choose_crowd(body, radius, kMostTogether, sites_.samples);
                              })),
        bakery_(organ_, sites_) {}

  void run() {
    for (const auto& resolution : organ_.resolutions()) make_mesh_early(resolution);
    const auto plan = plan_study(organ_, static_cast<int>(crowd_.touch.size()), elements_of_references());
    Progress progress("study", plan.size());
    for (const auto& planned : plan) {
      // A point that fails is reported and left out; the others do not depend on it.
      try {
        if (const auto setting = fitting(planned.setting)) measure(*setting, planned.axes);
      } catch (const OperationError& error) {
        leave_out(name_of(planned.setting), error.what());
      }
      progress.advance();
    }
    if (organ_.options().has_axis("depth")) push_deep_at_sites();
    write();
    report();
  }

 private:
  const std::filesystem::path& folder() const { return organ_.options().output; }

  // Three sites at most: on large meshes one large-strain solution takes minutes.
  void push_deep_at_sites() {
    for (std::size_t p = 0; p < std::min<std::size_t>(3, sites_.touch.size()); ++p) {
      say(fmt::format("pushing deep at site {}", p + 1));
      try {
        timed("large strain", [&] { large_strain_.push_back(push_deep(organ_, bakery_, sites_, p)); });
      } catch (const OperationError& error) {
        leave_out(fmt::format("the deep push at site {}", p + 1), error.what());
      }
    }
  }

  // A mesh that fails is reported with its points.
  void make_mesh_early(const std::string& resolution) const try {
    timed("meshes", [&] { organ_.make_mesh(resolution); });
  } catch (const OperationError&) {
  }

  // Adds to what a stage took.
  template <class Work>
  void timed(const char* stage, const Work& work) const {
    const auto begin = studies::Clock::now();
    work();
    took_[stage] += studies::seconds_since(begin);
  }

  // Chosen once, on the finest mesh. A study whose finest mesh, boundary set or options changed chooses anew.
  template <class Choose>
  StudySites choose_or_read(const char* name, const Choose& choose) const {
    const StudyOptions& o = organ_.options();
    std::filesystem::path mesh;
    timed("meshes", [&] { mesh = organ_.make_mesh(organ_.resolutions().back()); });
    const nlohmann::json from = {{"version", kStudyVersion},
                                 {"mesh_sha256", sha256_of_file(mesh.string())},
                                 {"boundary_sha256", sha256_of_file(organ_.boundary_file().string())},
                                 {"radius_mm", o.radius_mm},
                                 {"sites", o.sites},
                                 {"together", kMostTogether},
                                 {"samples", o.samples}};
    const auto file = folder() / name;
    if (std::ifstream in(file); in) {
      const auto json = nlohmann::json::parse(in, nullptr, false);
      if (json.is_object() && json.value("from", nlohmann::json()) == from) return sites_of(json.at("sites"));
    }
    const StudySites sites = choose(organ_.body(organ_.resolutions().back()), 1e-3 * o.radius_mm);
    write_text_atomically(file, nlohmann::json{{"from", from}, {"sites", json_of(sites)}}.dump(1) + "\n");
    return sites;
  }

  // Where p2-p0 reaches the finest mesh, no other element can be a better reference.
  std::vector<std::string> elements_of_references() {
    if (quadratic_fits(organ_.resolutions().back())) return {"p2-p0"};
    return {"p2-p0", "p1-anp"};
  }

  bool quadratic_fits(const std::string& resolution) {
    Setting setting;
    setting.bundle.resolution = resolution, setting.bundle.element = "p2-p0";
    return fitting(setting).has_value();
  }

  // The setting as it is; or, if that is too large, with columns near the sites only; or nothing. A mesh that p2-p0 fits has room
  // for the other elements, whose factors are smaller.
  std::optional<Setting> fitting(Setting setting) {
    if (setting.bundle.element != "p2-p0" && quadratic_fits(setting.bundle.resolution)) return setting;
    auto& fits = fits_[text_of(setting.bundle)];
    if (!fits.has_value()) {
      fits = setting.bundle;
      auto why = bakery_.too_large(*fits);
      if (why && fits->everywhere) fits->everywhere = false, why = bakery_.too_large(*fits);
      if (why) {
        leave_out(name_of(setting), *why);
        fits->resolution.clear();
      }
    }
    if (fits->resolution.empty()) return {};
    if (is_crowded(setting) && !fits->everywhere)
      return {};  // the next coarser mesh becomes the reference of the many contacts
    if (!fits->everywhere && fits->storage.starts_with("low-rank")) {
      leave_out(name_of(setting),
                "all columns would take too long, and the blocks of some say nothing of those of all");
      return {};
    }
    setting.bundle = *fits;
    return setting;
  }

  bool is_crowded(const Setting& setting) const {
    return setting.scene.contacts > static_cast<int>(sites_.touch.size());
  }
  const StudySites& sites_for(const Setting& setting) const { return is_crowded(setting) ? crowd_ : sites_; }

  void leave_out(const std::string& what, const std::string& why) {
    warn(fmt::format("{} is left out: {}", what, why));
    left_out_.push_back({{"name", what}, {"why", why}});
  }

  // Made for the first setting whose tools meet it.
  const StudySurface* fine_surface(const Setting& setting) {
    if (setting.scene.surface != "fine") return nullptr;
    if (!fine_) fine_ = surface_of(organ_.body(organ_.resolutions().back()));
    return &*fine_;
  }

  std::string key_of(const Setting& setting) const {
    const std::string text = nlohmann::json{{"version", kStudyVersion},
                                            {"bundle", bakery_.look(setting.bundle).fingerprint},
                                            {"scene", setting.scene},
                                            {"measured_by", own_hash_},
                                            {"finest", organ_.resolutions().back()},
                                            {"sites", json_of(sites_for(setting))}}
                                 .dump();
    return fmt::format("{:016x}", formats::xxh64(text.data(), text.size()));
  }

  void measure(const Setting& setting, const std::set<std::string>& axes) {
    const std::string key = key_of(setting);
    for (auto& taken : taken_)
      if (taken.key == key) {
        taken.axes.insert(axes.begin(), axes.end());
        return;
      }
    auto point = measured_.find(key);
    if (!point) {
      say("measuring " + name_of(setting));
      MeasuredPoint fresh = {setting, {}, {}};
      timed("bundles", [&] {
        fresh.cost = bakery_.bake(setting.bundle);
        if (setting.bundle.poisson == 0 && !setting.bundle.everywhere)
          fresh.cost["full"] = bakery_.predict_full(setting.bundle);
      });
      timed("touches", [&] {
        fresh.seen =
            observe(bakery_.look(setting.bundle).bundle, setting.scene, sites_for(setting), fine_surface(setting));
      });
      measured_.add(key, fresh);
      point = std::move(fresh);
    }
    taken_.push_back({std::move(*point), key, axes});
  }

  void write() const {
    std::vector<PlannedMeasurement> points;
    for (const auto& taken : taken_) points.push_back({&taken.point, taken.axes});
    std::vector<nlohmann::ordered_json> records;
    const auto judged_points = judge(points);
    for (const auto& judged : judged_points) records.push_back(record_of(judged, organ_.poisson()));
    const StudyOptions& o = organ_.options();
    nlohmann::ordered_json study = {{"program", "palpate-accuracy"},
                                    {"program_version", PALPATE_VERSION},
                                    {"organ", o.organ},
                                    {"boundary", o.boundary},
                                    {"element", organ_.element()},
                                    {"resolutions", organ_.resolutions()},
                                    {"base_resolution", organ_.base_resolution()},
                                    {"radius_mm", o.radius_mm},
                                    {"sites", sites_.touch.size()},
                                    {"samples", sites_.samples.size()},
                                    {"room_for_contacts", std::max(sites_.touch.size(), crowd_.touch.size())},
                                    {"data", o.data.string()},
                                    {"bin", o.bin.string()},
                                    {"boundary_sha256", sha256_of_file(organ_.boundary_file().string())},
                                    {"reference", reference(judged_points)},
                                    {"machine", machine_json()}};
    study["took_s"] = took_;  // of this run; points that were kept took no time
    study["left_out"] = left_out_;
    study["large_strain"] = large_strain_;
    const auto scatter = [&](const char* what) {
      const auto& known = study["reference"][what]["scatter"];
      return known.is_number() ? known.get<double>() : 0;
    };
    study["picks"] = picks(records, {scatter("force"), scatter("field")});
    write_results(folder(), "accuracy", study, records);
    for (const auto& [stage, seconds] : took_) note(fmt::format("{}: {}", stage, duration_text(seconds)));
    note(fmt::format("{}: {} points", (folder() / "accuracy.json").string(), records.size()));
  }

  // The reference for the organ's own material and one pressed disc.
  nlohmann::ordered_json reference(const std::vector<JudgedPoint>& points) const {
    const std::string plain = situation_of(Setting{});
    for (const auto& judged : points)
      for (const auto& taken : taken_)
        if (judged.is_reference && judged.point == &taken.point && situation_of(taken.point.setting) == plain)
          return {
              {"name", name_of(taken.point.setting)},           {"key", taken.key},
              {"vertices", taken.point.cost.at("vertices")},    {"element", taken.point.setting.bundle.element},
              {"force", json_of(judged.reference_error.force)}, {"field", json_of(judged.reference_error.field)},
              {"check", json_of(judged.reference_error.check)}, {"without_one", json_of(judged.reference_error.range)},
              {"other", json_of(judged.reference_error.other)}};
    throw OperationError(
        "no mesh of the study can be solved with p2-p0 or p1-anp, the references, in that memory and time; raise "
        "--memory or --most-seconds, or add a coarser mesh to --resolutions");
  }

  void report() const {
    note(write_report(organ_.options().python, organ_.options().source, "accuracy", folder(), "accuracy").string() +
         ": the report");
  }

  const std::string own_hash_ = sha256_of_file("/proc/self/exe");  // the runtime that is measured is inside
  mutable std::map<std::string, double> took_;                     // s, of this run
  OrganCase organ_;
  MeasuredPoints measured_;
  StudySites sites_, crowd_;
  std::optional<StudySurface> fine_;
  Bakery bakery_;
  std::map<std::string, std::optional<BundleSetting>> fits_;
  struct Taken {
    MeasuredPoint point;
    std::string key;
    std::set<std::string> axes;
  };
  std::list<Taken> taken_;

  std::vector<nlohmann::json> large_strain_;
  nlohmann::ordered_json left_out_ = nlohmann::ordered_json::array();
};

}  // namespace

StudySites read_sites(const std::filesystem::path& folder) {
  const auto file = folder / "sites.json";
  std::ifstream in(file);
  const auto json = nlohmann::json::parse(in, nullptr, false);
  if (!json.is_object() || !json.contains("sites"))
    throw InputError(fmt::format("{}: expected the sites of a study, found none; run the study again", file.string()));
  return sites_of(json.at("sites"));
}

void run_study(const StudyOptions& options) {
  Study(options).run();
}

}  // namespace palpate::accuracy
