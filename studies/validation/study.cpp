#include "studies/validation/study.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "formats/atomic_file.h"
#include "formats/checksum.h"
#include "formats/errors.h"
#include "formats/program.h"
#include "studies/accuracy/command.h"
#include "studies/accuracy/results.h"
#include "studies/validation/against_calculix.h"
#include "studies/validation/cases.h"
#include "studies/validation/judge.h"
#include "studies/validation/pressed_blocks.h"

namespace palpate::validation {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kCalculix = "calculix";

Json record_of(const Measured& m) {
  Json quantities = Json::array();
  for (const auto& q : m.quantities)
    quantities.push_back(
        accuracy::with_nulls({{"quantity", q.name}, {"value", q.value}, {"exact", q.exact}, {"error", q.error}}));
  return {{"vertices", m.vertices},
          {"unknowns", m.unknowns},
          {"assemble_s", m.assemble_seconds},
          {"solve_s", m.solve_seconds},
          {"quantities", quantities}};
}

Json record_of(const Agreement& a) {
  return accuracy::with_nulls({{"vertices", a.vertices},
                               {"nodes", a.nodes},
                               {"tetrahedra", a.cells},
                               {"difference", a.difference},
                               {"assemble_s", a.assemble_seconds},
                               {"solve_s", a.solve_seconds},
                               {"calculix_s", a.calculix_seconds}});
}

class Study {
 public:
  explicit Study(StudyOptions options) : options_(std::move(options)) {
    if (options_.output.empty()) options_.output = options_.data / "validation";
    std::filesystem::create_directories(options_.output / "points");
    std::filesystem::create_directories(options_.output / "logs");
    program_ = sha256_of_file(std::filesystem::read_symlink("/proc/self/exe").string());
    cases_ = all_cases({options_.bin, scratch()});
    for (const auto& id : options_.only) check_known(id);
    std::erase_if(cases_, [this](const Case& c) { return !wanted(c.id); });
    if (wanted(kCalculix)) plan_calculix();
  }

  void run() {
    Progress progress("validation", steps());
    for (const auto& c : cases_) measure(c, progress);
    for (const auto& mesh : calculix_) measure(mesh, progress);
    std::filesystem::remove_all(scratch());
    write();
    const std::string page =
        accuracy::write_report(options_.python, options_.source, "validation", options_.output, "validation").string();
    note(fmt::format("{}: {} of {} checks hold", page, judged_ - failed_.size(), judged_));
    if (!failed_.empty())
      throw VerificationError(fmt::format("{} of {} checks do not hold; the first: {}; all of them: {}", failed_.size(),
                                          judged_, failed_.front(), page));
  }

 private:
  std::filesystem::path scratch() const { return options_.output / "scratch"; }

  bool wanted(const std::string& id) const {
    return options_.only.empty() || std::find(options_.only.begin(), options_.only.end(), id) != options_.only.end();
  }

  void check_known(const std::string& id) const {
    std::string known = kCalculix;
    for (const auto& c : cases_) {
      if (c.id == id) return;
      known += ", " + c.id;
    }
    if (id != kCalculix) throw InputError(fmt::format("--only {}: expected one of {}", id, known));
  }

  void plan_calculix() {
    calculix_ = built_in_meshes();
    for (auto& block : pushed_blocks()) calculix_.push_back(std::move(block));
    for (auto& pair : pressed_block_pairs({options_.bin, scratch()})) calculix_.push_back(std::move(pair));
    if (options_.brief)
      std::erase_if(calculix_, [](const auto& m) {
        return m.name.find("16 cells") != std::string::npos || (m.compare && !m.name.ends_with("shifted"));
      });
    accuracy::StudyOptions folders;
    folders.source = options_.source, folders.bin = options_.bin, folders.data = options_.data;
    folders.output = options_.output;
    for (const auto& name : options_.organ_meshes) calculix_.push_back(organ_mesh(name, folders));
    for (const auto& name : options_.organ_pushes)
      for (auto& pushed : pushed_organ(name, folders)) calculix_.push_back(std::move(pushed));
  }

  std::vector<int> levels_of(const Variant& variant) const {
    auto levels = variant.levels;
    if (options_.brief && levels.size() > 2) levels.resize(2);
    return levels;
  }

  std::uint64_t steps() const {
    std::uint64_t count = calculix_.size();
    for (const auto& c : cases_)
      for (const auto& variant : c.variants) count += levels_of(variant).size();
    return count;
  }

  // Reads the measurement if the same program made it before; otherwise measures and keeps it.
  template <class Measure>
  Json kept_or(const std::string& what, const Measure& measure_it) const {
    const std::string key = what + " " + program_;
    const auto file = options_.output / "points" / fmt::format("{:016x}.json", formats::xxh64(key.data(), key.size()));
    if (std::ifstream in(file); in)
      if (Json known = Json::parse(in, nullptr, false); known.is_object()) return known;
    say("measuring " + what);
    const Json fresh = record_of(measure_it());
    write_text_atomically(file, fresh.dump(1) + "\n");
    return fresh;
  }

  void measure(const Case& c, Progress& progress) {
    Json series = Json::array();
    for (const auto& variant : c.variants) {
      const auto levels = levels_of(variant);
      std::vector<Json> measured;
      for (const int level : levels) {
        const auto what =
            fmt::format("{}, {}, nu {:g}, {} cells", c.id, name_of(variant.element), variant.poisson, level);
        measured.push_back(kept_or(what, [&] { return c.measure(variant, level); }));
        add_points(c, variant, level, measured.back());
        progress.advance();
      }
      for (std::size_t q = 0; q < measured.front()["quantities"].size(); ++q)
        series.push_back(judged_series(c, variant, levels, measured, q));
    }
    judged_cases_.push_back({{"id", c.id},
                             {"title", c.title},
                             {"closed_form", c.closed_form},
                             {"source", c.source},
                             {"theory", c.theory},
                             {"series", series}});
  }

  void add_points(const Case& c, const Variant& variant, int level, const Json& measured) {
    for (const auto& q : measured["quantities"]) {
      Json point = {
          {"case", c.id}, {"element", name_of(variant.element)}, {"poisson", variant.poisson}, {"cells", level}};
      for (const char* key : {"vertices", "unknowns", "assemble_s", "solve_s"}) point[key] = measured[key];
      point.update(q);
      points_.push_back(point);
    }
  }

  Json judged_series(const Case& c, const Variant& variant, const std::vector<int>& levels,
                     const std::vector<Json>& measured, std::size_t q) {
    std::vector<double> errors;
    for (const auto& m : measured) {
      const auto& error = m["quantities"][q]["error"];
      errors.push_back(error.is_null() ? NAN : error.get<double>());
    }
    const std::string quantity = measured.front()["quantities"][q]["quantity"];
    const Expectation expected = c.expect(quantity, variant);
    const Verdict verdict = judge(expected, levels, errors, levels.size() == variant.levels.size());
    count(verdict, fmt::format("{}, {}, nu {:g}, {}", c.title, name_of(variant.element), variant.poisson, quantity));
    return accuracy::with_nulls({{"element", name_of(variant.element)},
                                 {"poisson", variant.poisson},
                                 {"quantity", quantity},
                                 {"error", verdict.error},
                                 {"bound", expected.bound},
                                 {"order", verdict.order ? Json(*verdict.order) : Json()},
                                 {"order_least", expected.order ? Json(expected.order->least) : Json()},
                                 {"order_most", expected.order ? Json(expected.order->most) : Json()},
                                 {"judged", verdict.judged},
                                 {"holds", verdict.holds},
                                 {"why", verdict.sentence}});
  }

  void measure(const CalculixMesh& mesh, Progress& progress) {
    Json row = {
        {"mesh", mesh.name}, {"element", name_of(mesh.element)}, {"poisson", mesh.poisson}, {"bound", mesh.bound}};
    row.update(kept_or(fmt::format("CalculiX, {}, {}, nu {}", mesh.name, name_of(mesh.element), mesh.poisson),
                       [&] { return compare_with_calculix(mesh, scratch() / "ccx"); }));
    Verdict verdict;
    verdict.judged = true;
    verdict.holds = row["difference"].is_number() && row["difference"].get<double>() <= mesh.bound;
    verdict.sentence =
        verdict.holds ? "" : fmt::format("difference {}, above {:g}", row["difference"].dump(), mesh.bound);
    count(verdict, "CalculiX, " + mesh.name);
    row["holds"] = verdict.holds;
    agreements_.push_back(row);
    progress.advance();
  }

  void count(const Verdict& verdict, const std::string& what) {
    if (verdict.judged) ++judged_;
    if (!verdict.holds) failed_.push_back(fmt::format("{}: {}", what, verdict.sentence));
  }

  void write() const {
    const Json study = {{"program", "palpate-validation"},
                        {"program_version", PALPATE_VERSION},
                        {"brief", options_.brief},
                        {"order_tolerance", kOrderTolerance},
                        {"checks", judged_},
                        {"failed", failed_},
                        {"machine", accuracy::machine_json()},
                        {"cases", judged_cases_},
                        {"calculix", agreements_}};
    accuracy::write_results(options_.output, "validation", study, points_);
  }

  StudyOptions options_;
  std::string program_;
  std::vector<Case> cases_;
  std::vector<CalculixMesh> calculix_;
  std::vector<Json> points_;
  Json judged_cases_ = Json::array(), agreements_ = Json::array();
  std::size_t judged_ = 0;
  std::vector<std::string> failed_;
};

}  // namespace

std::vector<Case> all_cases(const Workshop& workshop) {
  return {patch_test(),
          rigid_motion(),
          superposition(workshop),
          pressed_cylinder(),
          manufactured(4),
          manufactured(0),
          thick_sphere(),
          point_force(),
          flat_punch_squared(),
          flat_punch_even(),
          hertz_contact(),
          equal_spheres(workshop),
          unequal_spheres(workshop),
          cantilever(),
          elliptic_plate_le10(),
          cook_linear(),
          stretched_bar(),
          sheared_block(),
          twisted_cylinder(),
          elastica(),
          cook_large(),
          sphere_on_block(workshop),
          two_shells(workshop),
          ironing(workshop)};
}

void run_study(StudyOptions options) {
  Study(std::move(options)).run();
}

}  // namespace palpate::validation
