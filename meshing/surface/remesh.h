// A dense closed surface -> one with as many triangles as wanted, evenly spread or denser where it bends.
#pragma once

#include <cstddef>

#include "meshing/surface/triangle_surface.h"

namespace palpate {

// Isotropic remeshing (Botsch and Kobbelt 2004, as in CGAL), vertices projected onto the input; the edge length is
// searched until the count is within 0.5 % or eight trials are over, and the nearest is returned. iterations: 3 is
// usual, more regularises further.
TriangleSurface remesh_evenly(const TriangleSurface& surface, std::size_t triangles, unsigned iterations);

// Edge collapse (Lindstrom and Turk 1998, as in CGAL) down to the count, refusing collapses that turn a triangle over
// or leave one with a radius ratio below 0.5, or lower where nothing else is left; then improve_triangles. A surface
// that has no more than the count keeps its triangles' number.
TriangleSurface simplify_by_curvature(const TriangleSurface& surface, std::size_t triangles);

// The edge of equilateral triangles when count of them cover the area, mm.
double edge_for_count(double area_mm2, double count);

}  // namespace palpate
