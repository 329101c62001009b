#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletSoftBody/btDeformableBodySolver.h>
#include <BulletSoftBody/btDeformableLinearElasticityForce.h>
#include <BulletSoftBody/btDeformableMultiBodyConstraintSolver.h>
#include <BulletSoftBody/btDeformableMultiBodyDynamicsWorld.h>
#include <BulletSoftBody/btSoftBody.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>

#include "bench/peers/bullet_peer.h"

namespace palpate::bench {

using studies::Answer;
using studies::Push;

namespace {

btVector3 vector(const double* metres) {
  return {static_cast<btScalar>(metres[0]), static_cast<btScalar>(metres[1]), static_cast<btScalar>(metres[2])};
}

}  // namespace

struct BulletBody::World {
  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btDeformableBodySolver solver;
  btDeformableMultiBodyConstraintSolver constraints;
  btDeformableMultiBodyDynamicsWorld world{&dispatcher, &broadphase, &constraints, &configuration, &solver};
  std::unique_ptr<btSoftBody> body;
  std::unique_ptr<btDeformableLinearElasticityForce> elasticity;
  std::vector<btVector3> rest;
};

BulletBody::BulletBody(const Push& push, double step) : push_(push), step_(step), world_(std::make_unique<World>()) {
  World& w = *world_;
  w.constraints.setDeformableSolver(&w.solver);
  w.world.setImplicit(true);  // as in Bullet's demo of large deformations
  w.world.setLineSearch(false);
  w.world.setUseProjection(true);
  w.world.setGravity(btVector3(0, 0, 0));
  for (const auto& p : push.body.nodes) w.rest.push_back(vector(p.data()));
  w.body =
      std::make_unique<btSoftBody>(&w.world.getWorldInfo(), static_cast<int>(w.rest.size()), w.rest.data(), nullptr);
  for (const auto& t : push.body.tetrahedra) w.body->appendTetra(t[0], t[1], t[2], t[3]);
  w.body->m_tetraScratches.resize(w.body->m_tetras.size());
  w.body->m_tetraScratchesTn.resize(w.body->m_tetras.size());
  w.body->setVolumeDensity(1060);
  for (std::size_t n = 0; n < push.body.nodes.size(); ++n)
    if (push.body.fixed[n][0] || push.body.fixed[n][1] || push.body.fixed[n][2])
      w.body->setMass(static_cast<int>(n), 0);
  w.body->setMass(push.node, 0);
  w.body->initializeDmInverse();
  w.body->m_cfg.collisions = 0;
  w.body->m_sleepingThreshold = 0;
  w.body->setActivationState(DISABLE_DEACTIVATION);
  const Material& material = push.body.materials[0];
  w.elasticity = std::make_unique<btDeformableLinearElasticityForce>();
  w.elasticity->setYoungsModulus(static_cast<btScalar>(material.young));
  w.elasticity->setPoissonRatio(static_cast<btScalar>(material.poisson));
  w.elasticity->setDamping(btScalar(0.05), btScalar(0.05));
  w.world.addSoftBody(w.body.get());
  w.world.addForce(w.body.get(), w.elasticity.get());
}

BulletBody::~BulletBody() {
  world_->world.removeForce(world_->body.get(), world_->elasticity.get());
  world_->world.removeSoftBody(world_->body.get());
}

void BulletBody::tick(const Eigen::Vector3d& displacement, Answer& answer) {
  World& w = *world_;
  btSoftBody::Node& node = w.body->m_nodes[push_.node];
  const btVector3 target = w.rest[push_.node] + vector(displacement.data());
  node.m_x = node.m_q = target;
  w.world.stepSimulation(static_cast<btScalar>(step_), 1, static_cast<btScalar>(step_));
  for (std::int32_t n = 0; n < push_.body.surface_count; ++n)
    for (int d = 0; d < 3; ++d) answer.surface[3 * n + d] = double{w.body->m_nodes[n].m_x[d]} - double{w.rest[n][d]};
  answer.force.setConstant(
      std::numeric_limits<double>::quiet_NaN());  // Bullet computes no force for a node that the program moves
}

}  // namespace palpate::bench
