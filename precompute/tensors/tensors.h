// Solves with unit forces -> the tensors of the paper, T^u and T^f, for one batch of touchable nodes at a time.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "precompute/elements/column_buffer.h"
#include "precompute/elements/discretisation.h"
#include "precompute/solver/column_solver.h"
#include "precompute/tensors/displacement_rows.h"

namespace palpate {

// C = P^T K^-1 P is the compliance (m/N); P holds the weights by which vertices are touched (the identity for linear
// elements). The paper imposes a displacement at node k by Lagrange multipliers (eq. 2). Removing the multipliers
// gives, exactly,
//   T^u_nk = C_nk C_kk^-1   the displacement of node n for a unit displacement of node k (no unit),
//   T^f_k = C_kk^-1         the force at node k for a unit displacement of node k: a stiffness, N/m.
// C_kk is inverted on the free dofs of k; rows and columns of its held dofs are zero. In the code T^f is called
// stiffness; the section of the bundle that stores it keeps its name, tensors/force.
class BatchTensors {
 public:
  // All three must outlive this object; discretisation.stiffness is not used.
  BatchTensors(ColumnSolver& solver, const Discretisation& discretisation, const HeldStiffness& held)
      : solver_(solver), discretisation_(discretisation), held_(held) {}

  // How many nodes one solve serves.
  static int nodes_per_solve(const ColumnSolver& solver) { return solver.width() / 3; }

  // Solves the columns of these vertices: at most nodes_per_solve, each with a free dof. The functions below give the
  // results, on the ranks where solver.has_result(). Errors: OperationError that names the worst column where one does
  // not converge.
  void solve(std::span<const std::int32_t> nodes);

  // T^f of the i-th node of the batch, row-major, symmetric; N/m.
  const std::array<double, 9>& stiffness(std::size_t i) const { return stiffness_[i]; }

  // C_nk of any node n and the i-th node k of the batch, row-major; m/N.
  std::array<double, 9> compliance(std::int32_t node, std::size_t i) const;

  // T^u of the nodes first .. first + count - 1, as out[3 * nodes of the batch][count][3]: row 3 i + j is their
  // displacement for a unit displacement of dof j of the i-th node. Exactly the identity at that node itself. Where
  // loss is given, adds the error of rounding to float. Value: float or double.
  template <class Value>
  void displacement(std::int32_t first, std::int32_t count, Value* out, CastLoss* loss = nullptr) const;

  // Of the column of dof j of the i-th node.
  ColumnReport report(std::size_t i, int j) const;

 private:
  std::vector<Load> loads() const;
  void read_vertices();

  ColumnSolver& solver_;
  const Discretisation& discretisation_;
  const HeldStiffness& held_;
  std::vector<std::int32_t> nodes_;
  std::vector<std::array<std::uint8_t, 3>> held_dofs_;
  ColumnBuffer x_;  // [dofs][width]; column 3 i + j is dof j of the i-th node
  // C as [3 rows][width], and the row of each vertex, -1 where it is held. Used for elements whose vertices are touched
  // through several nodes; for the others columns_ and row_of_vertex_ lead to x_ and held_.row_of_node.
  std::vector<double> read_;
  std::vector<std::int32_t> read_row_;
  const double* columns_ = nullptr;
  std::span<const std::int32_t> row_of_vertex_;
  std::vector<ColumnReport> reports_;
  std::vector<std::array<double, 9>> stiffness_;
};

}  // namespace palpate
