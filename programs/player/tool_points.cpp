#include "programs/player/tool_points.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace palpate {
namespace {

using Vector = SceneConfig::Vector;

// Two unit vectors orthogonal to a unit axis and to each other.
std::pair<Vector, Vector> orthogonal_pair(const Vector& axis) {
  Vector other{};
  const auto smallest =
      std::min_element(axis.begin(), axis.end(), [](double a, double b) { return std::abs(a) < std::abs(b); });
  other[static_cast<std::size_t>(smallest - axis.begin())] = 1;
  const auto cross = [](const Vector& a, const Vector& b) {
    return Vector{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  };
  Vector u = cross(axis, other);
  const double norm = std::hypot(u[0], u[1], u[2]);
  for (double& x : u) x /= norm;
  return {u, cross(axis, u)};
}

// Distance of the skin from the axis at an axial height; 0 is the centre of the first cap.
double skin_radius(const SceneConfig::Capsule& capsule, double height) {
  const double beyond = height < 0 ? height : std::max(0.0, height - capsule.length);
  return std::sqrt(std::max(0.0, capsule.radius * capsule.radius - beyond * beyond));
}

}  // namespace

std::vector<Vector> sample_capsule(const SceneConfig::Capsule& capsule) {
  const double golden_angle = std::numbers::pi * (3 - std::sqrt(5.0));
  const auto [u, v] = orthogonal_pair(capsule.axis);
  std::vector<Vector> points;
  for (int i = 0; i < capsule.samples; ++i) {
    const double height = -capsule.radius + (capsule.length + 2 * capsule.radius) * i / (capsule.samples - 1);
    const double radius = skin_radius(capsule, height);
    const double angle = golden_angle * i;
    Vector p{};
    for (int d = 0; d < 3; ++d)
      p[d] = height * capsule.axis[d] + radius * (std::cos(angle) * u[d] + std::sin(angle) * v[d]);
    points.push_back(p);
  }
  return points;
}

std::vector<Vector> tool_points(const SceneConfig::Tool& tool) {
  std::vector<Vector> points = tool.points;
  if (tool.capsule) {
    const auto skin = sample_capsule(*tool.capsule);
    points.insert(points.end(), skin.begin(), skin.end());
  }
  return points;
}

bool is_away(const SceneConfig::Tool& tool, double time) {
  return std::any_of(tool.away.begin(), tool.away.end(),
                     [time](const auto& row) { return row[0] <= time && time < row[1]; });
}

Vector position_at(const std::vector<SceneConfig::KeyFrame>& path, double time) {
  const auto after =
      std::upper_bound(path.begin(), path.end(), time, [](double t, const auto& frame) { return t < frame.time; });
  if (after == path.begin()) return path.front().position;
  if (after == path.end()) return path.back().position;
  const auto& before = *(after - 1);
  if (time == before.time) return before.position;  // to the bit: a record has a key frame at every touch
  const double share = (time - before.time) / (after->time - before.time);
  Vector position{};
  for (int d = 0; d < 3; ++d) position[d] = before.position[d] + share * (after->position[d] - before.position[d]);
  return position;
}

}  // namespace palpate
