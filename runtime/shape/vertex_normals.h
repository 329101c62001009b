// Normals of a surface's vertices: the mean of the normals of the triangles around each vertex, weighted by their angles there.
// Source: Thuermer and Wuethrich 1998, Computing vertex normals from polygonal facets: that mean does not depend on how the surface is
// cut into triangles.
#pragma once

#include <cstdint>

namespace palpate {

// positions: [nodes][3] m; triangles: [triangle_count][3], checked; active: [triangle_count], 0: the triangle does not count; nullptr: all do;
// normals: [nodes][3], filled: of unit length, or zero where a vertex has none. A triangle with a corner that is not finite does not count. Returns false where there was one.
bool find_vertex_normals(const float* positions, std::int32_t nodes, const std::int32_t* triangles,
                         std::int32_t triangle_count, const std::uint8_t* active, float* normals);

}  // namespace palpate
