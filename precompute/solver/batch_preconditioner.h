// M^-1 for a batch of columns: an approximation of K^-1 that the conjugate gradients (CG) use as their preconditioner.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace palpate {

// One nonzero number of the right-hand sides b, [dofs][width].
struct Load {
  std::int64_t dof;
  std::int32_t column;
  double value;
};

class BatchPreconditioner {
 public:
  virtual ~BatchPreconditioner() = default;

  // z = M^-1 r. r, z: [dofs][width], two different arrays; the implementation knows the width since its construction.
  // M^-1 is linear, symmetric and positive definite, and the same input gives the same bytes.
  virtual void apply(const double* r, double* z) = 0;

  // z = M^-1 b, where b is the sum of the loads. False: the implementation cannot make use of b's zeros and has done
  // nothing; the caller then writes b out and calls apply().
  virtual bool apply_to_loads(std::span<const Load>, double*) { return false; }

  // For the certificate: "supernodal (Cholesky factor)".
  virtual std::string description() const = 0;

  // M is K up to rounding (a factor), so that M^-1 b is an initial guess which usually meets the tolerance.
  virtual bool is_exact() const { return false; }

  // From the diagonal of a factor: an upper bound of 1 / condition of K where K itself is factored, an estimate where the
  // pressure form of K is; 0 where there is no factor.
  virtual double reciprocal_condition() const { return 0; }

  // Position of each block row in the elimination order; empty where nothing is eliminated. Columns whose loaded rows are
  // close in this order share most of their work, so they belong in the same batch.
  virtual std::span<const std::int32_t> row_order() const { return {}; }
};

}  // namespace palpate
