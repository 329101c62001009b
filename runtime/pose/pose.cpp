#include "runtime/pose/pose.h"

#include "runtime/base/sine.h"

namespace palpate {
namespace {

constexpr double kFarthest = 1e6;  // m, as palpate.h states

}  // namespace

Quaternion unit(const Quaternion& q) {
  const double l = std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  if (!(l > 1e-150) || !std::isfinite(l)) return {};
  return {q.w / l, q.x / l, q.y / l, q.z / l};
}

Quaternion turn_by(Vec3 angle) {
  const double size = length(angle);
  if (!(size > 1e-150) || !std::isfinite(size)) return {};
  const SineCosine half = sine_cosine(0.5 * size);
  const Vec3 axis = (half.sine / size) * angle;
  return {half.cosine, axis.x, axis.y, axis.z};
}

Mat3 matrix_of(const Quaternion& q) {
  Mat3 a;
  a.m[0][0] = 1 - 2 * (q.y * q.y + q.z * q.z);
  a.m[0][1] = 2 * (q.x * q.y - q.w * q.z);
  a.m[0][2] = 2 * (q.x * q.z + q.w * q.y);
  a.m[1][0] = 2 * (q.x * q.y + q.w * q.z);
  a.m[1][1] = 1 - 2 * (q.x * q.x + q.z * q.z);
  a.m[1][2] = 2 * (q.y * q.z - q.w * q.x);
  a.m[2][0] = 2 * (q.x * q.z - q.w * q.y);
  a.m[2][1] = 2 * (q.y * q.z + q.w * q.x);
  a.m[2][2] = 1 - 2 * (q.x * q.x + q.y * q.y);
  return a;
}

bool is_position(const double* p) {
  return std::fabs(p[0]) <= kFarthest && std::fabs(p[1]) <= kFarthest && std::fabs(p[2]) <= kFarthest;  // false for NaN
}

double length_of(const double orientation[4]) {
  double sum = 0;
  for (int i = 0; i < 4; ++i) sum += orientation[i] * orientation[i];
  return std::sqrt(sum);
}

bool read_pose(const double position[3], const double orientation[4], Pose* pose) {
  if (!is_position(position) || !(std::fabs(length_of(orientation) - 1) <= kUnitTolerance)) return false;
  pose->position = load3(position);
  pose->orientation = unit({orientation[0], orientation[1], orientation[2], orientation[3]});
  pose->axes = matrix_of(pose->orientation);
  return true;
}

void OrganPose::set(const Pose& pose, Vec3 velocity, Vec3 angular_velocity) {
  pose_ = pose;
  velocity_ = velocity, angular_velocity_ = angular_velocity;
  moves_ = !is_zero(velocity) || !is_zero(angular_velocity);
  const Quaternion& q = pose.orientation;
  is_set_ = moves_ || !is_zero(pose.position) || q.x != 0 || q.y != 0 || q.z != 0;
  is_new_ = true;
}

void OrganPose::begin_step(double dt) {
  const bool moves_on = moves_ && !is_new_;
  is_new_ = false;
  if (!moves_on) return;
  const Vec3 position = pose_.position + dt * velocity_;
  const double at[3] = {position.x, position.y, position.z};
  if (!is_position(at)) {
    moves_ = false;
    return;
  }
  pose_.position = position;
  pose_.orientation = unit(turn_by(dt * angular_velocity_) * pose_.orientation);
  pose_.axes = matrix_of(pose_.orientation);
}

}  // namespace palpate
