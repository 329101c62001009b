// K x = b for blocks of columns: PETSc's conjugate gradients on K (x) I, each column's true residual measured.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "precompute/elements/elastic_body.h"
#include "precompute/elements/stiffness.h"
#include "precompute/solver/block_preconditioner.h"

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

// What solves blocks of columns: one rank with its own copy of the operator (ColumnSolver), or the ranks of a group that
// divide it among them (DistributedSolver), every call then being collective over the group.
class BlockSolver {
 public:
  virtual ~BlockSolver() = default;

  virtual int width() const = 0;          // columns at a time
  virtual std::int64_t dofs() const = 0;  // 3 * block rows

  // loads: b, dofs ascending; x: [dofs][width], overwritten; reports: [width]. The true residual of every column is
  // measured, and the iteration restarts on it until all hold the tolerance or, where corrections no longer halve the
  // residual, what double precision allows: epsilon ||K|| ||x|| / ||b||. Errors: NotConverged when one holds neither;
  // OperationError for PETSc's own.
  virtual void solve(std::span<const Load> loads, double* x, std::span<ColumnReport> reports) = 0;

  // Whether x is written here: on one rank of a group.
  virtual bool has_result() const { return true; }

  // "PETSc 3.18.5 cg + cholesky (cholmod)".
  virtual std::string description() const = 0;

  // Place of each block row in the preconditioner's elimination order; empty where it has none. A block of columns whose
  // rows are close in it costs less.
  virtual std::span<const std::int32_t> row_order() const { return {}; }

  // An upper bound of 1 / condition of K; 0 where the preconditioner tells none.
  virtual double reciprocal_condition() const { return 0; }
};

// One rank's solver, with its own copy of the operator. PETSc options without a prefix reach the conjugate gradients
// (-ksp_...), those with the prefix column_ the preconditioner of K (-column_pc_type, -column_mg_levels_...).
class ColumnSolver final : public BlockSolver {
 public:
  // Sets up the preconditioner (factors). matrix must outlive the solver; coordinates: of each block row's node, m.
  // Errors: OperationError (memory, not positive definite); InputError for PETSc options that contradict one another.
  ColumnSolver(const BlockMatrix& matrix, std::span<const std::array<double, 3>> coordinates,
               const ColumnSolverOptions& options);
  ~ColumnSolver() override;
  ColumnSolver(const ColumnSolver&) = delete;
  ColumnSolver& operator=(const ColumnSolver&) = delete;

  int width() const override;
  std::int64_t dofs() const override;
  void solve(std::span<const Load> loads, double* x, std::span<ColumnReport> reports) override;
  std::string description() const override;
  std::span<const std::int32_t> row_order() const override;
  double reciprocal_condition() const override;

  // The same with b: [dofs][width].
  void solve(const double* b, double* x, std::span<ColumnReport> reports);

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
