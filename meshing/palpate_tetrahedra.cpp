// palpate-tetrahedra: closed surfaces, a label image or a gmsh geometry -> a tetrahedral mesh that passed its gate.

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "formats/atomic_file.h"
#include "formats/errors.h"
#include "formats/program.h"
#include "formats/tetrahedral_mesh.h"
#include "meshing/fill_with_tetrahedra.h"
#include "meshing/mesh_geometry.h"
#include "meshing/mesh_quality.h"
#include "meshing/mesh_report.h"
#include "meshing/read_closed_surface.h"
#include "meshing/shells.h"

namespace palpate {
namespace {

struct Options {
  std::vector<std::string> inputs, regions, assignments;
  std::string output, report;
  NestedShells nested = NestedShells::by_orientation;
  FillOptions fill;
  QualityGate gate{10, 0.05};
};

void define(CLI::App& app, Options& o) {
  app.add_option("INPUT", o.inputs, "Closed surfaces (a region each), or one gmsh geometry (.geo)")->required();
  app.add_option("-o,--output", o.output, "Mesh to write, MSH 4.1")->required();
  app.add_option("--region", o.regions, "NAME: name the regions in order; NAME=FILE: name all of a file's shells");
  app.add_option("--nested", o.nested, "What a shell inside another of its file is, where its orientation does not say")
      ->transform(
          CLI::CheckedTransformer(std::map<std::string, NestedShells>{{"orientation", NestedShells::by_orientation},
                                                                      {"regions", NestedShells::regions},
                                                                      {"cavities", NestedShells::cavities}}));
  app.add_option("--set", o.assignments, "NAME=NUMBER: a DefineConstant parameter of the geometry");
  app.add_option("--size", o.fill.size,
                 "Largest edge inside, in the unit of the input (default: as the surface nearby)")
      ->check(CLI::PositiveNumber);
  app.add_option("--optimize-below", o.fill.optimize_below, "Improve elements of a gmsh quality below this; 0: none")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  app.add_option("--min-dihedral", o.gate.min_dihedral, "Refuse a mesh with a smaller dihedral angle, degrees")
      ->check(CLI::Range(0.0, 70.0))
      ->capture_default_str();
  app.add_option("--min-radius-ratio", o.gate.min_radius_ratio,
                 "Refuse a mesh with a smaller radius ratio (1 is regular)")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  app.add_option("--time-limit", o.fill.time_limit, "Stop the mesher after this many seconds")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--report", o.report, "Also write the quality report as JSON");
}

// --region NAME=FILE becomes the name of an input (added where it is not among them); NAME alone stays for the order.
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

MeshReport mesh_surfaces(const Options& o) {
  std::vector<std::string> names;
  std::vector<ShellInput> inputs = named_inputs(o, names);
  TriangleSurface all;
  for (ShellInput& input : inputs) {
    input.surface = read_closed_surface(input.file);
    const auto first = static_cast<std::int32_t>(all.points.size());
    all.points.insert(all.points.end(), input.surface.points.begin(), input.surface.points.end());
    for (const Triangle& t : input.surface.triangles)
      all.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
  if (inputs.size() > 1) refuse_self_intersection(all, "the inputs together");
  const VolumeBoundary boundary = regions_of_shells(inputs, o.nested, names);
  note(fmt::format("filling {} region(s) inside {} triangles", boundary.region_names.size(), all.triangles.size()));
  MeshReport report;
  report.mesh = fill_with_tetrahedra(boundary, o.fill);
  report.surface_triangles = all.triangles.size();
  report.kept_triangles = verify_boundary_kept(boundary, report.mesh);
  report.region_volume_of_surface = enclosed_volumes(boundary);
  return report;
}

MeshReport mesh_input(const Options& o) {
  const auto is_geometry = [](const std::string& file) { return std::filesystem::path(file).extension() == ".geo"; };
  if (std::any_of(o.inputs.begin(), o.inputs.end(), is_geometry)) {
    if (o.inputs.size() != 1) throw InputError("a geometry (.geo) is meshed alone; give one input");
    if (!o.regions.empty())
      throw InputError("--region: a geometry names its regions itself, with Physical Volume(\"NAME\")");
    MeshReport report;
    report.mesh = mesh_geometry(o.inputs.front(), o.assignments, o.fill);
    return report;
  }
  if (!o.assignments.empty()) throw InputError("--set is for a geometry (.geo), and the input is none");
  return mesh_surfaces(o);
}

void run(const Options& o) {
  if (std::filesystem::path(o.output).extension() != ".msh")
    throw InputError(fmt::format("{}: the output is a gmsh mesh; give it a name ending in .msh", o.output));
  MeshReport report = mesh_input(o);
  report.inputs = o.inputs;
  report.quality = measure_quality(report.mesh);
  fmt::print("{}", text_of(report));
  pass_gate(report.mesh, report.quality, o.gate);
  write_mesh(o.output, report.mesh);
  if (!o.report.empty()) write_text_atomically(o.report, json_of(report));
}

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) {
  palpate::Options options;
  return palpate::run_program(
      argc, argv, "palpate-tetrahedra",
      "Fills closed surfaces with tetrahedra that keep every triangle; writes MSH 4.1.",
      [&](CLI::App& app) { palpate::define(app, options); }, [&] { palpate::run(options); });
}
