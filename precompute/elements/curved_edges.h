// How far the middle of each surface edge lies from the smooth surface that the triangles stand for.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace palpate {

struct EdgeOffset {
  std::array<std::int32_t, 2> ends;  // ascending
  std::array<double, 3> offset;      // from the midpoint of the straight edge; m
};

// One entry per edge of the triangles, sorted by ends. The middle is that of the cubic through both ends at right angles
// to the vertex normals (PN triangles, Vlachos et al. 2001), normals weighted so that those of a sphere are exact (Max
// 1999). Edges between faces that turn by more than 45 degrees are sharp: they follow the curve of sharp edges, circles
// exactly to second order, and stay straight at its corners. triangles wind outwards.
std::vector<EdgeOffset> surface_edge_offsets(std::span<const std::array<double, 3>> nodes,
                                             std::span<const std::array<std::int32_t, 3>> triangles);

}  // namespace palpate
