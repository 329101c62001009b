#include <Eigen/IterativeLinearSolvers>

#include "bench/peers/peers.h"

namespace palpate::bench {

FreeSystem::FreeSystem(const Push& push)
    : held(eliminate_held(push.stiffness, push.body.fixed)), matrix(sparse(held.matrix)) {}

KeptFactor::KeptFactor(const Push& push, const FreeSystem& system)
    : push_(push), system_(system), factor_(system.matrix) {
  load_.setZero(system.matrix.rows());
  unit_loads_.setZero(system.matrix.rows(), 3);
}

void KeptFactor::hold(std::int32_t node) {
  unit_loads_.middleRows<3>(3 * row_).setZero();
  load_.segment<3>(3 * row_).setZero();
  row_ = system_.held.row_of_node[node];
  unit_loads_.middleRows<3>(3 * row_).setIdentity();
  const Eigen::Matrix3d compliance = factor_.solve(unit_loads_).middleRows<3>(3 * row_);
  stiffness_ = compliance.inverse();
}

void KeptFactor::tick(const Eigen::Vector3d& displacement, Answer& answer) {
  answer.force = stiffness_ * displacement;
  load_.segment<3>(3 * row_) = answer.force;
  scatter(factor_.solve(load_), answer);
}

void KeptFactor::tick_at_new_node(std::int32_t node, const Eigen::Vector3d& displacement, Answer& answer) {
  unit_loads_.middleRows<3>(3 * row_).setZero();
  row_ = system_.held.row_of_node[node];
  unit_loads_.middleRows<3>(3 * row_).setIdentity();
  const auto columns = factor_.solve(unit_loads_);
  const Eigen::Matrix3d compliance = columns.middleRows<3>(3 * row_);
  answer.force = compliance.inverse() * displacement;
  load_.noalias() = columns * answer.force;
  scatter(load_, answer);
  load_.setZero();
}

void KeptFactor::scatter(const Eigen::Ref<const Eigen::VectorXd>& rows, Answer& answer) const {
  for (std::int32_t n = 0; n < push_.body.surface_count; ++n) {
    const std::int32_t row = system_.held.row_of_node[n];
    if (row < 0)
      answer.surface.segment<3>(3 * n).setZero();
    else
      answer.surface.segment<3>(3 * n) = rows.segment<3>(3 * row);
  }
}

struct ConjugateGradients::Solver {
  HeldStiffness held;
  SparseMatrix matrix;
  Eigen::MatrixX3d load_of_unit;  // right-hand side per unit displacement of the pushed node
  Eigen::VectorXd load, solution;
  Eigen::ConjugateGradient<SparseMatrix, Eigen::Lower | Eigen::Upper> gradients;
};

ConjugateGradients::ConjugateGradients(const Push& push, double tolerance)
    : push_(push), solver_(std::make_unique<Solver>()) {
  auto fixed = push.body.fixed;
  fixed[push.node] = {1, 1, 1};
  solver_->held = eliminate_held(push.stiffness, fixed);
  solver_->matrix = sparse(solver_->held.matrix);
  solver_->gradients.setTolerance(tolerance);
  solver_->gradients.compute(solver_->matrix);
  solver_->solution.setZero(solver_->matrix.rows());
  solver_->load_of_unit.setZero(solver_->matrix.rows(), 3);
  for (std::int64_t at = push.stiffness.first[push.node]; at < push.stiffness.first[push.node + 1]; ++at) {
    const std::int32_t node = push.stiffness.column[at], row = solver_->held.row_of_node[node];
    if (row < 0) continue;
    const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> block(push.stiffness.block[at].data());
    for (int i = 0; i < 3; ++i)
      if (!fixed[node][i]) solver_->load_of_unit.row(3 * row + i) = -block.col(i);  // the transposed block
  }
}
ConjugateGradients::~ConjugateGradients() = default;

void ConjugateGradients::tick(const Eigen::Vector3d& displacement, Answer& answer) {
  Solver& s = *solver_;
  s.load.noalias() = s.load_of_unit * displacement;
  s.solution = s.gradients.solveWithGuess(s.load, s.solution);
  const auto at = [&](std::int32_t node) -> Eigen::Vector3d {
    if (node == push_.node) return displacement;
    const std::int32_t row = s.held.row_of_node[node];
    return row < 0 ? Eigen::Vector3d::Zero() : Eigen::Vector3d(s.solution.segment<3>(3 * row));
  };
  for (std::int32_t n = 0; n < push_.body.surface_count; ++n) answer.surface.segment<3>(3 * n) = at(n);
  answer.force.setZero();
  for (std::int64_t b = push_.stiffness.first[push_.node]; b < push_.stiffness.first[push_.node + 1]; ++b)
    answer.force += Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(push_.stiffness.block[b].data()) *
                    at(push_.stiffness.column[b]);
}

}  // namespace palpate::bench
