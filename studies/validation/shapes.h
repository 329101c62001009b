// Meshes of the bodies in the validation cases. The tests use them too.
#pragma once

#include "formats/tetrahedral_mesh.h"

namespace palpate::validation {

// One octant of the shell a <= r <= b: an n-fold triangulation of the octant, extruded in layers of prisms (0: n) whose
// thickness grows with the radius.
TetrahedralMesh shell_octant(double a, double b, int n, int layers = 0);

// A disc made of rings of triangles, extruded along z in layers of prisms; each prism is three tetrahedra.
TetrahedralMesh cylinder_mesh(double radius, double height, int rings, int layers);

// A quarter of a cylinder, x and y at least 0, its base at z = 0: n cells along the radius, layers along the height.
TetrahedralMesh quarter_cylinder(double radius, double height, int n, int layers);

// A quarter of a cylinder about an indenter of radius a at its top z = 0, 5 a wide and deep, the material at z > 0: 3 n cells
// along each radius, n of them under the indenter, and 2 n in depth.
enum class TowardsEdge {
  even,    // cells of a / n about the indenter's edge, growing away from it
  squared  // cells shrink to a / n^2 at the edge: their size is proportional to the root of the distance from it
};
TetrahedralMesh indented_quarter(double a, int n, TowardsEdge cells);

// A quarter of NAFEMS' thick elliptic plate LE10, m: n cells through the thickness of 0.6 (even), 2 n across, 3 n around.
TetrahedralMesh elliptic_plate(int n);
inline constexpr double kPlateThickness = 0.6;

// Cook's membrane, m: the trapezoid (0, 0), (48, 44), (48, 60), (0, 44) mm, 1 mm thick: n x n cells, one through the thickness.
TetrahedralMesh cook_membrane(int n);

}  // namespace palpate::validation
