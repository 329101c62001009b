#include "runtime/contact/far_tools.h"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

struct Box {
  Vec3 low, high;
};

// The box, along the organ's axes, around a box of the world.
Box in_organ(const Pose& pose, Vec3 low, Vec3 high) {
  const Vec3 middle = pose.to_body(0.5 * (low + high)), half = 0.5 * (high - low);
  Vec3 reach;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) reach[i] += std::fabs(pose.axes.m[j][i]) * half[j];
  return {middle - reach, middle + reach};
}

// m: how far the point of the world moves in the organ's frame between two poses, wherever it is within `reach` of the first one.
double largest_turn(const Pose& before, const Pose& now, double reach) {
  double squares = 0;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const double change = now.axes.m[i][j] - before.axes.m[i][j];
      squares += change * change;
    }
  return length(now.position - before.position) + std::sqrt(squares) * reach;
}

}  // namespace

bool is_far(const ToolInWorld& tool, const DeformedSurface& surface, const OrganPose& organ, const FarTools& last,
            double farthest) {
  if (tool.point_count == 0) return false;
  Box swept = {tool.low, tool.high}, before = {tool.low_before, tool.high_before};
  double moved = tool.moved, size = length(tool.low) + length(tool.high);
  if (organ.is_set()) {
    const Pose& now = organ.pose();
    swept = in_organ(now, tool.low, tool.high);
    size += 2 * length(now.position);
  }
  if (last.is_posed) {
    before = in_organ(last.pose, tool.low_before, tool.high_before);
    size += 2 * length(last.pose.position);
  }
  if (organ.is_set() || last.is_posed) {
    const Pose rest, &then = last.is_posed ? last.pose : rest, &now = organ.is_set() ? organ.pose() : rest;
    moved += largest_turn(then, now, length(tool.low - then.position) + length(tool.high - then.position));
  }
  if (tool.before_count > 0) {
    if (!(moved <= farthest)) return false;
    for (int i = 0; i < 3; ++i)
      swept.low[i] = std::min(swept.low[i], before.low[i]), swept.high[i] = std::max(swept.high[i], before.high[i]);
  }
  return !surface.may_hold(swept.low, swept.high, 1e-14 * size);
}

}  // namespace palpate
