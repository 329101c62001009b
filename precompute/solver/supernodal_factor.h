// A factor of K, or of its pressure form, as the preconditioner of a batch of columns.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "precompute/elements/column_buffer.h"
#include "precompute/elements/pressure_form.h"
#include "precompute/elements/stiffness.h"
#include "precompute/solver/batch_preconditioner.h"
#include "precompute/solver/elimination.h"
#include "precompute/solver/supernodal_kernels.h"

namespace palpate {

class MachineMemory;

// Where a block row comes from, so that an error can name it; both may be empty.
struct RowNames {
  std::span<const std::int32_t> node;               // of each block row, in the mesh
  std::span<const std::array<double, 3>> position;  // m
};

// K^-1 by a factor L S L^T: of K itself (kBlock 3, S = I: Cholesky's), or of its pressure form (kBlock 4), from whose solution the
// pressures are left out. The triangular solves take one dense product for each supernode (a run of columns of L that share
// their pattern). The forward substitution visits only the supernodes between the loaded rows and the root of the elimination
// tree; the rows of all other supernodes stay zero. Number: double or float, in which the factor is computed, stored and applied.
template <class Number, int kBlock>
class SupernodalFactorOf final : public BatchPreconditioner {
 public:
  // elimination: of the matrix. names is read in the constructor only. machine: its ranks construct this together, from the same
  // matrix, divide the factorisation and hold one factor; constructor and destructor are then collective over them. null: this
  // process has a factor of its own. Errors: OperationError (memory; a pivot of the wrong sign, with the node's name).
  SupernodalFactorOf(const BlockMatrixOf<kBlock>& matrix, std::shared_ptr<const Elimination> elimination, int width,
                     const RowNames& names = {}, std::shared_ptr<MachineMemory> machine = nullptr);

  void apply(const double* r, double* z) override;
  bool apply_to_loads(std::span<const Load> loads, double* x) override;
  std::string description() const override;
  bool is_exact() const override { return sizeof(Number) == sizeof(double); }
  std::span<const std::int32_t> row_order() const override { return elimination_->place; }

  // (least / largest diagonal of the factor)^2, of the rows of displacements.
  double reciprocal_condition() const override { return reciprocal_condition_; }

 private:
  // The batch is solved where the caller has it, if its rows and numbers are those of L.
  static constexpr bool kSameRows = kBlock == 3 && sizeof(Number) == sizeof(double);

  void compute(const BlockMatrixOf<kBlock>& matrix, const RowNames& names);
  void allocate(std::int64_t numbers);
  void pack();
  void shrink();
  void touch_ancestors();
  Number* batch(double* of_caller) const;
  void solve_triangles(Number* y) const;
  void to_caller(const Number* y, double* x) const;

  std::shared_ptr<const Elimination> elimination_;
  int width_, stride_;                      // of the caller's batch and of work_
  bool in_place_ = false;                   // the batch needs no work_
  std::vector<std::int32_t> parent_;        // supernode of the first row below, -1 for a root
  std::vector<std::int32_t> supernode_of_;  // [block rows], by place
  std::vector<std::int64_t> begin_;         // [supernodes + 1] into values_
  std::shared_ptr<MachineMemory> machine_;
  ColumnBufferOf<Number> own_values_;  // null where the ranks of the machine share the numbers
  Number* values_ = nullptr;           // own_values_, or the machine's
  std::vector<char> touched_;          // [supernodes]: 1 where the forward substitution has to visit it
  ColumnBufferOf<Number> work_;        // [kBlock * block rows][stride_] in elimination order
  double reciprocal_condition_ = 1;
};

using SupernodalFactor = SupernodalFactorOf<double, 3>;  // of K
using PressureFactor = SupernodalFactorOf<double, 4>;    // of its pressure form

}  // namespace palpate
