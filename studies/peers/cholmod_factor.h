// CHOLMOD's supernodal factor of a symmetric positive definite matrix, kept with its workspace.
#pragma once

#include <suitesparse/cholmod.h>

#include <Eigen/Dense>
#include <Eigen/SparseCore>

namespace palpate::studies {

class CholmodFactor {
 public:
  // Errors: std::runtime_error where the matrix is not positive definite.
  explicit CholmodFactor(const Eigen::SparseMatrix<double>& matrix);
  ~CholmodFactor();
  CholmodFactor(const CholmodFactor&) = delete;
  CholmodFactor& operator=(const CholmodFactor&) = delete;

  // matrix^-1 load, any number of columns at once; valid until the next call. Allocates only when the number of
  // columns changes (cholmod_solve2).
  Eigen::Map<const Eigen::MatrixXd> solve(const Eigen::Ref<const Eigen::MatrixXd>& load);

 private:
  cholmod_common common_;
  cholmod_factor* factor_ = nullptr;
  cholmod_dense *solution_ = nullptr, *work_ = nullptr, *more_work_ = nullptr;
};

}  // namespace palpate::studies
