// K as the column solver sees it: K (x) I, the stiffness matrix applied to a batch of columns at once.
#pragma once

#include <petscksp.h>

#include <array>
#include <cstdint>
#include <exception>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "precompute/elements/pressure_form.h"
#include "precompute/elements/stiffness.h"
#include "precompute/solver/batch_preconditioner.h"

namespace palpate {

class MachineMemory;
struct Elimination;

// K on one rank with its node positions, as our own preconditioners need it.
struct WholeMatrix {
  const BlockMatrix& matrix;
  std::vector<std::array<double, 3>> coordinates;  // m, of each block row's node
  std::shared_ptr<const Elimination> elimination;  // null: not analysed yet
  std::vector<std::int32_t> node_of_row;           // in the mesh, for errors; may be empty
  std::shared_ptr<const PressureForm> form;        // of K, to be factored in its place; null: none
  std::shared_ptr<MachineMemory> machine;          // whose ranks hold one factor; null: each has its own
};

// Two kinds: all of K on this rank (whole_operator), or K divided among the ranks of a group (ranks/divided_operator.h).
// Where it is divided, every call is collective over the group.
class ColumnOperator {
 public:
  virtual ~ColumnOperator() = default;

  virtual MPI_Comm communicator() const = 0;
  virtual int width() const = 0;              // columns in a batch
  virtual std::int64_t dofs() const = 0;      // of the whole K
  virtual std::int64_t own_dofs() const = 0;  // of this rank's rows
  virtual double infinity_norm() const = 0;   // largest row sum of |K|

  virtual Mat batch_matrix() const = 0;  // K (x) I; operator_of() finds this object from it
  // K, entry by entry, for PETSc's own preconditioners; the caller destroys it. for_factor: as PETSc's direct solvers take
  // it; else with block size 3 and the rigid motions as near-nullspace, as multigrid needs it.
  virtual Mat create_matrix(bool for_factor) const = 0;
  virtual MatSolverType factor_package() const = 0;             // PETSc's package that factors this matrix
  virtual const WholeMatrix* whole() const { return nullptr; }  // null: divided
  virtual void forget_form() {}                                 // of whole(); the factor is made

  virtual Vec create_vector() const = 0;  // a batch of columns, rows as in batch_matrix()
  virtual void set_loads(Vec b, std::span<const Load> loads) const = 0;
  // The caller's array becomes the memory of x, where this rank holds all rows.
  virtual void begin(Vec, double*) const {}
  // x is complete: writes it to the caller's array where it is not there yet.
  virtual void end(Vec x, double* solution) const = 0;
  virtual bool has_result() const { return true; }  // end() writes on this rank

  virtual std::vector<double> column_norms(Vec v) const = 0;
  // ||b - K x|| of each column, where K x was computed since the last call, for the x of begin(); else empty.
  virtual std::vector<double> take_residual_norms() { return {}; }
  // What set_loads() wrote to this vector, which nobody else changes; null: it was not the last one.
  virtual const std::vector<Load>* loads_of(Vec /*b*/) const { return nullptr; }

  // For the PC types that work on batches. finished: columns that meet the tolerance already; preconditioners return zero
  // for them, so that CG changes only the others. thrown: by a preconditioner, carried through PETSc's C code.
  std::vector<char> finished;
  std::exception_ptr thrown;
  std::string per_column_type;  // PETSc's type of the inner PC, where one solves column by column
};

// All of K on this rank; matrix must outlive the operator. width: as many columns in a batch as PETSc's 32-bit indices
// allow, at most this. Errors: OperationError.
std::unique_ptr<ColumnOperator> whole_operator(WholeMatrix matrix, int width);

// The operator whose batch_matrix() this is; null for another matrix.
ColumnOperator* operator_of(Mat batch_matrix);
void attach_operator(Mat batch_matrix, ColumnOperator* op);

// The largest width, at most the given one, for which PETSc's 32-bit indices count dofs x width numbers.
int countable_width(std::int64_t dofs, int width);

}  // namespace palpate
