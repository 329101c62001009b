// Algebraic multigrid for a batch of columns. PETSc's GAMG builds the levels; our copy of them is in f32, and each product
// reads a matrix once for all columns of the batch.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "precompute/elements/stiffness.h"
#include "precompute/solver/batch_preconditioner.h"

namespace palpate {

// One V-cycle of smoothed aggregation whose coarse levels represent the six rigid motions exactly. The smoother before and
// after each coarser level is a Chebyshev polynomial with the diagonal blocks as its preconditioner; the coarsest level is
// solved by a dense factor. Symmetric positive definite up to the rounding of f32.
class BatchMultigrid final : public BatchPreconditioner {
 public:
  // coordinates: of each block row's node, m. width: columns in a batch, a multiple of 8. PETSc options with the prefix
  // column_multigrid_ reach GAMG (-column_multigrid_pc_gamg_threshold 0.01); our own option -column_multigrid_degree sets the
  // degree of the polynomial. PETSc's levels are freed before this returns. Errors: OperationError (memory, more numbers than
  // PETSc can count, not positive definite); InputError (options).
  BatchMultigrid(const BlockMatrix& matrix, std::span<const std::array<double, 3>> coordinates, int width);
  ~BatchMultigrid() override;

  void apply(const double* r, double* z) override;
  std::string description() const override;

  std::int64_t bytes() const;  // matrices and work arrays of all levels
  int levels() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace palpate
