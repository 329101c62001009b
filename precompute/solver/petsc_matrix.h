// K as PETSc's own matrix, entry by entry, for the preconditioners of PETSc.
#pragma once

#include <petscmat.h>

#include <array>
#include <cstdint>
#include <span>

#include "precompute/elements/stiffness.h"

namespace palpate {

// One process's matrix, symmetric positive definite. blocked: with block size 3, so that multigrid aggregates nodes and not
// dofs; the direct solvers want 1. The caller destroys it. Errors: OperationError (more numbers than PETSc can count).
Mat create_petsc_matrix(const BlockMatrix& matrix, bool blocked);

// Gives a matrix of block size 3 the six rigid motions as what multigrid must represent on every level. coordinates: of
// the nodes of this process's rows, m. Collective over the matrix's communicator.
void set_rigid_near_nullspace(Mat matrix, std::span<const std::array<double, 3>> coordinates);

// [rows][columns] -> [columns][rows]: PETSc's dense matrices hold one column after another.
void transpose(const double* from, double* to, std::int64_t rows, std::int64_t columns);

}  // namespace palpate
