// palpate-cut: cuts a mesh of tetrahedra along the path of a blade.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <string>

#include "formats/atomic_file.h"
#include "formats/command_line.h"
#include "formats/errors.h"
#include "formats/make_rule.h"
#include "formats/program.h"
#include "formats/tetrahedral_mesh.h"
#include "meshing/cut/cut_by_blade.h"
#include "meshing/tetrahedra/mesh_quality.h"

namespace palpate {
namespace {

constexpr double kNothing = 1e-9;  // what rounding leaves of a distance, in the mesh's unit

struct Options {
  std::string mesh, blade, output;
  bool largest_piece = false;
  double min_dihedral = 10;
  MakeRule rule;
};

void define(CLI::App& app, Options& o) {
  app.add_option("MESH", o.mesh, "The mesh of the organ at rest, MSH")->required();
  app.add_option("--blade", o.blade,
                 "CSV file, in the unit of the mesh: a row for each place of the blade's edge, x, y, z of its two "
                 "points or more")
      ->required();
  app.add_option("-o,--output", o.output, "The mesh with the cut, MSH 4.1")->required();
  app.add_flag("--largest-piece", o.largest_piece, "Leave out pieces that are cut off");
  app.add_option("--min-dihedral", o.min_dihedral,
                 "Move nodes onto the path while dihedral angles stay above this, degrees")
      ->check(CLI::Range(0.0, 70.0))
      ->capture_default_str();
  define_make_rule(app, o.rule);
}

void run(Options& o) {
  { const AtomicFile probe(o.output); }
  TetrahedralMesh mesh = read_mesh(o.mesh);
  const BladePath path = read_blade_path(o.blade);
  CutReport report;
  try {
    report = cut_by_blade(mesh, path, o.largest_piece, o.min_dihedral);
  } catch (const InputError& wrong) {
    throw InputError(fmt::format("{} along {}: {}", o.mesh, o.blade, wrong.what()));
  }
  const MeshQuality quality = measure_quality(mesh);
  fmt::print("{:<18}{} faces, area {:.4g}, patch \"cut\"\n", "cut", report.faces, report.area);
  fmt::print("{:<18}{}, of them {} doubled; {} moved onto the path\n", "vertices", mesh.nodes.size(), report.new_nodes,
             report.moved_nodes);
  const auto rounded = [](double distance) { return distance < kNothing ? 0 : distance; };
  fmt::print("{:<18}mean {:.3g}, worst {:.3g} from the path\n", "lips", rounded(report.mean_distance),
             rounded(report.worst_distance));
  fmt::print("{:<18}min {:.2f} degrees\n", "dihedral angle", quality.dihedral.value);
  fmt::print("{:<18}{}: {} tetrahedra\n", "pieces", report.pieces.size(), fmt::join(report.pieces, ", "));
  if (report.pieces.size() > 1 && !o.largest_piece)
    warn(
        fmt::format("{}: the cut leaves {} pieces; each needs supports of its own in the boundary file, or leave out "
                    "all but the largest one: "
                    "--largest-piece",
                    o.output, report.pieces.size()));
  write_mesh(o.output, mesh);
  write_make_rule(o.rule);
}

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) {
  palpate::Options options;
  return palpate::run_program(
      argc, argv, "palpate-cut",
      "A mesh of tetrahedra and the path of a blade -> the mesh with a cut, whose lips may move apart",
      [&](CLI::App& app) { palpate::define(app, options); }, [&] { palpate::run(options); });
}
