#include "studies/accuracy/choose_program.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <optional>

#include "formats/atomic_file.h"
#include "formats/errors.h"
#include "formats/program.h"
#include "precompute/bundle_tool/bundle_file.h"
#include "studies/accuracy/errors_of_points.h"
#include "studies/accuracy/results.h"
#include "studies/accuracy/study.h"

namespace palpate::accuracy {
namespace {

using Record = nlohmann::ordered_json;

// Allowed growth of an error between two machines: the bundle's bytes are the same, but forces are computed in doubles,
// which another processor may round otherwise.
constexpr double kSameMeasurement = 1e-6;

std::filesystem::path study_folder(const std::filesystem::path& given, const std::filesystem::path& data) {
  if (!given.empty()) return given;
  std::vector<std::filesystem::path> found;
  std::string list;
  if (std::filesystem::is_directory(data))
    for (const auto& organ : std::filesystem::directory_iterator(data))
      if (std::filesystem::is_directory(organ.path() / "accuracy"))
        for (const auto& study : std::filesystem::directory_iterator(organ.path() / "accuracy"))
          if (std::filesystem::exists(study.path() / "accuracy.json")) {
            found.push_back(study.path());
            list += ' ';
            list += study.path().string();
          }
  if (found.size() == 1) return found[0];
  throw InputError(
      found.empty()
          ? fmt::format(
                "{}: expected a study below it, found none; run palpate-accuracy ORGAN BC, or give --study FOLDER",
                data.string())
          : fmt::format("{}: several studies:{}; give --study FOLDER", data.string(), list));
}

Record read_study(const std::filesystem::path& folder) {
  const auto file = folder / "accuracy.json";
  std::ifstream in(file);
  Record study = Record::parse(in, nullptr, false);
  if (!study.is_object() || !study.contains("points"))
    throw InputError(
        fmt::format("{}: expected the result of a study, found none; run palpate-accuracy ORGAN BC", file.string()));
  return study;
}

std::string percent(const Record& value) {
  return value.is_number() ? fmt::format("{:.2g} %", 100 * value.get<double>()) : "unknown";
}

// "low-rank 1e-3" as palpate-bundle pack names it.
std::string stored_as(const std::string& storage) {
  const auto space = storage.find(' ');
  return space == std::string::npos ? storage : fmt::format("low-rank {}", std::stod(storage.substr(space + 1)));
}

// The least push, mm, at which linear elasticity is off by 5 % in the force or in the field at one of the places; nothing where no
// place was pushed so far.
std::optional<double> linear_limit_mm(const Record& study) {
  std::optional<double> least;
  for (const auto& push : study.value("large_strain", Record::array()))
    for (const char* what : {"force", "field"})
      if (const auto& depth = push.at("depth_mm_at").at("5").at(what); depth.is_number())
        least = std::min(least.value_or(depth.get<double>()), depth.get<double>());
  return least;
}

// What the bundle's certificate will state: the errors, the setting they were measured at, the reference.
Record measured_json(const Record& study, const Record& point) {
  Record m;
  const auto& reference = study.at("reference");
  m["accuracy_setting"] = point.at("name");
  m["accuracy_mesh_sha256"] = point.at("mesh_sha256");
  m["accuracy_boundary_sha256"] = study.at("boundary_sha256");
  m["accuracy_element"] = point.at("element");
  m["accuracy_storage"] = stored_as(point.at("storage"));
  m["accuracy_contact"] = point.at("contact");
  m["accuracy_reference"] = reference.at("name");
  m["accuracy_radius_mm"] = study.at("radius_mm");
  m["accuracy_sites"] = study.at("sites");
  for (const char* key :
       {"force_error", "force_error_worst", "force_error_N", "field_error", "field_error_worst", "field_error_mm",
        "reference_force_error", "reference_field_error", "touch_us", "touch_us_99", "shape_us", "shape_us_99"})
    if (!point.at(key).is_null()) m[std::string("accuracy_") + key] = point.at(key);
  if (const auto limit = linear_limit_mm(study)) m["accuracy_linear_limit_mm"] = *limit;
  m["accuracy_machine"] = study.at("machine").at("processor");
  return m;
}

std::string bake_script(const Record& study, const Record& point, bool large, const ChooseOptions& options) {
  const std::string organ = study.at("organ"), boundary = study.at("boundary"), mesh = point.at("resolution");
  const std::string source = options.source.string(), storage = point.at("storage");
  std::string pack = storage == "f16" ? "--precision f16 " : "";
  if (storage.rfind("low-rank", 0) == 0) pack = "--low-rank " + storage.substr(9) + " ";
  return fmt::format(
      "#!/bin/sh\n# {}: force {}, field {}, measured against {}.\n# BIN: the programs; MESH: made by make -f "
      "Makefile.data ORGAN={} BC={} RESOLUTION={} mesh\nset -eu\ncd \"$(dirname \"$0\")\"\n: \"${{BIN:={}}}\" "
      "\"${{MESH:={}}}\"\n"
      "\"$BIN/palpate-precompute\" \"$MESH\" --organ organ.toml --boundary {} --store {} --tolerance {}{} -o baked.h5\n"
      "\"$BIN/palpate-bundle\" pack baked.h5 -o bundle.h5 {}--accuracy measured.json\n",
      point.at("name").get<std::string>(), percent(point.at("force_error")), percent(point.at("field_error")),
      study.at("reference").at("name").get<std::string>(), organ, boundary, mesh, study.at("bin").get<std::string>(),
      (std::filesystem::path(study.at("data").get<std::string>()) / organ / mesh / "mesh.msh").string(),
      (options.source / "pipelines" / organ / "boundary" / (boundary + ".toml")).string(),
      storage == "f64" ? "f64" : "f32", point.at("tolerance").get<double>(), large ? " --large-deformation" : "", pack);
}

// ---- the deformation at a depth ----

constexpr double kDeepLimit = 0.05;  // of force and field, where the user gives none

double limit_of(const ChooseOptions& options, const char* field) {
  for (const Limit& limit : options.limits)
    if (limit.field == field) return limit.most;
  return kDeepLimit;
}

// A cost of a deformation: the largest over the study's deep pushes.
double deep_cost(const Record& study, const std::string& model, const char* cost) {
  double most = 0;
  for (const auto& push : study.at("large_strain"))
    if (push.at("models").contains(model)) most = std::max(most, push.at("models").at(model).at(cost).get<double>());
  return most;
}

// The first deformation within the limits at the depth: they get dearer in this order, but linear and response take nearly the same
// time. Prints all. Errors: VerificationError where none is.
std::string choose_deformation(const Record& study, const ChooseOptions& options) {
  const double force = limit_of(options, "force_error"), field = limit_of(options, "field_error");
  std::string chosen;
  for (const char* model : {"linear", "response", "large"}) {
    const auto error = deep_error(study, model, options.depth_mm);
    if (!error) continue;
    fmt::print(
        "{:9} at {:g} mm: force off by {:.2g} %, field by {:.2g} % (worst site); touch {:.3g} us, scene {:.3g} MB\n",
        model, options.depth_mm, 100 * error->force, 100 * error->field, deep_cost(study, model, "touch_us"),
        deep_cost(study, model, "scene_MB"));
    if (chosen.empty() && error->force <= force && error->field <= field) chosen = model;
  }
  if (chosen.empty())
    throw VerificationError(
        fmt::format("--depth {:g}mm: no deformation that was measured so deep has a force error within {:.2g} % and a "
                    "field error within {:.2g} %; raise --force-error and --field-error, or push less deep",
                    options.depth_mm, 100 * force, 100 * field));
  fmt::print("take deformation {}\n", chosen);
  return chosen;
}

std::string effects_of(const std::string& deformation) {
  if (deformation == "large") return "deformation = \"large\"\n";
  if (deformation == "response") return "force = \"response\"\nradial = \"response\"\n";
  return "";
}

void write_choice(const Record& study, const Record& point, const std::string& deformation,
                  const ChooseOptions& options) {
  std::filesystem::create_directories(options.output);
  const auto put = [&](const char* name, const std::string& text) {
    write_text_atomically(options.output / name, text);
  };
  const auto organ = options.source / "pipelines" / study.at("organ").get<std::string>() / "organ.toml";
  put("organ.toml", organ_text(organ, point.at("element"), 0));
  put("effects.toml",
      fmt::format("# For a scene.toml; the tools have a radius, in the study {} mm.\n[effects]\ncontact = \"{}\"\n{}",
                  study.at("radius_mm").get<double>(), point.at("contact").get<std::string>(),
                  effects_of(deformation)));
  put("measured.json", measured_json(study, point).dump(1) + "\n");
  put("bake.sh", bake_script(study, point, deformation == "large", options));
  std::filesystem::permissions(options.output / "bake.sh", std::filesystem::perms::owner_exec,
                               std::filesystem::perm_options::add);
  note(fmt::format(
      "{}: organ.toml, effects.toml, measured.json; bake.sh makes bundle.h5 with these figures in its certificate",
      options.output.string()));
}

}  // namespace

void choose(const ChooseOptions& options) {
  const Record study = read_study(study_folder(options.study, options.data));
  auto points = study.at("points").get<std::vector<Record>>();
  const std::string deformation = options.depth_mm > 0 ? choose_deformation(study, options) : "linear";
  if (deformation == "large")
    std::erase_if(points,
                  [](const Record& point) { return point.at("element") == "p2-p0"; });  // which it does not know
  const Record* found = cheapest(points, options.limits, options.least);
  if (!found)
    throw VerificationError("no measured setting is within all limits: " +
                            what_stands_in_the_way(points, options.limits));
  const Record& p = *found;
  if (const std::string why = beyond_the_reference(p, options.limits); !why.empty()) throw VerificationError(why);
  fmt::print(
      "{}\n  force error {} (worst {}, {:.3g} N), field error {} (at most {:.3g} mm)\n  against {}, itself off by "
      "about {} and {}\n  touch {:.3g} us (99 %: {:.3g}), shape {:.3g} us (99 %: {:.3g}), bundle {:.3g} MB, precompute "
      "{:.3g} s and {:.2g} GB\n",
      p.at("name").get<std::string>(), percent(p.at("force_error")), percent(p.at("force_error_worst")),
      p.at("force_error_N").get<double>(), percent(p.at("field_error")), p.at("field_error_mm").get<double>(),
      study.at("reference").at("name").get<std::string>(), percent(p.at("reference_force_error")),
      percent(p.at("reference_field_error")), p.at("touch_us").get<double>(), p.at("touch_us_99").get<double>(),
      p.at("shape_us").get<double>(), p.at("shape_us_99").get<double>(), p.at("bundle_MB").get<double>(),
      p.at("precompute_s").get<double>(), p.at("precompute_GB").get<double>());
  for (const Limit& limit : options.limits)
    if (const std::string own = "reference_" + limit.field; p.contains(own) && p.at(own).is_number())
      if (const double error = p.at(limit.field), band = p.at(own); error + band > limit.most)
        warn(fmt::format("{}: the limit may be exceeded, because the reference itself is off by about {:.2g} %",
                         limit.option, 100 * band));
  if (!options.output.empty()) write_choice(study, p, deformation, options);
}

void check(const CheckOptions& options) {
  const auto folder = study_folder(options.study, options.data);
  const Record study = read_study(folder);
  const BundleFile bundle(options.bundle);
  const nlohmann::json stated = bundle.provenance();
  if (!stated.is_object() || !stated.contains("accuracy_force_error") || !stated.contains("accuracy_field_error"))
    throw InputError(
        fmt::format("{}: states no accuracy; bake it as palpate-accuracy choose says", options.bundle.string()));
  const auto& reference = study.at("reference");
  if (stated.value("accuracy_reference", "") != reference.at("name").get<std::string>())
    throw InputError(fmt::format("{}: was measured against {}, the study {} has {}", options.bundle.string(),
                                 stated.value("accuracy_reference", "nothing"), folder.string(),
                                 reference.at("name").get<std::string>()));
  const auto truth = MeasuredPoints(folder / "points").find(reference.at("key"));
  if (!truth) throw InputError(fmt::format("{}: its reference is not there; run the study again", folder.string()));
  SceneSetting scene;
  scene.contact = stated.value("accuracy_contact", "patch");
  const Difference now = difference(observe(options.bundle, scene, read_sites(folder), nullptr), truth->seen);
  const double force = stated.at("accuracy_force_error"), field = stated.at("accuracy_field_error");
  fmt::print("force error {:.4g} %, stated {:.4g} %; field error {:.4g} %, stated {:.4g} %\n", 100 * now.force,
             100 * force, 100 * now.field, 100 * field);
  if (now.force > force + kSameMeasurement || now.field > field + kSameMeasurement)
    throw VerificationError(fmt::format("{}: its error is above what its certificate states", options.bundle.string()));
}

}  // namespace palpate::accuracy
