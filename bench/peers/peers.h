// The systems that are compared: each takes the pushed node's displacement and answers as it would in a program.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "bench/peers/cholmod_factor.h"
#include "bench/peers/push.h"

namespace palpate::bench {

// The stiffness with the held dofs eliminated, and where the surface's dofs are in it.
struct FreeSystem {
  explicit FreeSystem(const Push& push);
  HeldStiffness held;
  SparseMatrix matrix;
};

// What a user with a sparse solver writes: the factor of the stiffness is kept. While the contact stays at a node its
// 3 x 3 compliance is kept too, and a tick is one back-substitution of the contact's force; when it moves to another
// node, the unit forces of the new one are solved first (three right-hand sides at once, then their sum).
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

// Eigen's conjugate gradients with its diagonal preconditioner, warm from the last tick, on the Dirichlet problem.
class ConjugateGradients {
 public:
  ConjugateGradients(const Push& push, double tolerance);
  ~ConjugateGradients();
  void tick(const Eigen::Vector3d& displacement, Answer& answer);

 private:
  struct Solver;
  std::unique_ptr<Solver> solver_;
};

#ifdef PALPATE_PEERS_BULLET
// Bullet's deformable body: the same tetrahedra with its corotated linear elasticity, backward Euler, one step a tick. Held
// nodes have no mass; the pushed one has none either and is put where it belongs. step: s. Bullet works in single precision.
class BulletBody {
 public:
  BulletBody(const Push& push, double step);
  ~BulletBody();
  void tick(const Eigen::Vector3d& displacement, Answer& answer);

 private:
  struct World;
  const Push& push_;
  double step_;
  std::unique_ptr<World> world_;
};
#endif

}  // namespace palpate::bench
