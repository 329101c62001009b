// The operator K (x) I where K is divided among the ranks of a group: none of them holds all of it.
#pragma once

#include <mpi.h>

#include <memory>
#include <span>

#include "precompute/ranks/row_partition.h"
#include "precompute/solver/column_solver.h"

namespace palpate {

// A column solver whose operator is divided: PETSc's MPIAIJ with block size 3, and MPIMAIJ for K (x) I. Its default
// preconditioner is MUMPS's Cholesky factor, which is divided as well, or (options.cholesky false) PETSc's gamg with the
// rigid motions; both solve one column after another. The solution goes to the group's rank 0.
//
// own: this rank's rows (assemble_own_rows). fixed, nodes: of the whole body. Every call of the solver is collective over
// the group; x may be null on ranks without a result. Errors: OperationError (memory, not positive definite, more numbers
// than PETSc counts), on every rank alike.
std::unique_ptr<ColumnSolver> divided_column_solver(MPI_Comm group, BlockMatrix own, const RowPartition& partition,
                                                    std::span<const std::array<double, 3>> nodes,
                                                    std::span<const std::array<std::uint8_t, 3>> fixed,
                                                    const ColumnSolverOptions& options);

}  // namespace palpate
