#include "meshing/tetrahedra/move_to_volumes.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>

#include "meshing/surface/triangle_surface.h"
#include "meshing/tetrahedra/mesh_report.h"
#include "meshing/tetrahedra/triangle_crossings.h"

namespace palpate {
namespace {

double length(const Point& p) {
  return std::sqrt(dot(p, p));
}

Point area_vector(const std::vector<Point>& points, const Triangle& t) {
  return 0.5 * cross(points[t[1]] - points[t[0]], points[t[2]] - points[t[0]]);
}

// The gradient of a region's volume by the place of a point: a third of the outward area vectors of the triangles there.
struct Gradients {
  struct Part {
    std::int32_t region;
    Point gradient;
  };
  std::vector<std::vector<Part>> of_point;
  std::vector<double> area;  // [points] a third of its triangles'
};

void add_part(std::vector<Gradients::Part>& parts, std::int32_t region, const Point& gradient) {
  const auto found = std::find_if(parts.begin(), parts.end(), [&](const auto& p) { return p.region == region; });
  if (found == parts.end())
    parts.push_back({region, gradient});
  else
    found->gradient = found->gradient + gradient;
}

Gradients gradients_of(const VolumeBoundary& boundary) {
  Gradients g;
  g.of_point.resize(boundary.points.size());
  g.area.resize(boundary.points.size(), 0.0);
  for (const auto& patch : boundary.patches)
    for (const Triangle& t : patch.triangles) {
      const Point third = (1.0 / 3) * area_vector(boundary.points, t);
      for (const std::int32_t v : t) {
        g.area[v] += length(third);
        add_part(g.of_point[v], patch.behind, third);
        if (patch.ahead >= 0) add_part(g.of_point[v], patch.ahead, -1 * third);
      }
    }
  return g;
}

// One step of Newton's method; returns the distances of the regions.
Eigen::VectorXd step_to(VolumeBoundary& boundary, const Eigen::VectorXd& missing) {
  const Gradients g = gradients_of(boundary);
  Eigen::MatrixXd slope = Eigen::MatrixXd::Zero(missing.size(), missing.size());
  for (std::size_t v = 0; v < g.area.size(); ++v)
    for (const auto& one : g.of_point[v])
      for (const auto& two : g.of_point[v])
        slope(one.region, two.region) += dot(one.gradient, two.gradient) / g.area[v];
  const Eigen::VectorXd distance = slope.ldlt().solve(missing);
  for (std::size_t v = 0; v < g.area.size(); ++v)
    for (const auto& part : g.of_point[v])
      boundary.points[v] = boundary.points[v] + (distance[part.region] / g.area[v]) * part.gradient;
  return distance;
}

std::vector<double> mean_edges(const VolumeBoundary& boundary) {
  std::vector<double> sum(boundary.points.size(), 0.0), count(boundary.points.size(), 0.0);
  for (const auto& patch : boundary.patches)
    for (const Triangle& t : patch.triangles)
      for (int i = 0; i < 3; ++i)
        for (const std::int32_t v : {t[i], t[(i + 1) % 3]}) {
          sum[v] += length(boundary.points[t[i]] - boundary.points[t[(i + 1) % 3]]);
          count[v] += 1;
        }
  for (std::size_t v = 0; v < sum.size(); ++v) sum[v] /= std::max(count[v], 1.0);
  return sum;
}

bool keeps_shape(const VolumeBoundary& before, const VolumeBoundary& after) {
  constexpr double kMostMove = 0.5, kLeastCosine = 0.5;
  const std::vector<double> edges = mean_edges(before);
  for (std::size_t v = 0; v < edges.size(); ++v)
    if (!(length(after.points[v] - before.points[v]) <= kMostMove * edges[v])) return false;
  std::vector<Triangle> all;
  for (const auto& patch : after.patches)
    for (const Triangle& t : patch.triangles) {
      const Point was = area_vector(before.points, t), is = area_vector(after.points, t);
      if (!(dot(was, is) > kLeastCosine * length(was) * length(is))) return false;
      all.push_back(t);
    }
  return !first_crossing(after.points, all);
}

std::optional<Eigen::VectorXd> moved_to(VolumeBoundary& boundary, const Eigen::VectorXd& wanted) {
  constexpr int kSteps = 20;
  constexpr double kClose = 1e-9;  // of a volume
  Eigen::VectorXd distance = Eigen::VectorXd::Zero(wanted.size());
  for (int step = 0; step < kSteps; ++step) {
    const std::vector<double> volumes = enclosed_volumes(boundary);
    const Eigen::VectorXd missing =
        wanted - Eigen::Map<const Eigen::VectorXd>(volumes.data(), static_cast<Eigen::Index>(volumes.size()));
    if ((missing.array().abs() <= kClose * wanted.array().abs()).all()) return distance;
    distance += step_to(boundary, missing);
    if (!distance.allFinite()) return {};
  }
  return {};
}

}  // namespace

VolumeMove move_to_volumes(VolumeBoundary& boundary, const std::vector<double>& volumes) {
  const std::vector<double> have = enclosed_volumes(boundary);
  const auto regions = static_cast<Eigen::Index>(have.size());
  const Eigen::Map<const Eigen::VectorXd> now(have.data(), regions), wanted(volumes.data(), regions);
  for (const double share : {1.0, 0.75, 0.5, 0.25}) {
    VolumeBoundary moved = boundary;
    const auto distance = moved_to(moved, now + share * (wanted - now));
    if (!distance || !keeps_shape(boundary, moved)) continue;
    boundary = std::move(moved);
    return {{distance->begin(), distance->end()}, share};
  }
  return {std::vector<double>(have.size(), 0.0), 0};
}

}  // namespace palpate
