// Where a body is in the world: how its frame is turned and moved against the world's.
#pragma once

#include "runtime/base/vec3.h"
#include "runtime/include/palpate/palpate.h"

namespace palpate {

struct Quaternion {
  double w = 1, x = 0, y = 0, z = 0;
};

// In vectors, because of gcc 12: where signs alternate from one line to the next it fuses products and sums (vfmaddsub) although
// -ffp-contract=off forbids it, and builds for other processors would have other bits.
inline Quaternion operator*(const Quaternion& a, const Quaternion& b) {
  const Vec3 u{a.x, a.y, a.z}, v{b.x, b.y, b.z};
  const Vec3 sum = a.w * v + b.w * u + cross(u, v);
  return {a.w * b.w - dot(u, v), sum.x, sum.y, sum.z};
}

// The quaternion of unit length along q, or that of no turn where q has no length.
Quaternion unit(const Quaternion& q);
// The turn by |angle| radian about the axis `angle`.
Quaternion turn_by(Vec3 angle);
// Columns: the body's axes in the world. q: of unit length.
Mat3 matrix_of(const Quaternion& q);

struct Pose {
  Vec3 position;  // m, of the body's origin in the world
  Quaternion orientation;
  Mat3 axes = matrix_of(Quaternion{});  // of orientation

  Vec3 turned_to_world(Vec3 v) const { return axes * v; }
  Vec3 turned_to_body(Vec3 v) const {
    return {axes.m[0][0] * v.x + axes.m[1][0] * v.y + axes.m[2][0] * v.z,
            axes.m[0][1] * v.x + axes.m[1][1] * v.y + axes.m[2][1] * v.z,
            axes.m[0][2] * v.x + axes.m[1][2] * v.y + axes.m[2][2] * v.z};
  }
  Vec3 to_world(Vec3 p) const { return position + turned_to_world(p); }
  Vec3 to_body(Vec3 p) const { return turned_to_body(p - position); }
};

bool same_pose(const Pose& a, const Pose& b);
// A box in the frame of a body.
struct PosedBox {
  const Pose& pose;
  Vec3 low, high;
};
// m: the longest way, in the frame of b, of a point of the box `a` since both were at the poses `before`.
double longest_way(const Pose& a_before, const Pose& b_before, const PosedBox& a, const Pose& b);
// Whether the box around `a` in the frame of b is farther from the box of b than `room` (m) along an axis of that frame.
bool are_apart(const PosedBox& a, const PosedBox& b, double room);

// Whether the three numbers are a position that a host may state: finite and within 1e6 m.
bool is_position(const double* p);
// The pose of those numbers. False, with *pose unchanged, where the position is none or the orientation's length is not 1
// within kUnitTolerance; within it the orientation is brought to length 1.
constexpr double kUnitTolerance = 1e-3;
bool read_pose(const double position[3], const double orientation[4], Pose* pose);
// The length of an orientation, for a message.
double length_of(const double orientation[4]);

// The pose of the organ, from touch step to touch step.
class OrganPose {
 public:
  // False while the organ's frame is the world's: coordinates are then used as they are.
  bool is_set() const { return is_set_; }
  const Pose& pose() const { return pose_; }

  void set(const Pose& pose, Vec3 velocity, Vec3 angular_velocity);
  // Whether the next step has the pose of the last one.
  bool stands() const { return !moves_ && !is_new_; }
  // A touch step begins, dt seconds after the last one: a pose that was not set since then moves on by its velocities.
  void begin_step(double dt);

  Vec3 point_to_organ(Vec3 p) const { return is_set_ ? pose_.to_body(p) : p; }
  Vec3 point_to_world(Vec3 p) const { return is_set_ ? pose_.to_world(p) : p; }
  Vec3 vector_to_organ(Vec3 v) const { return is_set_ ? pose_.turned_to_body(v) : v; }
  Vec3 vector_to_world(Vec3 v) const { return is_set_ ? pose_.turned_to_world(v) : v; }

 private:
  Pose pose_;
  Vec3 velocity_, angular_velocity_;  // m/s, rad/s, in the world
  bool is_set_ = false, is_new_ = false, moves_ = false;
  [[maybe_unused]] bool unused_[5] = {};  // in the place of padding, which a saved state would hold
};

}  // namespace palpate
