// What a user would write without Palpate. Each system takes the pushed node's displacement at a tick and returns the answer.
#pragma once

#include "studies/peers/cholmod_factor.h"
#include "studies/peers/push.h"

namespace palpate::studies {

// The stiffness without the held dofs.
struct FreeSystem {
  explicit FreeSystem(const Push& push);
  HeldStiffness held;
  SparseMatrix matrix;
};

// A direct solver that keeps the Cholesky factor of the stiffness. While the contact stays at a node, the node's 3 x 3
// compliance is kept too, and a tick is one back-substitution with the contact's force. When the contact moves to another
// node, the new node's three unit forces are solved at once, and the answer is a sum of the three columns.
class KeptFactor {
 public:
  KeptFactor(const Push& push, const FreeSystem& system);
  void hold(std::int32_t node);
  void tick(const Eigen::Vector3d& displacement, Answer& answer);
  void tick_at_new_node(std::int32_t node, const Eigen::Vector3d& displacement, Answer& answer);

 private:
  void scatter(const Eigen::Ref<const Eigen::VectorXd>& rows, Answer& answer) const;
  const Push& push_;
  const FreeSystem& system_;
  CholmodFactor factor_;
  std::int32_t row_ = 0;
  Eigen::Matrix3d stiffness_;  // C_kk^-1
  Eigen::VectorXd load_;
  Eigen::MatrixXd unit_loads_;
};

}  // namespace palpate::studies
