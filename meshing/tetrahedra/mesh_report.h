// What palpate-tetrahedra says about the mesh it made, for people and for programs.
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
  double goal = 0;  // degrees, of the improvement
  Improvement improvement;
  std::size_t surface_triangles = 0, kept_triangles = 0;  // 0: the input was no surface
  std::vector<double> region_volume_of_surface;           // per region, or empty
  std::vector<double> region_volume_of_voxels;            // mm^3, likewise
};

// What each region's triangles enclose, by the divergence theorem.
std::vector<double> enclosed_volumes(const VolumeBoundary& boundary);

std::string text_of(const MeshReport& report);
std::string json_of(const MeshReport& report);

}  // namespace palpate
