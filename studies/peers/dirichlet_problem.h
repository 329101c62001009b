// An imposed node as a Dirichlet problem: the node's dofs are removed with the held ones, and every move solves the rest.
#pragma once

#include "studies/peers/push.h"

namespace palpate::studies {

struct DirichletProblem {
  // The push must outlive this.
  DirichletProblem(const Push& push, std::int32_t node);
  // From the solution, [3 rows] m: the surface's displacement and the force on the node.
  void read(const Eigen::Ref<const Eigen::VectorXd>& solution, const Eigen::Vector3d& displacement,
            Answer& answer) const;

  const Push& push;
  std::int32_t node;
  HeldStiffness held;
  Eigen::MatrixX3d load_of_unit;  // right-hand side per unit displacement of the node
};

}  // namespace palpate::studies
