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

struct MeshReport {
  std::vector<std::string> inputs;
  TetrahedralMesh mesh;
  MeshQuality quality;
  double goal = 0;  // degrees; the goal of the improvement
  Improvement improvement;
  std::size_t surface_triangles = 0, kept_triangles = 0;  // 0 if the input was not a surface
  bool remeshed = false;                                  // the triangles are not the input's own
  std::vector<double> region_volume_of_surface;           // [regions] or empty
  std::vector<double> region_volume_of_voxels;            // [regions] or empty, mm^3
};

// Returns the volume that the triangles of each region enclose, by the divergence theorem.
std::vector<double> enclosed_volumes(const VolumeBoundary& boundary);

std::string text_of(const MeshReport& report);
std::string json_of(const MeshReport& report);

}  // namespace palpate
