// A PETSc preconditioner of K, such as gamg or PETSc's interface to MUMPS, for each column of a batch.
#pragma once

#include <petscksp.h>

#include <memory>

#include "precompute/solver/batch_preconditioner.h"
#include "precompute/solver/column_operator.h"

namespace palpate {

// The type is op.per_column_type; PETSc options with the prefix column_ reach it. Errors: OperationError (memory, not
// positive definite); InputError for options that contradict one another.
std::unique_ptr<BatchPreconditioner> make_per_column_pc(const ColumnOperator& op);

// For -ksp_view; does nothing for another kind of preconditioner.
PetscErrorCode view_inner_pc(const BatchPreconditioner& preconditioner, PetscViewer viewer);

}  // namespace palpate
