// How near a tetrahedron comes to a segment.
#pragma once

#include <array>

namespace palpate {

using Corners = std::array<std::array<double, 3>, 4>;

// The distance between the segment from - to and the whole tetrahedron, in the unit of the points; 0 where the segment passes
// through it, also through a corner or an edge alone. from may be to. A tetrahedron that is nearer than 1e-12 of the largest
// coordinate may count as passed through. Cost: about a microsecond.
double segment_distance(const Corners& corners, const std::array<double, 3>& from, const std::array<double, 3>& to);

// The distance between the segment from - to and a point.
double segment_distance(const std::array<double, 3>& point, const std::array<double, 3>& from,
                        const std::array<double, 3>& to);

}  // namespace palpate
