// How long an organ is. Outside these limits a unit is wrong, most often mesh_unit.
#pragma once

namespace palpate {

inline constexpr double kSmallestOrgan = 0.01, kLargestOrgan = 1;  // m, the longest side of the box along the axes

}  // namespace palpate
