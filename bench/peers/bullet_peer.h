// Bullet's deformable body as a peer of peers_bench. Only where CMake finds Bullet.
#pragma once

#include <memory>

#include "studies/peers/push.h"

namespace palpate::bench {

// The same tetrahedra with Bullet's corotated linear elasticity and backward Euler, one step of `step` seconds a tick, in single
// precision. Held nodes have no mass, so that Bullet does not move them. Nor has the pushed node: each tick sets its position.
class BulletBody {
 public:
  BulletBody(const studies::Push& push, double step);
  ~BulletBody();
  void tick(const Eigen::Vector3d& displacement, studies::Answer& answer);

 private:
  struct World;
  const studies::Push& push_;
  double step_;
  std::unique_ptr<World> world_;
};

}  // namespace palpate::bench
