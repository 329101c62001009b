// The compliance columns of the nodes in the corridors, and the compliance of a cut's region: how the body moves where a force acts on a node
// inside it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "precompute/elements/discretisation.h"
#include "precompute/solver/column_solver.h"

namespace palpate {

// Row [k, j] is the displacement, m/N, for a unit force on dof j of corridor node k. It is zero on held dofs, and the row of a
// held dof is zero throughout.
struct SolvedCorridor {
  std::vector<float> compliance;  // [K][3][K][3] of the corridor nodes; symmetric to the bit
  std::vector<float> surface;     // [K][3][Ns][3] of the surface nodes
  std::vector<float> interior;    // [K][3][N-Ns][3] of the others, at corridor nodes those of compliance; may be empty
  std::vector<double> residual;   // [K][3] true relative residual of K x = e; 0 of a held dof
  std::vector<double> cut_compliance;  // [pairs of the cut's nodes][3][3]: the section cut/compliance
  std::vector<double> cut_residual;    // [C][3]
  double floor = 0;                    // 0, or what double precision allows where a column misses the tolerance
};

struct CorridorRequest {
  std::span<const std::int32_t> nodes;     // ascending, each >= surface_nodes
  std::int32_t surface_nodes = 0;          // Ns
  bool interior = false;                   // whether to keep the rows of the interior
  std::span<const std::int32_t> cut = {};  // nodes of the cut's region, ascending
};

// Solves 3 columns for each node of the two lists, in the solver's batches; collective where the solver is. The result is on the ranks where
// solver.has_result(), and empty on the others. Cost: as many solves as for as many touchable nodes; 36 K (Ns + K) bytes, with
// the interior 36 K (N + K), and 72 K^2 until it returns; 36 C (C + 1) for the cut's region. Errors: OperationError where a solve does not converge.
SolvedCorridor solve_corridor(const Discretisation& discretisation, const HeldStiffness& held,
                              const CorridorRequest& request, ColumnSolver& solver);

// What the result takes, of K nodes of which rows of `stored` nodes are kept; bytes.
double corridor_bytes(std::size_t corridor_nodes, std::size_t stored);
double cut_bytes(std::size_t cut_nodes);

}  // namespace palpate
