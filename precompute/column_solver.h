// K x = b for blocks of columns: PETSc's conjugate gradients on K (x) I, each column's true residual measured.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "precompute/block_preconditioner.h"
#include "precompute/elastic_body.h"
#include "precompute/stiffness.h"

namespace palpate {

struct Elimination;

struct ColumnSolverOptions {
  double tolerance = 1e-9;  // on ||K x - b|| / ||b|| of every column
  int width = 96;           // columns at a time; rounded up to a multiple of 8
  bool cholesky = true;     // the default preconditioner, else algebraic multigrid; PETSc options override it
  int most_restarts = 12;   // on the true residual, before a column is given up
  std::shared_ptr<const Elimination> elimination = nullptr;  // of this matrix where the plan has it; else found again
};

struct ColumnReport {
  double residual = 0;  // true relative residual; 0 for a column of zeros
  int iterations = 0;   // of its block: 1 where the preconditioner alone solved it, else conjugate gradients
  double floor = 0;     // 0, or what double precision allows where that is above the tolerance
};

// One rank's solver, with its own copy of the operator. PETSc options without a prefix reach the conjugate gradients
// (-ksp_...), those with the prefix column_ the preconditioner of K (-column_pc_type, -column_mg_levels_...).
class ColumnSolver {
 public:
  // Sets up the preconditioner (factors). matrix must outlive the solver; coordinates: of each block row's node, m.
  // Errors: OperationError (memory, not positive definite); InputError for PETSc options that contradict one another.
  ColumnSolver(const BlockMatrix& matrix, std::span<const std::array<double, 3>> coordinates,
               const ColumnSolverOptions& options);
  ~ColumnSolver();
  ColumnSolver(const ColumnSolver&) = delete;
  ColumnSolver& operator=(const ColumnSolver&) = delete;

  int width() const;
  std::int64_t dofs() const;  // 3 * block rows

  // loads: b, dofs ascending; x: [dofs][width], overwritten; reports: [width]. The true residual of every column is
  // measured, and the iteration restarts on it until all hold the tolerance or, where corrections no longer halve the
  // residual, what double precision allows: epsilon ||K|| ||x|| / ||b||. Errors: NotConverged when one holds neither;
  // OperationError for PETSc's own.
  void solve(std::span<const Load> loads, double* x, std::span<ColumnReport> reports);

  // The same with b: [dofs][width].
  void solve(const double* b, double* x, std::span<ColumnReport> reports);

  // "PETSc 3.18.5 cg + cholesky (cholmod)".
  std::string description() const;

  // An upper bound of 1 / condition of K; 0 where the preconditioner tells none.
  double reciprocal_condition() const;

  // Place of each block row in the preconditioner's elimination order; empty where it has none. A block of columns whose
  // rows are close in it costs less.
  std::span<const std::int32_t> row_order() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// The worst column of a block that did not converge, for the caller to name.
struct NotConverged {
  int column;
  double residual;
  double floor;  // what double precision allows: epsilon * ||K|| ||x|| / ||b||
  std::string reason;
};

}  // namespace palpate
