// The report of palpate-tetrahedra on its mesh, as text and as JSON.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "formats/tetrahedral_mesh.h"
#include "meshing/tetrahedra/mesh_quality.h"
#include "meshing/tetrahedra/relocate_vertices.h"
#include "meshing/tetrahedra/volume_boundary.h"

namespace palpate {

// What became of a tissue's volume on its way from the image, mm^3.
struct TissueVolume {
  double voxels = 0;    // as segmented
  double smoothed = 0;  // after the borders were smoothed
  double meshed = 0;    // of the triangles that Mesh_3 made, before they were moved to the voxels' volume
  double moved_mm = 0;  // outward, where the tissue has no neighbour
  double edge = 0;      // mm, longest edge wanted of its triangles
};

struct MeshReport {
  std::vector<std::string> inputs;
  TetrahedralMesh mesh;
  MeshQuality quality;
  double goal = 0;  // degrees; the goal of the improvement
  Improvement improvement;
  std::size_t surface_triangles = 0, kept_triangles = 0;  // 0 if the input was not a surface
  bool remeshed = false;                                  // the triangles are not the input's own
  std::string tried = {};                                 // what else was tried in vain, if the gate is missed
  std::vector<double> region_volume_of_surface;           // [regions] or empty
  std::vector<TissueVolume> tissue_volumes;               // [regions] of a label image, or empty
};

// Returns the volume that the triangles of each region enclose, by the divergence theorem.
std::vector<double> enclosed_volumes(const VolumeBoundary& boundary);

std::string text_of(const MeshReport& report);
std::string json_of(const MeshReport& report);

}  // namespace palpate
