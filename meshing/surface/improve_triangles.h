// Improves the shape of triangles without changing their number: flips edges and moves vertices along the surface.
#pragma once

#include "meshing/surface/triangle_surface.h"

namespace palpate {

// Flips the edges and moves the vertices of triangles whose radius ratio is below good_ratio. Keeps a change only if
// the sum of 1 / radius_ratio over the changed triangles becomes smaller, so the worst triangle counts most. Better
// triangles stay as they are: triangles along a bend may stay stretched, because stretched triangles follow a bend
// well. The radius ratio does not depend on size, so small triangles stay small. A vertex moves towards the mean of
// the positions that would make its triangles equilateral, weighted by how bad each triangle is (as in GETMe,
// Vartziotis et al. 2008). The vertex keeps its distance from onto, the dense surface that the triangles approximate.
// No triangle turns by more than 40 degrees in a step. surface, onto: closed oriented manifolds, mm. Cost: a few
// nearest-point queries per vertex and pass.
void improve_triangles(TriangleSurface& surface, const TriangleSurface& onto, double good_ratio, int passes);

}  // namespace palpate
