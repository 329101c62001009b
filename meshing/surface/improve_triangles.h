// Better triangles of the same number: edges flipped, vertices moved along the surface.
#pragma once

#include "meshing/surface/triangle_surface.h"

namespace palpate {

// Where a triangle's radius ratio is below good_ratio, flips its edges and moves its vertices if that lowers the sum of
// 1 / radius_ratio over the triangles touched, so the worst count most. What is good already stays as it is, and with
// it the stretch that a bend in one direction gives triangles; the measure has no size in it, so small triangles stay
// small. A vertex moves towards the mean of the places that would make its triangles equilateral (as in GETMe,
// Vartziotis et al. 2008), weighted by how bad each is, and keeps its offset from onto, the dense surface this one
// stands for. No triangle turns by more than 40 degrees in a step. surface, onto: closed oriented manifolds, mm. Cost:
// a few nearest-point queries per vertex and pass.
void improve_triangles(TriangleSurface& surface, const TriangleSurface& onto, double good_ratio, int passes);

}  // namespace palpate
