#include "studies/scenes/full_body.h"

#include "precompute/elements/motion_loads.h"

namespace palpate::scenes {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

FullBody::FullBody(ElasticBody body, Element element)
    : body_(std::move(body)), discretisation_(discretise(body_, element)) {
  const auto& fixed = discretisation_.fixed;
  std::vector<Eigen::Triplet<double>> chosen;
  for (std::size_t dof = 0; dof < 3 * fixed.size(); ++dof)
    if (!fixed[dof / 3][dof % 3]) chosen.emplace_back(static_cast<int>(chosen.size()), static_cast<int>(dof), 1.0);
  free_.resize(static_cast<Index>(chosen.size()), static_cast<Index>(3 * fixed.size()));
  free_.setFromTriplets(chosen.begin(), chosen.end());
  factor_ = std::make_unique<studies::CholmodFactor>(
      studies::SparseMatrix(free_ * studies::sparse(discretisation_.stiffness) * free_.transpose()));
}

studies::CoupledBody FullBody::coupled(VectorXd moved) const {
  return {[this](const MatrixXd& forces) { return under(forces); }, 3 * static_cast<Index>(body_.nodes.size()),
          std::move(moved)};
}

MatrixXd FullBody::solved(const MatrixXd& node_forces) const {
  if (node_forces.cols() == 0) return node_forces;
  return free_.transpose() * factor_->solve(MatrixXd(free_ * node_forces));
}

VectorXd FullBody::vertices_of(const VectorXd& nodes) const {
  const std::vector<double> read =
      read_vertices(discretisation_, {nodes.data(), static_cast<std::size_t>(nodes.size())});
  return Eigen::Map<const VectorXd>(read.data(), static_cast<Index>(read.size()));
}

MatrixXd FullBody::under(const MatrixXd& vertex_forces) const {
  const auto nodes = static_cast<Index>(discretisation_.fixed.size());
  MatrixXd forces = MatrixXd::Zero(3 * nodes, vertex_forces.cols());
  const TouchFunctionals& touch = discretisation_.touch;
  for (Index v = 0; v < vertex_forces.rows() / 3; ++v) {
    if (touch.weight.empty()) {
      forces.middleRows<3>(3 * v) += vertex_forces.middleRows<3>(3 * v);
      continue;
    }
    for (auto at = touch.nodes.first[static_cast<std::size_t>(v)];
         at < touch.nodes.first[static_cast<std::size_t>(v) + 1]; ++at)
      forces.middleRows<3>(3 * touch.nodes.item[static_cast<std::size_t>(at)]) +=
          touch.weight[static_cast<std::size_t>(at)] * vertex_forces.middleRows<3>(3 * v);
  }
  const MatrixXd u = solved(forces);
  MatrixXd read(vertex_forces.rows(), vertex_forces.cols());
  for (Index c = 0; c < u.cols(); ++c) read.col(c) = vertices_of(u.col(c));
  return read;
}

VectorXd FullBody::moved_by(const std::vector<double>& amounts) const {
  const std::vector<MotionLoad> loads = motion_loads(body_, discretisation_);
  VectorXd force = VectorXd::Zero(3 * static_cast<Index>(discretisation_.fixed.size())), imposed = force;
  for (std::size_t m = 0; m < loads.size(); ++m) {
    force += amounts[m] * Eigen::Map<const VectorXd>(loads[m].force.data(), force.size());
    if (!loads[m].imposed.empty())
      imposed += amounts[m] * Eigen::Map<const VectorXd>(loads[m].imposed.data(), force.size());
  }
  const VectorXd u = solved(force) + imposed;
  VectorXd read = vertices_of(u);
  for (Index i = 0; i < read.size(); ++i)
    if (body_.fixed[static_cast<std::size_t>(i / 3)][static_cast<std::size_t>(i % 3)]) read[i] = u[i];
  return read;
}

double FullBody::swept(std::size_t motion, const VectorXd& u) const {
  const std::vector<MotionLoad> loads = motion_loads(body_, discretisation_);
  return Eigen::Map<const VectorXd>(loads[motion].sweep.data(), u.size()).dot(u);
}

}  // namespace palpate::scenes
