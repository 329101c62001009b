// The element p1-ang: which share of the shear follows the gradient averaged at the nodes, for the precomputation and for the runtime.
#pragma once

namespace palpate::formats {

// The rest follows the gradient of each tetrahedron. With all of it averaged the element is too soft, and some motions have hardly any
// stiffness; with none it is p1-anp. How it was chosen: precompute/ELEMENTS.md.
constexpr double kAveragedShear = 0.85;

}  // namespace palpate::formats
