// K X = B for batches of columns, solved by PETSc's conjugate gradients (CG); the true residual of every column is measured.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "precompute/elements/elastic_body.h"
#include "precompute/elements/pressure_form.h"
#include "precompute/elements/stiffness.h"
#include "precompute/solver/batch_preconditioner.h"

namespace palpate {

class ColumnOperator;
class MachineMemory;
struct Elimination;

struct ColumnSolverOptions {
  double tolerance = 1e-9;  // on ||K x - b|| / ||b|| of every column
  int width = 96;           // columns in a batch; rounded up to a multiple of 8
  bool cholesky = true;     // the default preconditioner: a factor, else multigrid; -column_pc_type overrides it
  bool single = false;      // the factor in single precision
  int most_restarts = 12;   // of CG on the true residual, before a column is given up
  std::shared_ptr<const PressureForm> form =
      nullptr;  // of the matrix: the factor is this form's; null: the matrix's own. The solver lets go of it when it is set up
  std::shared_ptr<const Elimination> elimination = nullptr;  // of what is factored; null: the solver analyses it
  std::vector<std::int32_t> node_of_row = {};  // in the mesh, of each block row, so that errors name it; may be empty
  std::shared_ptr<MachineMemory> machine =
      nullptr;  // its ranks hold one factor, see SupernodalFactorOf; null: each has its own
};

struct ColumnReport {
  double residual = 0;  // true relative residual; 0 for a column of zeros
  int iterations = 0;   // of CG on the column's batch; 0 where the initial guess already met the tolerance
  double floor = 0;     // 0, or what double precision allows where that is above the tolerance
};

// One KSP (PETSc's Krylov solver, KSPCG) on the operator K (x) I_width; its preconditioner is one of the PC types of
// batch_pc.h. PETSc options without a prefix reach the KSP (-ksp_monitor, -ksp_view, -ksp_converged_reason), those with
// the prefix column_ the preconditioner (-column_pc_type, -column_mg_levels_...).
//
// With a factor as the preconditioner, CG starts from the initial guess x = M^-1 b (PETSc's -ksp_knoll),
// and otherwise from zero. The convergence test looks at every column; a column that meets the tolerance in its true
// residual is not changed any more, so that its bytes do not depend on the other columns of the batch. When CG stops, the
// KSP is called again on its result: either the true residuals of all columns then meet the tolerance before the first
// iteration, or CG goes on from there.
class ColumnSolver {
 public:
  // All of K on this rank. Sets up the preconditioner (factors). matrix must outlive the solver; coordinates: of each block
  // row's node, m. Errors: OperationError (memory, not positive definite); InputError for PETSc options that contradict one
  // another.
  ColumnSolver(const BlockMatrix& matrix, std::span<const std::array<double, 3>> coordinates,
               const ColumnSolverOptions& options);
  // The same for another operator, which has its own width; every call is then collective over its communicator.
  ColumnSolver(std::unique_ptr<ColumnOperator> op, const ColumnSolverOptions& options);
  ~ColumnSolver();
  ColumnSolver(const ColumnSolver&) = delete;
  ColumnSolver& operator=(const ColumnSolver&) = delete;

  int width() const;          // columns in a batch
  std::int64_t dofs() const;  // 3 * block rows

  // loads: b, dofs ascending, each dof and column at most once, the same on every rank; x: [dofs][width], overwritten;
  // reports: [width]. Where another run of CG no longer halves the residual of a column, the column is accepted if its residual
  // is as small as double precision allows: epsilon ||K|| ||x|| / ||b||. Errors: NotConverged where a column meets neither the
  // tolerance nor this floor; OperationError for errors of PETSc.
  void solve(std::span<const Load> loads, double* x, std::span<ColumnReport> reports);
  // The same with b: [dofs][width].
  void solve(const double* b, double* x, std::span<ColumnReport> reports);

  // Whether this rank gets x and must pass room for it; the reports come on every rank.
  bool has_result() const;

  // For the provenance: "PETSc 3.18.5 cg + supernodal (quasi-definite factor)".
  std::string description() const;

  // Position of each block row in the preconditioner's elimination order; empty where it has none.
  std::span<const std::int32_t> row_order() const;

  // About 1 / condition of K, as BatchPreconditioner says; 0 where the preconditioner states none.
  double reciprocal_condition() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// The worst column of a batch that did not converge, for the caller to name.
struct NotConverged {
  int column;
  double residual;
  double floor;  // what double precision allows: epsilon * ||K|| ||x|| / ||b||
  std::string reason;
};

}  // namespace palpate
