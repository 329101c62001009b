// Any of PETSc's preconditioners on blocks of columns, chosen by the options with the prefix column_.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <string>

#include "precompute/elements/stiffness.h"
#include "precompute/solver/block_preconditioner.h"

namespace palpate {

// type: PETSc's name ("cholesky", "gamg", ...). coordinates: of each block row's node, m, for the rigid motions that
// multigrid keeps. Errors: OperationError (memory, not positive definite); InputError for options that contradict one
// another.
std::unique_ptr<BlockPreconditioner> make_petsc_preconditioner(const BlockMatrix& matrix,
                                                               std::span<const std::array<double, 3>> coordinates,
                                                               int width, const std::string& type);

}  // namespace palpate
