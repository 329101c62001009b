#include "studies/peers/cholmod_factor.h"

#include <stdexcept>
#include <vector>

namespace palpate::studies {

CholmodFactor::CholmodFactor(const Eigen::SparseMatrix<double>& matrix) {
  cholmod_start(&common_);
  common_.supernodal = CHOLMOD_SUPERNODAL;
  const Eigen::SparseMatrix<double> lower = matrix.triangularView<Eigen::Lower>();
  cholmod_sparse view = {};
  view.nrow = static_cast<std::size_t>(lower.rows()), view.ncol = static_cast<std::size_t>(lower.cols());
  view.nzmax = static_cast<std::size_t>(lower.nonZeros());
  view.p = const_cast<int*>(lower.outerIndexPtr()), view.i = const_cast<int*>(lower.innerIndexPtr());
  view.x = const_cast<double*>(lower.valuePtr());
  view.stype = -1, view.itype = CHOLMOD_INT, view.xtype = CHOLMOD_REAL, view.dtype = CHOLMOD_DOUBLE;
  view.sorted = view.packed = 1;
  factor_ = cholmod_analyze(&view, &common_);
  cholmod_factorize(&view, factor_, &common_);
  if (common_.status != CHOLMOD_OK) throw std::runtime_error("CHOLMOD: the stiffness is not positive definite");
}

CholmodFactor::~CholmodFactor() {
  for (cholmod_dense** dense : {&solution_, &work_, &more_work_})
    if (*dense) cholmod_free_dense(dense, &common_);
  cholmod_free_factor(&factor_, &common_);
  cholmod_finish(&common_);
}

Eigen::Map<const Eigen::MatrixXd> CholmodFactor::solve(const Eigen::Ref<const Eigen::MatrixXd>& load) {
  cholmod_dense view = {};
  view.nrow = static_cast<std::size_t>(load.rows()), view.ncol = static_cast<std::size_t>(load.cols());
  view.d = static_cast<std::size_t>(load.outerStride()), view.nzmax = view.d * view.ncol;
  view.x = const_cast<double*>(load.data()), view.xtype = CHOLMOD_REAL, view.dtype = CHOLMOD_DOUBLE;
  if (!cholmod_solve2(CHOLMOD_A, factor_, &view, nullptr, &solution_, nullptr, &work_, &more_work_, &common_))
    throw std::runtime_error("CHOLMOD: the solve failed");
  return {static_cast<const double*>(solution_->x), load.rows(), load.cols()};
}

}  // namespace palpate::studies
