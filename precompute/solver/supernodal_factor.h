// The Cholesky factor of K as the preconditioner of a batch of columns.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "precompute/elements/column_buffer.h"
#include "precompute/elements/stiffness.h"
#include "precompute/solver/batch_preconditioner.h"
#include "precompute/solver/elimination.h"

namespace palpate {

// Where a block row comes from, so that an error can name it; both may be empty.
struct RowNames {
  std::span<const std::int32_t> node;               // of each block row, in the mesh
  std::span<const std::array<double, 3>> position;  // m
};

// CHOLMOD computes the factor L; the triangular solves are ours. They work in place on the batch, [dofs][width], with one
// dense product for each supernode (a run of columns of L that share their pattern). The forward substitution visits only the
// supernodes between the loaded rows and the root of the elimination tree; the rows of all other supernodes stay zero.
class SupernodalFactor final : public BatchPreconditioner {
 public:
  // names is read in the constructor only. Errors: OperationError (memory; not positive definite, with the node's name).
  SupernodalFactor(const BlockMatrix& matrix, std::shared_ptr<const Elimination> elimination, int width,
                   const RowNames& names = {});

  void apply(const double* r, double* z) override;
  bool apply_to_loads(std::span<const Load> loads, double* x) override;
  std::string description() const override { return "supernodal (Cholesky factor by CHOLMOD)"; }
  bool is_exact() const override { return true; }
  std::span<const std::int32_t> row_order() const override { return elimination_->place; }

  // (least / largest diagonal of the factor)^2.
  double reciprocal_condition() const override { return reciprocal_condition_; }

 private:
  void compute(const BlockMatrix& matrix, const RowNames& names);
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
  ColumnBuffer values_;
  std::vector<char> touched_;  // [supernodes]: 1 where the forward substitution has to visit it
  ColumnBuffer work_;          // [dofs][width] in elimination order, where the matrix is not
  double reciprocal_condition_ = 1;
};

}  // namespace palpate
