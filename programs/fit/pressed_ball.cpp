#include "programs/fit/pressed_ball.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace palpate::fit {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

constexpr int kRounds = 60;
constexpr double kOnBall = 1e-4;  // of the depth: a node so near is on the ball

double total(const VectorXd& force, const std::vector<Vector3d>& normals, const Vector3d& axis) {
  double sum = 0;
  for (std::size_t k = 0; k < normals.size(); ++k) sum += force[static_cast<Index>(k)] * normals[k].dot(axis);
  return sum;
}

}  // namespace

double PressedBall::press(const Vector3d& centre, const Vector3d& axis, double depth, VectorXd* u) {
  near_enough_ = kOnBall * depth;
  VectorXd force;
  for (int round = 0; round < kRounds; ++round) {
    const bool grew = add_touched(centre, *u);
    const auto count = static_cast<Index>(touched_.size());
    if (count == 0) return 0;
    MatrixXd rows = MatrixXd::Zero(count, u->size());
    VectorXd target(count);
    std::vector<Vector3d> normals;
    double off = 0;
    for (Index k = 0; k < count; ++k) {
      const std::int32_t node = touched_[static_cast<std::size_t>(k)];
      const Vector3d from = at(node, *u) - centre, n = from.normalized();
      normals.push_back(n), off = std::max(off, std::abs(from.norm() - radius_));
      rows.block(k, 3 * Index(node), 1, 3) = n.transpose();
      target[k] = radius_ + n.dot(centre - rest(node));
    }
    if (round > 0 && !grew && off < near_enough_ && !lost_) return total(force, normals_, axis);
    force = reference_.solve(rows, target, u, tolerance_);
    normals_ = normals;
    drop_pulled(force);
  }
  throw std::runtime_error("the contact with the ball does not settle");
}

bool PressedBall::add_touched(const Vector3d& centre, const VectorXd& u) {
  bool grew = false;
  for (const std::int32_t node : near_)
    if ((at(node, u) - centre).norm() < radius_ - near_enough_ &&
        std::find(touched_.begin(), touched_.end(), node) == touched_.end())
      touched_.push_back(node), grew = true;
  return grew;
}

// A ball pushes alone: what it would pull is let go.
void PressedBall::drop_pulled(const VectorXd& force) {
  lost_ = false;
  std::vector<std::int32_t> kept;
  for (std::size_t k = 0; k < touched_.size(); ++k)
    force[static_cast<Index>(k)] >= 0 ? kept.push_back(touched_[k]) : void(lost_ = true);
  if (lost_) touched_ = kept;
}

}  // namespace palpate::fit
