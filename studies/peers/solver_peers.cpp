#include "studies/peers/peers.h"

namespace palpate::studies {

FreeSystem::FreeSystem(const Push& push)
    : held(remove_held_dofs(push.stiffness, push.body.fixed)), matrix(sparse(held.matrix)) {}

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

}  // namespace palpate::studies
