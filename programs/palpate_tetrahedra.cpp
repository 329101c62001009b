// palpate-tetrahedra: makes a tetrahedral mesh from closed surfaces, a label image or a gmsh geometry, and checks it.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "formats/atomic_file.h"
#include "formats/command_line.h"
#include "formats/errors.h"
#include "formats/make_rule.h"
#include "formats/processor_limit.h"
#include "formats/program.h"
#include "formats/tetrahedral_mesh.h"
#include "meshing/image/label_image.h"
#include "meshing/image/voxel_mask.h"
#include "meshing/surface/repair_surface.h"
#include "meshing/surface/surface_file.h"
#include "meshing/tetrahedra/fill_with_tetrahedra.h"
#include "meshing/tetrahedra/mesh_quality.h"
#include "meshing/tetrahedra/mesh_report.h"
#include "meshing/tetrahedra/tetrahedra_from_geometry.h"
#include "meshing/tetrahedra/tetrahedra_from_image.h"
#include "meshing/tetrahedra/tetrahedra_from_surfaces.h"

namespace palpate {
namespace {

struct Options {
  std::vector<std::string> inputs, regions, assignments, labels;
  std::string output, report;
  bool nested_regions = false, keep_surface = false;
  FillOptions fill;
  LabelImageOptions image;
  std::string cavities;                   // empty: decided by the orientation of the shells
  std::optional<std::string> components;  // default: all pieces of a surface, 1% for an image
  QualityGate gate{10, 0.05};
  std::optional<double> time_limit;
  MakeRule rule;
};

void define_for_images(CLI::App& app, Options& o) {
  const auto image = [&](CLI::Option* option) { return option->group("For a label image"); };
  image(app.add_option("--labels", o.labels, "The tissues: 255=liver,127=kidney"))
      ->delimiter(',')
      ->allow_extra_args(false);
  image(app.add_option("--edge-mm", o.image.edge_mm, "Longest edge of surface triangles, mm"))
      ->check(positive_number());
  image(app.add_option("--facet-distance", o.image.facet_distance, "Farthest a triangle may be from the border, mm"))
      ->check(positive_number());
  image(app.add_option("--smooth", o.image.smooth_mm, "Gaussian width, mm (default: 1.5 mean voxel sides)"))
      ->check(non_negative_number());
}

void define(CLI::App& app, Options& o) {
  app.add_option("INPUT", o.inputs, "Closed surfaces, or a label image (with --labels), or a gmsh geometry (.geo)")
      ->required();
  app.add_option("-o,--output", o.output, "Mesh to write, MSH 4.1")->required();
  app.add_option("--report", o.report, "Also write the quality report as JSON");
  define_make_rule(app, o.rule);
  app.add_option("--size", o.fill.size,
                 "Largest edge inside, in the unit of the input (default: as the surface nearby)")
      ->check(positive_number());
  app.add_option("--optimize-below", o.fill.optimize_below, "Improve elements of a gmsh quality below this; 0: none")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  app.add_option("--goal", o.fill.goal,
                 "Move interior vertices, then try other settings, while a dihedral angle is below this, degrees")
      ->check(CLI::Range(0.0, 70.0))
      ->capture_default_str();
  app.add_option("--min-dihedral", o.gate.min_dihedral, "Refuse a mesh with a smaller dihedral angle, degrees")
      ->check(CLI::Range(0.0, 70.0))
      ->capture_default_str();
  app.add_option("--min-radius-ratio", o.gate.min_radius_ratio,
                 "Refuse a mesh with a smaller radius ratio (1 is regular)")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  app.add_option("--time-limit", o.time_limit,
                 "Surfaces: seconds of processor time in all (default: 20, more for over 100,000 triangles or a small "
                 "--size); others: seconds for each run of the mesher (default: 3600)")
      ->check(positive_number());
  app.add_option("--region", o.regions, "NAME: name the regions in order; NAME=FILE: name all of a file's shells")
      ->allow_extra_args(false)
      ->group("For surfaces");
  app.add_flag("--nested-regions", o.nested_regions, "Shells inside others of their file are tissues of their own")
      ->group("For surfaces");
  app.add_flag("--keep-surface", o.keep_surface, "Never remesh: the mesh keeps every triangle of the surface, or fails")
      ->group("For surfaces");
  app.add_option("--cavities", o.cavities, "keep or fill: shells inside others, or holes inside a tissue of an image")
      ->check(CLI::IsMember({"keep", "fill"}))
      ->group("For surfaces and images");
  app.add_option(
         "--components", o.components,
         "Pieces to keep: all, largest, a count, a volume (2.5mm3, 1cm3) or a share of the largest (default: all "
         "shells of a surface, 1% of an image)")
      ->group("For surfaces and images");
  define_for_images(app, o);
  app.add_option("--set", o.assignments, "NAME=NUMBER: a DefineConstant parameter of the geometry")
      ->allow_extra_args(false)
      ->group("For a geometry");
}

// --region NAME=FILE names the regions of one input; a list of NAMEs names the regions in order.
std::vector<ShellInput> named_inputs(const Options& o, std::vector<std::string>& names_in_order) {
  std::vector<ShellInput> inputs;
  for (const std::string& file : o.inputs) inputs.push_back({{}, file, ""});
  for (const std::string& region : o.regions) {
    const std::size_t equals = region.find('=');
    if (equals == std::string::npos) {
      names_in_order.push_back(region);
      continue;
    }
    const std::string name = region.substr(0, equals), file = region.substr(equals + 1);
    if (name.empty() || file.empty()) throw InputError(fmt::format("--region {}: expected NAME or NAME=FILE", region));
    const auto found = std::find_if(inputs.begin(), inputs.end(), [&](const auto& i) { return i.file == file; });
    if (found == inputs.end()) throw InputError(fmt::format("--region {}: {} is not among the inputs", region, file));
    found->name = name;
  }
  if (!names_in_order.empty() && names_in_order.size() != o.regions.size())
    throw InputError("--region: give either NAME for all regions or NAME=FILE, not both");
  return inputs;
}

TriangleSurface repaired(const TriangleSurface& soup, const std::string& file, const Options& o) {
  const std::string cavities = o.nested_regions ? "keep" : o.cavities;
  RepairedSurface repaired = repair_surface(soup, parse_piece_filter(o.components.value_or("all")), cavities, file);
  for (const std::string& repair : repaired.repairs) warn(fmt::format("{}: {}", file, repair));
  return std::move(repaired.surface);
}

// What is said when a surface takes all the processor time; tetrahedra_from_surfaces says more where its meshers do.
std::string too_slow(const std::vector<ShellInput>& inputs, double limit) {
  const WorstInput worst = worst_input(inputs);
  return fmt::format(
      "{}: expected to be done within {:.6g} s of processor time, found triangles that take longer; {}; {}, or give it "
      "longer: --time-limit {:.6g}",
      worst.file, limit, text_of(worst.triangle), wrap_advice(worst.file), 4 * limit);
}

MeshReport mesh_surfaces(Options& o) {
  if (o.nested_regions && !o.cavities.empty())
    throw InputError("--nested-regions leaves no cavities; leave out --cavities");
  SurfaceFillOptions options{o.nested_regions, {}, o.keep_surface, o.gate, o.fill};
  std::vector<ShellInput> inputs = named_inputs(o, options.names);
  for (ShellInput& input : inputs) input.surface = read_surface(input.file, 1);
  const double limit = o.time_limit.value_or(default_processor_limit(inputs, o.fill.size));
  const ProcessorLimit ends_the_program("palpate-tetrahedra", limit, too_slow(inputs, limit));
  for (ShellInput& input : inputs) input.surface = repaired(input.surface, input.file, o);
  options.processor_limit = limit;
  options.processor_used = processor_seconds();
  options.fill.time_limit = std::max(o.fill.time_limit, limit);
  return tetrahedra_from_surfaces(std::move(inputs), options);
}

MeshReport mesh_image(Options& o) {
  if (o.inputs.size() > 1)
    throw InputError(fmt::format("{}: expected one image at a time; save slices as one NRRD or NIfTI", o.inputs[1]));
  if (o.labels.empty())
    throw InputError(
        fmt::format("{} is a label image: say which tissues to mesh, as in --labels 255=liver,127=kidney; for one "
                    "organ with a surface of chosen size use palpate-surface first",
                    o.inputs.front()));
  o.image.tissues = parse_tissues(o.labels);
  o.image.keep_cavities = o.cavities == "keep";
  o.image.components = o.components.value_or(o.image.components);
  return tetrahedra_from_image(o.inputs.front(), o.image, o.fill);
}

MeshReport mesh_one_geometry(const Options& o) {
  if (o.inputs.size() != 1) throw InputError("a geometry (.geo) is meshed alone; give one input");
  MeshReport report;
  report.mesh = tetrahedra_from_geometry(o.inputs.front(), o.assignments, o.fill);
  report.improvement = improve_worst_elements(report.mesh, o.fill.goal);
  return report;
}

enum class InputKind { surfaces, image, geometry };

InputKind kind_of(const std::vector<std::string>& inputs) {
  const auto is_geometry = [](const std::string& file) { return std::filesystem::path(file).extension() == ".geo"; };
  if (std::any_of(inputs.begin(), inputs.end(), is_geometry)) return InputKind::geometry;
  return is_image_name(inputs.front()) ? InputKind::image : InputKind::surfaces;
}

// Refuses an option that this kind of input would ignore.
void refuse_foreign_options(const CLI::App& app, InputKind kind) {
  const auto meant_for = [&](const std::string& group) {
    if (group == "For surfaces") return kind == InputKind::surfaces;
    if (group == "For a label image") return kind == InputKind::image;
    if (group == "For a geometry") return kind == InputKind::geometry;
    if (group == "For surfaces and images") return kind != InputKind::geometry;
    return true;
  };
  for (const CLI::Option* option : app.get_options())
    if (option->count() > 0 && !meant_for(option->get_group()))
      throw InputError(fmt::format("{} means nothing for this input ({} only); leave it out", option->get_name(),
                                   option->get_group()));
}

MeshReport mesh_input(const CLI::App& app, Options& o) {
  const InputKind kind = kind_of(o.inputs);
  refuse_foreign_options(app, kind);
  if (kind != InputKind::surfaces) o.fill.time_limit = o.time_limit.value_or(o.fill.time_limit);
  switch (kind) {
    case InputKind::geometry:
      return mesh_one_geometry(o);
    case InputKind::image:
      return mesh_image(o);
    case InputKind::surfaces:
      break;
  }
  return mesh_surfaces(o);
}

void run(const CLI::App& app, Options& o) {
  if (std::filesystem::path(o.output).extension() != ".msh")
    throw InputError(fmt::format("{}: the output is a gmsh mesh; give it a name ending in .msh", o.output));
  // Refuses an output that cannot be written before an hour of meshing, not after it.
  { const AtomicFile probe(o.output); }
  if (!o.report.empty()) {
    const AtomicFile probe(o.report);
  }
  MeshReport report = mesh_input(app, o);
  report.inputs = o.inputs;
  report.goal = o.fill.goal;
  report.quality = measure_quality(report.mesh);
  fmt::print("{}", text_of(report));
  try {
    if (report.tried.empty())
      pass_gate(report.mesh, report.quality, o.gate);
    else
      pass_gate(report.mesh, report.quality, o.gate, report.tried);
  } catch (const VerificationError& missed) {
    throw VerificationError(fmt::format("{}: {}", o.inputs.front(), missed.what()));
  }
  write_mesh(o.output, report.mesh);
  if (!o.report.empty()) write_text_atomically(o.report, json_of(report));
  write_make_rule(o.rule);
}

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) {
  palpate::Options options;
  const CLI::App* parsed = nullptr;
  const auto define = [&](CLI::App& app) {
    palpate::define(app, options);
    parsed = &app;
  };
  return palpate::run_program(argc, argv, "palpate-tetrahedra",
                              "Surfaces, label image or geometry -> tetrahedra that passed a quality gate (MSH 4.1)",
                              define, [&] { palpate::run(*parsed, options); });
}
