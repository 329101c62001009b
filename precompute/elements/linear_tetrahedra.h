// Linear tetrahedra: the paper's stiffness, and the one whose dilatation is averaged over nodes.
#pragma once

#include <array>
#include <vector>

#include "precompute/elements/elastic_body.h"
#include "precompute/elements/stiffness.h"

namespace palpate {

// Young's modulus and Poisson's ratio as the moduli of a volume and of a shear; Pa.
struct Moduli {
  double bulk = 0, shear = 0;
};
Moduli moduli_of(const Material& material);

// The 4 x 4 blocks of a linear tetrahedron, K_ab(i, j) = V (lambda g_a,i g_b,j + mu g_a,j g_b,i + mu delta_ij g_a.g_b),
// g the gradients of the shape functions, lambda = bulk - 2 shear / 3, mu = shear. points in m. Symmetric to the last
// bit.
using ElementStiffness = std::array<std::array<std::array<double, 9>, 4>, 4>;
ElementStiffness element_stiffness(const std::array<std::array<double, 3>, 4>& points, const Moduli& moduli);

// K over all nodes, nothing held: the sum over the tetrahedra in their order: same input, same bits.
BlockMatrix linear_stiffness(const ElasticBody& body);

// The same with the dilatation averaged over nodes, which keeps it from locking as nu -> 0.5 (average nodal pressure,
// Bonet and Burton 1998): K = K_dev + sum over nodes n and the regions m that meet there of
// kappa_m / V_nm D_nm^T D_nm, V_nm = sum V_e / 4 and D_nm = sum (V_e / 4) grad N over the elements of m at n. An average
// across regions of different kappa would be too soft. Couples nodes that have a neighbour in common: about four times
// the blocks. Symmetric to the last bit.
BlockMatrix nodal_dilatation_stiffness(const ElasticBody& body);

// A quarter of each tetrahedron's mass at each of its nodes; [N] kg.
std::vector<double> linear_mass(const ElasticBody& body);

}  // namespace palpate
