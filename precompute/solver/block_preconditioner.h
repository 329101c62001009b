// M^-1 for blocks of columns: what stands between the conjugate gradients and the way K is approximated.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace palpate {

// A number of the right-hand sides b, [dofs][width], that is not zero.
struct Load {
  std::int64_t dof;
  std::int32_t column;
  double value;
};

class BlockPreconditioner {
 public:
  virtual ~BlockPreconditioner() = default;

  // z = M^-1 r for width columns at once, the width being the implementation's from the start. r, z: [dofs][width], the
  // columns of one dof side by side; distinct arrays. M^-1 is linear, symmetric and positive definite, and the same
  // input gives the same bytes.
  virtual void apply(const double* r, double* z) = 0;

  // x = K^-1 b, from the numbers of b that are not zero. Where M only approximates K: false, and nothing is done.
  virtual bool solve(std::span<const Load>, double*) { return false; }

  // "cholesky (cholmod)".
  virtual std::string description() const = 0;

  // An upper bound of 1 / condition of K, from the diagonal of its factor; 0 where there is none.
  virtual double reciprocal_condition() const { return 0; }

  // Place of each block row in the elimination order; empty where rows are not eliminated. Columns whose rows are close
  // in it share most of their work.
  virtual std::span<const std::int32_t> row_order() const { return {}; }
};

}  // namespace palpate
