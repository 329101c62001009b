// The tensors of a few nodes, solved by one process without writing a bundle: for `palpate-bundle verify` and for
// tests.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "precompute/elements/discretisation.h"

namespace palpate {

struct NodeTensor {
  std::int32_t node;
  std::array<double, 9> stiffness;   // T^f, row-major, N/m
  std::vector<double> displacement;  // T^u, [3][N][3]: row j is the displacement of all vertices for a unit of dof j
  double residual;                   // largest true relative residual of its columns
};

// What a bundle must hold for these nodes; they need not be in body.touchable. A PetscSession must be alive. Errors:
// InputError for a node without a free dof; OperationError.
std::vector<NodeTensor> solve_node_tensors(const ElasticBody& body, Element element,
                                           std::span<const std::int32_t> nodes, double tolerance = 1e-9);

}  // namespace palpate
