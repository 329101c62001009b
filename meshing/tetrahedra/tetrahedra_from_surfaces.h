// Closed surfaces -> tetrahedra that meet the quality gate, with the surfaces' own triangles where these allow it.
#pragma once

#include <string>
#include <vector>

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
};

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

// Fills the surfaces. When gmsh fails, when the gate is missed and a triangle has a radius ratio below 0.5, or when
// gate_obstacle finds that the gate must be missed, remeshes all surfaces evenly, says so in a warning and tries again, with up to three numbers of triangles between 2,000 and
// 20,000. A try takes at most 10 s of processor time, 1 ms more for each triangle, and 1 ms for each vertex that
// fill.size asks for; no remeshing begins after 20 s of processor time. keep_surface has fill.time_limit alone. Returns the first mesh that meets the gate, else the
// one with the largest smallest dihedral angle, without its quality measured. Errors: InputError for surfaces that touch one another and those of
// regions_of_shells; OperationError or VerificationError, with the file, the place and what to do, when no try gives a
// mesh.
MeshReport tetrahedra_from_surfaces(std::vector<ShellInput> inputs, const SurfaceFillOptions& options);

}  // namespace palpate
