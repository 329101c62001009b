#include "programs/player/obstacle_surface.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "meshing/surface/surface_file.h"
#include "programs/player/tool_points.h"
#include "programs/player/tool_turn.h"

namespace palpate {
namespace {

using Vector = SceneConfig::Vector;
using Kind = SceneConfig::Obstacle::Kind;

// A flat surface across z, as a fan of its rim's corners.
RenderMesh fan(const std::vector<std::array<double, 2>>& rim) {
  RenderMesh mesh;
  for (const auto& [x, y] : rim)
    mesh.positions.insert(mesh.positions.end(), {static_cast<float>(x), static_cast<float>(y), 0.0F});
  for (std::uint32_t c = 2; c < rim.size(); ++c) mesh.indices.insert(mesh.indices.end(), {0, c - 1, c});
  return mesh;
}

RenderMesh without_normals(const SceneConfig::Obstacle& obstacle) {
  if (obstacle.kind == Kind::rectangle) {
    const double x = obstacle.size[0] / 2, y = obstacle.size[1] / 2;
    return fan({{-x, -y}, {x, -y}, {x, y}, {-x, y}});
  }
  if (obstacle.kind == Kind::disc) {
    constexpr int kCorners = 48;
    std::vector<std::array<double, 2>> rim;
    for (int c = 0; c < kCorners; ++c) {
      const double angle = 2 * std::numbers::pi * c / kCorners;
      rim.push_back({obstacle.size[0] * std::cos(angle), obstacle.size[0] * std::sin(angle)});
    }
    return fan(rim);
  }
  const TriangleSurface read = read_surface(obstacle.surface->file, obstacle.surface->metres_per_unit);
  RenderMesh mesh;
  for (const auto& point : read.points)
    for (const double x : point) mesh.positions.push_back(static_cast<float>(x));
  for (const auto& triangle : read.triangles) mesh.indices.insert(mesh.indices.end(), triangle.begin(), triangle.end());
  return mesh;
}

// The shortest turn that takes z to a direction; half a turn about x where that is -z.
Rotation turn_of_normal(const Vector& direction) {
  const double length =
      std::sqrt(direction[0] * direction[0] + direction[1] * direction[1] + direction[2] * direction[2]);
  const double x = direction[0] / length, y = direction[1] / length, z = direction[2] / length;
  if (z <= -1 + 1e-12) return {{{1, 0, 0}, {0, -1, 0}, {0, 0, -1}}};
  const double share = 1 / (1 + z);
  return {{{1 - x * x * share, -x * y * share, x}, {-x * y * share, 1 - y * y * share, y}, {-x, -y, z}}};
}

Rotation product(const Rotation& a, const Rotation& b) {
  Rotation result{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      for (std::size_t k = 0; k < 3; ++k) result[i][j] += a[i][k] * b[k][j];
  return result;
}

}  // namespace

RenderMesh surface_of(const SceneConfig::Obstacle& obstacle) {
  RenderMesh mesh = without_normals(obstacle);
  mesh.normals = smooth_normals(mesh.positions, mesh.indices);
  return mesh;
}

palpate_pose pose_at(const SceneConfig::Obstacle& obstacle, double time) {
  palpate_pose pose = palpate_default_pose();
  const Vector position = position_at(obstacle.path, time);
  std::copy(position.begin(), position.end(), pose.position);
  const std::array<double, 4> orientation =
      quaternion_of(product(turn_at(obstacle.turn, time), turn_of_normal(obstacle.normal)));
  std::copy(orientation.begin(), orientation.end(), pose.orientation);
  return pose;
}

}  // namespace palpate
