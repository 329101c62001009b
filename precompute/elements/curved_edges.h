// Where the middle of each surface edge would lie on the smooth surface that the triangles approximate.
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

// One entry for each edge of the triangles, sorted by ends. An edge is replaced by the cubic curve through its ends
// that is at right angles to the normals there (PN triangles; Vlachos et al. 2001); the offset leads to the middle of
// that curve. The normals are weighted so that those of a sphere are exact (Max 1999). An edge whose two faces turn by
// more than 45 degrees is sharp: its curve follows the line of sharp edges (circles to second order) and stays straight
// at corners of that line. triangles must wind outwards.
std::vector<EdgeOffset> surface_edge_offsets(std::span<const std::array<double, 3>> nodes,
                                             std::span<const std::array<std::int32_t, 3>> triangles);

}  // namespace palpate
