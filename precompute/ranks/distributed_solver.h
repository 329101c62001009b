// K x = b for blocks of columns where K is divided among the ranks of a group: none of them holds all of it.
#pragma once

#include <mpi.h>

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "precompute/ranks/row_partition.h"
#include "precompute/solver/block_preconditioner.h"
#include "precompute/solver/column_solver.h"

namespace palpate {

// PETSc's conjugate gradients on K (x) I over MPIAIJ of block size 3. Preconditioner (-column_pc_type): "cholesky", the
// factor by MUMPS, divided as well; or PETSc's "gamg" with the rigid motions, whose columns go one after another.
// The same group size gives the same bytes, whatever else runs.
class DistributedSolver final : public BlockSolver {
 public:
  // own: this rank's rows (assemble_own_rows), which become PETSc's. fixed, nodes: of the whole body.
  // Errors: OperationError (memory, not positive definite), on every rank alike.
  DistributedSolver(MPI_Comm group, BlockMatrix own, const RowPartition& partition,
                    std::span<const std::array<double, 3>> nodes, std::span<const std::array<std::uint8_t, 3>> fixed,
                    const ColumnSolverOptions& options);
  ~DistributedSolver() override;
  DistributedSolver(const DistributedSolver&) = delete;
  DistributedSolver& operator=(const DistributedSolver&) = delete;

  int width() const override;
  std::int64_t dofs() const override;  // of the whole

  // loads: the same on every rank; dofs by the partition's rows. x is written on the group's rank 0 alone, and may be
  // null on the others. Errors: on every rank alike.
  void solve(std::span<const Load> loads, double* x, std::span<ColumnReport> reports) override;
  bool has_result() const override;
  std::string description() const override;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace palpate
