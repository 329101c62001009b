// A dense closed surface -> a surface with the wanted number of triangles, of even size or smaller where the surface
// bends.
#pragma once

#include <cstddef>

#include "meshing/surface/triangle_surface.h"

namespace palpate {

// Makes triangles with edges of about edge_mm and leaves edges with more than 30 degrees between the normals of their triangles where they
// are, with their corners. For shapes of few triangles, which remesh_evenly would round.
TriangleSurface remesh_between_edges(const TriangleSurface& surface, double edge_mm);

// Makes triangles of even size by isotropic remeshing (Botsch and Kobbelt 2004, CGAL's implementation) and projects
// the vertices onto the input. Searches the edge length until the number of triangles is within 0.5 % of the wanted
// one, in at most eight trials, and returns the nearest result. iterations: usually 3; more iterations make more
// regular triangles.
TriangleSurface remesh_evenly(const TriangleSurface& surface, std::size_t triangles, unsigned iterations);

// Collapses edges (Lindstrom and Turk 1998, CGAL's implementation) down to the wanted number of triangles, then calls
// improve_triangles. Refuses a collapse that turns a triangle over or leaves a triangle with a radius ratio below
// 0.5. If no other collapse is left, it lowers this bound. A surface of less than four times the wanted number is split
// first.
TriangleSurface simplify_by_curvature(const TriangleSurface& surface, std::size_t triangles);

// Returns the edge (mm) of equilateral triangles of which count cover the area.
double edge_for_count(double area_mm2, double count);
double triangles_for_edge(double area_mm2, double edge_mm);  // the other way round

}  // namespace palpate
