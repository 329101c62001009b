// Unit-force solves -> the tensors of the paper, for a run of nodes at a time.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "precompute/elements/block.h"
#include "precompute/elements/discretisation.h"
#include "precompute/solver/column_solver.h"
#include "precompute/tensors/displacement_rows.h"

namespace palpate {

// Columns of C = P^T K^-1 P for a few vertices, P the functionals through which vertices are touched (the identity for
// linear elements), and what follows from them. Eliminating the constraint from the paper's Lagrange
// system (eq. 2) gives, exactly,
//   T^u_nk = C_nk C_kk^-1,   T^f_k = C_kk^-1,
// C_kk being inverted on the free dofs of k; its held dofs have zero rows and columns.
class TensorBlock {
 public:
  // All three must outlive the block; discretisation.stiffness is not used.
  TensorBlock(BlockSolver& solver, const Discretisation& discretisation, const HeldStiffness& held)
      : solver_(solver), discretisation_(discretisation), held_(held) {}

  // How many nodes one solve serves.
  static int nodes_per_solve(const BlockSolver& solver) { return solver.width() / 3; }

  // Solves for nodes, vertices of the body (at most nodes_per_solve, each with a free dof); what follows from it is to be
  // had where solver.has_result(). Errors: OperationError that names the worst column when one does not converge.
  void solve(std::span<const std::int32_t> nodes);

  // T^f of the i-th node, row-major, symmetric; N/m.
  const std::array<double, 9>& force(std::size_t i) const { return force_[i]; }

  // C_nk, row-major, of node n and the i-th node of the block; m/N.
  std::array<double, 9> compliance(std::int32_t node, std::size_t i) const;

  // Rows [i][j] of T^u for nodes first .. first + count - 1: out[3 * rows of the block][count][3]; identity at the node
  // itself. Value: float for the bundle, double for checks. What a cast to float takes from them is added to loss.
  template <class Value>
  void displacement(std::int32_t first, std::int32_t count, Value* out, CastLoss* loss = nullptr) const;

  // Of dof j of the i-th node.
  ColumnReport report(std::size_t i, int j) const;

 private:
  std::vector<Load> loads() const;
  void read_vertices();

  BlockSolver& solver_;
  const Discretisation& discretisation_;
  const HeldStiffness& held_;
  std::vector<std::int32_t> nodes_;
  std::vector<std::array<std::uint8_t, 3>> held_dofs_;
  Block x_;  // [dofs][width]; column 3 i + j is dof j of the i-th node
  // C, [3 rows][width], and the row of each vertex, -1 where it is held. x_ and the held stiffness's own unless vertices
  // are touched through functionals.
  std::vector<double> read_;
  std::vector<std::int32_t> read_row_;
  const double* columns_ = nullptr;
  std::span<const std::int32_t> row_of_vertex_;
  std::vector<ColumnReport> reports_;
  std::vector<std::array<double, 9>> force_;
};

}  // namespace palpate
