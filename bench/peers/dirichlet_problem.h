// A node's displacement as a Dirichlet problem: its dofs are eliminated beside the held ones, and every move solves a system.
#pragma once

#include "bench/peers/push.h"

namespace palpate::bench {

struct DirichletProblem {
  // The push must outlive this.
  DirichletProblem(const Push& push, std::int32_t node);
  // What the solved rows, [3 rows] m, say of the surface and of the node's force.
  void read(const Eigen::Ref<const Eigen::VectorXd>& solution, const Eigen::Vector3d& displacement,
            Answer& answer) const;

  const Push& push;
  std::int32_t node;
  HeldStiffness held;
  Eigen::MatrixX3d load_of_unit;  // right-hand side per unit displacement of the node
};

}  // namespace palpate::bench
