// Closed surfaces -> tetrahedra that meet the quality gate, with the surfaces' own triangles where these allow it.
#pragma once

#include <string>
#include <vector>

#include "meshing/surface/surface_report.h"
#include "meshing/tetrahedra/fill_with_tetrahedra.h"
#include "meshing/tetrahedra/mesh_quality.h"
#include "meshing/tetrahedra/mesh_report.h"
#include "meshing/tetrahedra/shells.h"

namespace palpate {

struct SurfaceFillOptions {
  bool nested_regions = false;     // see regions_of_shells
  std::vector<std::string> names;  // of the regions, in order; empty: those of the files
  bool keep_surface = false;       // forbids remeshing
  QualityGate gate;
  FillOptions fill;
  double processor_limit = 0;  // seconds of processor time for everything; 0: default_processor_limit
  double processor_used = 0;   // seconds of it that reading and repairing the surfaces took
};

// Seconds of processor time: 20, or 0.2 ms for each triangle of the inputs and 0.5 ms for each vertex that size asks for where that
// is more (100,000 triangles; 40,000 vertices). size as in FillOptions.
double default_processor_limit(const std::vector<ShellInput>& inputs, double size);

// The input with the worst triangle.
struct WorstInput {
  WorstTriangle triangle;
  std::string file;
};
WorstInput worst_input(const std::vector<ShellInput>& inputs);

// A place of a surface and why no tetrahedra that keep its triangles can meet the gate there. found is empty where
// nothing forbids it.
struct GateObstacle {
  std::string found;
  Point place{};
};

// Looks for two exact obstacles. A tetrahedron's radius ratio is less than 1.5 times that of each of its faces, because
// its inscribed sphere is smaller than the face's inscribed circle and its circumscribed sphere larger than the face's
// circumscribed circle. The elements at an edge share the surface's inner angle there, so none has a larger one.
GateObstacle gate_obstacle(const TriangleSurface& surface, const QualityGate& gate);

// Fills the surfaces. When gmsh fails, when the gate is missed, or when gate_obstacle finds that the gate must be missed,
// remeshes surfaces whose edges are much longer than options.fill.size with edges of that size, between their sharp edges, which
// stay, and tries again. Then it remeshes all surfaces evenly, says so in a warning and tries again, with up to four numbers of triangles between 2,000 and 40,000: more where the gate is
// missed, by the missed angle, and fewer where remeshing takes too long. Where options.fill.size
// asks for shorter edges than 2,000 triangles have, begins with as many as have such edges. keep_surface forbids this. Returns the
// first mesh that meets the gate, else the one with the largest smallest dihedral angle, without its quality measured. Cost:
// the generators of triangles and tetrahedra run in child processes and end within processor_limit. Errors: InputError for
// surfaces that touch one another and those of regions_of_shells; OperationError, with the file, the place and what to do,
// when no try gives a mesh.
MeshReport tetrahedra_from_surfaces(std::vector<ShellInput> inputs, const SurfaceFillOptions& options);

}  // namespace palpate
