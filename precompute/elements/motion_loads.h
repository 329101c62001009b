// The motions of a body -> loads on the nodes, and what they impose on held dofs.
#pragma once

#include <vector>

#include "precompute/elements/discretisation.h"

namespace palpate {

// Per unit of the motion, over all nodes of the discretisation, [3 nodes] each.
struct MotionLoad {
  std::vector<double> force;    // N, g of K_ff u = g; zero on held dofs
  std::vector<double> imposed;  // m, of held dofs; empty: they stay
  std::vector<double> sweep;    // m^2, of a pressure: sweep . u is the volume that its surface sweeps; else empty
};

// Supports that move as U: g = -(K U_held)_f + (K_base U)_f, K_base that of foundations and springs to the world. A pressure p on the
// outward normal n: g = -int(N n) dA, which is its sweep. Gravity: the nodes' masses. discretisation: with its stiffness. One for each
// of body.motions.
std::vector<MotionLoad> motion_loads(const ElasticBody& body, const Discretisation& discretisation);

}  // namespace palpate
