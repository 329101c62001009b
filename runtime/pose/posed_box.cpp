// How two bodies move against one another, and whether their boxes are apart. In a source of its own: hosts of the core alone do not need it.
#include <algorithm>
#include <cmath>

#include "runtime/pose/pose.h"

namespace palpate {

bool same_pose(const Pose& a, const Pose& b) {
  const Vec3 &p = a.position, &q = b.position;
  bool same = p.x == q.x && p.y == q.y && p.z == q.z;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) same = same && a.axes.m[i][j] == b.axes.m[i][j];
  return same;
}

// The difference of two ways of a rigid body is longest at a corner.
double longest_way(const Pose& a_before, const Pose& b_before, const PosedBox& a, const Pose& b) {
  double longest = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 p = {corner & 1 ? a.high.x : a.low.x, corner & 2 ? a.high.y : a.low.y, corner & 4 ? a.high.z : a.low.z};
    longest = std::max(longest, length(b.to_body(a.pose.to_world(p)) - b_before.to_body(a_before.to_world(p))));
  }
  return longest;
}

bool are_apart(const PosedBox& a, const PosedBox& b, double room) {
  const Vec3 half = 0.5 * (a.high - a.low);
  const Vec3 middle = b.pose.to_body(a.pose.to_world(0.5 * (a.low + a.high)));
  Vec3 extent;
  for (int j = 0; j < 3; ++j) {
    const Vec3 axis =
        b.pose.turned_to_body(a.pose.turned_to_world({j == 0 ? 1.0 : 0, j == 1 ? 1.0 : 0, j == 2 ? 1.0 : 0}));
    for (int i = 0; i < 3; ++i) extent[i] += std::fabs(axis[i]) * half[j];
  }
  for (int i = 0; i < 3; ++i)
    if (middle[i] - extent[i] - room > b.high[i] || middle[i] + extent[i] + room < b.low[i]) return true;
  return false;
}

}  // namespace palpate
