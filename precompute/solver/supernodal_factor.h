// The Cholesky factor of K as the preconditioner of a block of columns.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "precompute/elements/block.h"
#include "precompute/elements/stiffness.h"
#include "precompute/solver/block_preconditioner.h"
#include "precompute/solver/elimination.h"

namespace palpate {

// CHOLMOD computes the factor; the triangular solves are ours: on [dofs][width], each supernode's dense blocks times
// rows of the block that are contiguous, read where they stand. The forward solve skips the supernodes whose rows are
// zero: for unit forces all but those on the way from their rows to the root.
class SupernodalFactor final : public BlockPreconditioner {
 public:
  // Errors: OperationError (memory, not positive definite: the block row is named).
  SupernodalFactor(const BlockMatrix& matrix, std::shared_ptr<const Elimination> elimination, int width);

  void apply(const double* r, double* z) override;
  bool solve(std::span<const Load> loads, double* x) override;
  std::string description() const override { return "cholesky (cholmod, supernodal blocks)"; }
  std::span<const std::int32_t> row_order() const override { return elimination_->place; }

  // (least / largest diagonal of the factor)^2.
  double reciprocal_condition() const override { return reciprocal_condition_; }

 private:
  void compute(const BlockMatrix& matrix);
  void pack(double* values);
  void touch_ancestors();
  void solve_triangles(double* y) const;
  void to_caller(const double* y, double* x) const;

  std::shared_ptr<const Elimination> elimination_;
  int width_;
  bool in_order_ = false;                   // the matrix came in elimination order
  std::vector<std::int32_t> parent_;        // supernode of the first row below, -1 for a root
  std::vector<std::int32_t> supernode_of_;  // [block rows], by place
  std::vector<std::int64_t> begin_;         // [supernodes + 1] into values_
  Block values_;
  std::vector<char> touched_;  // [supernodes]
  Block work_;                 // [dofs][width] in elimination order, where the matrix is not
  double reciprocal_condition_ = 1;
};

}  // namespace palpate
