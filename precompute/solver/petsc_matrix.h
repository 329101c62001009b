// K as a PETSc matrix, entry by entry, for PETSc's own preconditioners.
#pragma once

#include <petscmat.h>

#include <array>
#include <cstdint>
#include <span>

#include "precompute/elements/stiffness.h"

namespace palpate {

// Errors: OperationError where PETSc's 32-bit indices cannot count so many numbers; what: "degrees of freedom".
void refuse_uncountable(std::int64_t count, const char* what);

// One process's matrix, symmetric positive definite. blocked: with block size 3, so that multigrid aggregates nodes and not
// dofs; PETSc's direct solvers take block size 1 only. The caller destroys the matrix. Errors: OperationError (see above).
Mat create_petsc_matrix(const BlockMatrix& matrix, bool blocked);

// Gives a matrix of block size 3 the six rigid motions as its near-nullspace: multigrid then represents them exactly on every level.
// coordinates: of the nodes of this process's rows, m. Collective over the matrix's communicator.
void set_rigid_near_nullspace(Mat matrix, std::span<const std::array<double, 3>> coordinates);

// [rows][columns] -> [columns][rows]: PETSc's dense matrices hold one column after another.
void transpose(const double* from, double* to, std::int64_t rows, std::int64_t columns);

}  // namespace palpate
