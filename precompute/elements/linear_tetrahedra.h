// The stiffness of linear tetrahedra: p1, the element of the paper, and p1-anp, whose dilatation is averaged over
// nodes. The dilatation is the divergence of the displacement, that is, the relative change of volume.
#pragma once

#include <array>
#include <vector>

#include "precompute/elements/elastic_body.h"
#include "precompute/elements/stiffness.h"

namespace palpate {

// The bulk and shear moduli that follow from Young's modulus and Poisson's ratio; Pa.
struct Moduli {
  double bulk = 0, shear = 0;
};
Moduli moduli_of(const Material& material);

// The 4 x 4 blocks of one linear tetrahedron: K_ab(i, j) = V (lambda g_a,i g_b,j + mu g_a,j g_b,i + mu delta_ij
// g_a.g_b), where V is the volume, g_a the gradient of the shape function of corner a, lambda = bulk - 2 shear / 3 and
// mu = shear. points in m. Symmetric to the last bit.
using ElementStiffness = std::array<std::array<std::array<double, 9>, 4>, 4>;
ElementStiffness element_stiffness(const std::array<std::array<double, 3>, 4>& points, const Moduli& moduli);

// K over all nodes, nothing held. The tetrahedra are added in their order, so that the same input gives the same bits.
BlockMatrix linear_stiffness(const ElasticBody& body);

// The same for p1-anp: the dilatation is averaged over the tetrahedra around each node, which prevents locking as nu ->
// 0.5 (average nodal pressure; Bonet and Burton 1998). K = K_dev + sum over all nodes n and the regions m that meet at
// n of kappa_m / V_nm D_nm^T D_nm, where V_nm = sum V_e / 4 and D_nm = sum (V_e / 4) grad N over the tetrahedra e of
// region m at n, and K_dev is the part of K without the bulk modulus. Each region is averaged on its own, because an
// average over regions of different bulk moduli would be too soft. K couples nodes that have a neighbour in common and
// so has about four times the blocks of p1. Symmetric to the last bit.
//
// averaged_shear: the share of the shear that follows the gradient averaged at the nodes as well, 0 for p1-anp. For p1-ang, s:
//     K = (1 - s) K_dev + sum over n and m of (kappa_m D D^T and 2 s mu_m times its deviatoric part) / V_nm
// The deviatoric part has the blocks of a tetrahedron with gradients D / V_nm. It couples no other nodes.
BlockMatrix nodal_dilatation_stiffness(const ElasticBody& body, double averaged_shear = 0);

// The terms kappa / V D^T D of nodal_dilatation_stiffness(): one for each node and each region that meets there, in the order of
// the nodes.
struct Dilatations {
  Lists nodes;                                // of each term: the nodes it couples, ascending
  std::vector<std::array<double, 3>> factor;  // sqrt(kappa / V) D at each of them, N^(1/2) m^(-1/2)
  std::vector<std::int32_t> centre;           // of each term: the node around which it averages
  std::vector<double> shear;  // of each term: averaged shear modulus over kappa; empty where none is averaged
};
Dilatations nodal_dilatations(const ElasticBody& body, double averaged_shear = 0);

// factor_a factor_b^T to block (a, b), for each term and each pair (a, b) of its nodes, and its shear. The matrix must have these blocks.
void add_dilatations(const Dilatations& terms, BlockMatrix& matrix);

// share K_dev, the part of K without the bulk modulus: its blocks are added to the matrix, which must have them.
void add_deviatoric_stiffness(const ElasticBody& body, BlockMatrix& matrix, double share = 1);

// The mass of each node: a quarter of the mass of each tetrahedron around it; [N] kg.
std::vector<double> linear_mass(const ElasticBody& body);

}  // namespace palpate
