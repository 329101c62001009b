// A rigid ball without friction on a body under large strain: nodes that it touches stay on its surface, the others outside.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "studies/hyperelastic/large_reference.h"

namespace palpate::fit {

class PressedBall {
 public:
  // nodes: [][3] m, at rest. near: those that the ball may touch. touched: those that it touches; a solution begins with them and leaves its own.
  // All are borrowed.
  PressedBall(const double* nodes, const LargeReference& reference, double radius,
              const std::vector<std::int32_t>& near, double tolerance, std::vector<std::int32_t>* touched)
      : nodes_(nodes), reference_(reference), radius_(radius), tolerance_(tolerance), near_(near), touched_(*touched) {}

  // From u on, with the ball's centre there. depth: how deep the ball is, for the accuracy of what touches it. Returns the force along the axis.
  // Errors: std::runtime_error where it does not converge.
  double press(const Eigen::Vector3d& centre, const Eigen::Vector3d& axis, double depth, Eigen::VectorXd* u);

 private:
  Eigen::Vector3d rest(std::int32_t node) const { return Eigen::Vector3d::Map(nodes_ + 3 * std::size_t(node)); }
  Eigen::Vector3d at(std::int32_t node, const Eigen::VectorXd& u) const {
    return rest(node) + u.segment<3>(3 * Eigen::Index(node));
  }
  bool add_touched(const Eigen::Vector3d& centre, const Eigen::VectorXd& u);
  void drop_pulled(const Eigen::VectorXd& force);

  const double* nodes_;
  const LargeReference& reference_;
  double radius_, tolerance_, near_enough_ = 0;  // m, 1, m
  const std::vector<std::int32_t>& near_;
  std::vector<std::int32_t>& touched_;
  std::vector<Eigen::Vector3d> normals_;
  bool lost_ = false;
};

}  // namespace palpate::fit
