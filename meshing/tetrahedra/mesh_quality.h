// Measures the quality of a tetrahedral mesh. A mesh is only written when it passes the limits in QualityGate.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "formats/tetrahedral_mesh.h"

namespace palpate {

struct ElementShape {
  double volume;                               // signed
  double smallest_dihedral, largest_dihedral;  // degrees; 0 and 180 if the volume is not positive
  double radius_ratio;                         // 3 r_in / r_circ: 1 for the regular tetrahedron, 0 for a flat one
};

ElementShape shape_of(const TetrahedralMesh& mesh, std::size_t element);

struct MeshQuality {
  struct Worst {
    double value = 0;
    std::size_t tetrahedron = 0;
  };
  Worst volume;    // smallest signed volume, in the cube of the mesh's unit
  Worst dihedral;  // smallest dihedral angle, degrees
  Worst largest_dihedral;
  Worst radius_ratio;                 // smallest 3 r_in / r_circ: 1 for the regular tetrahedron, 0 for a flat one
  double mean_smallest_dihedral = 0;  // mean over the elements of their smallest dihedral angle, degrees
  double mean_radius_ratio = 0;
  std::vector<double> region_volume;
};

// Measures all elements in one pass. An inverted or flat element has a radius ratio of at most 0 and a dihedral angle
// of 0.
MeshQuality measure_quality(const TetrahedralMesh& mesh);

struct QualityGate {
  double min_dihedral = 0;  // degrees
  double min_radius_ratio = 0;
};

// Compares the worst elements with the limits. cure: what may give a better mesh. Errors: VerificationError that names the
// worst element, its index, region, centroid and value, the limit, the cure, and the limits that this mesh would meet.
void pass_gate(const TetrahedralMesh& mesh, const MeshQuality& quality, const QualityGate& gate,
               const std::string& cure = "more triangles there or another --size may give a better mesh");

}  // namespace palpate
