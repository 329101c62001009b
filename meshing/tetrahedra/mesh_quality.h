// How good the tetrahedra are, and the gate that a mesh passes before it is written.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "formats/tetrahedral_mesh.h"

namespace palpate {

struct ElementShape {
  double volume;                               // signed
  double smallest_dihedral, largest_dihedral;  // degrees; 0 and 180 unless the volume is positive
  double radius_ratio;                         // 3 r_in / r_circ: 1 for the regular tetrahedron, 0 for a flat one
};

ElementShape shape_of(const TetrahedralMesh& mesh, std::size_t element);

struct MeshQuality {
  struct Worst {
    double value = 0;
    std::size_t tetrahedron = 0;
  };
  Worst volume;    // smallest signed volume, mesh unit cubed
  Worst dihedral;  // smallest dihedral angle, degrees
  Worst largest_dihedral;
  Worst radius_ratio;                 // smallest 3 r_in / r_circ: 1 for the regular tetrahedron, 0 for a flat one
  double mean_smallest_dihedral = 0;  // of each element's smallest
  double mean_radius_ratio = 0;
  std::vector<double> region_volume;
};

// One pass over the elements. An inverted or flat element has radius ratio <= 0 and dihedral 0. Errors: none.
MeshQuality measure_quality(const TetrahedralMesh& mesh);

struct QualityGate {
  double min_dihedral = 0;  // degrees
  double min_radius_ratio = 0;
};

// Errors: VerificationError that names the worst element: its index, region, centroid, value, the limit and what to do.
void pass_gate(const TetrahedralMesh& mesh, const MeshQuality& quality, const QualityGate& gate);

}  // namespace palpate
