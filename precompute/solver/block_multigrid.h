// Algebraic multigrid for whole blocks of columns: PETSc's GAMG builds the levels, ours are f32 and share every product.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "precompute/elements/stiffness.h"
#include "precompute/solver/batch_preconditioner.h"

namespace palpate {

// One V-cycle of smoothed aggregation that keeps the six rigid motions: a Chebyshev polynomial over the diagonal blocks
// before and after each coarser level, a dense factor of the coarsest. Symmetric positive definite up to f32's rounding.
class BlockMultigrid final : public BatchPreconditioner {
 public:
  // coordinates: of each block row's node, m. width: columns at a time, a multiple of 8. PETSc options with the prefix
  // column_multigrid_ reach the builder of the levels (-column_multigrid_pc_gamg_threshold 0.01); ours is
  // -column_multigrid_degree, of the polynomial. PETSc's levels are freed before this returns. Errors: OperationError
  // (memory, more numbers than PETSc can count, not positive definite); InputError (options).
  BlockMultigrid(const BlockMatrix& matrix, std::span<const std::array<double, 3>> coordinates, int width);
  ~BlockMultigrid() override;

  void apply(const double* r, double* z) override;
  std::string description() const override;

  std::int64_t bytes() const;  // matrices and work arrays of all levels
  int levels() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace palpate
