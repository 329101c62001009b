// Columns solved in another way than palpate-precompute solves them, so that `verify` finds a fault of the solver too.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "precompute/tensors/probe_columns.h"

namespace palpate {

// The tensors of a few nodes. Of the project's code only the assembly of K is shared with palpate-precompute. K is one PETSc
// AIJ matrix; PETSc's CG with PETSc's algebraic multigrid (GAMG) solves one column after another from zero, on the true
// residual; neither our Cholesky factor, our multigrid, our products of batches nor our rows of T^u are called. Needs a
// PetscSession. tolerance: on the true relative residual of each column. Errors: OperationError, where PETSc does not
// reach it.
std::vector<NodeTensor> solve_independently(const ElasticBody& body, Element element,
                                            std::span<const std::int32_t> nodes, double tolerance);

// The displacement of the vertices, [3 N] m, per unit of each of the body's motions, solved in the same way.
std::vector<std::vector<double>> solve_motions_independently(const ElasticBody& body, Element element,
                                                             double tolerance);

// The columns of the compliance, m/N, solved in the same way: for each node and each dof the displacement of the vertices, [3 N]; zeros for
// a held dof.
std::vector<std::vector<double>> solve_columns_independently(const ElasticBody& body, Element element,
                                                             std::span<const std::int32_t> nodes, double tolerance);

}  // namespace palpate
