#include "precompute/elements/curved_edges.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <optional>

namespace palpate {
namespace {

using Eigen::Vector3d;

constexpr double kSmooth =
    0.7071067811865476;  // cosine of 45 degrees; a surface that turns by more is meant to have an edge there

class SmoothSurface {
 public:
  SmoothSurface(std::span<const std::array<double, 3>> nodes, std::span<const std::array<std::int32_t, 3>> triangles)
      : nodes_(nodes), triangles_(triangles) {
    find_edges();
    find_normals();
  }

  std::vector<EdgeOffset> offsets() const {
    std::vector<EdgeOffset> result;
    for (const auto& edge : edges_) {
      const Vector3d offset = edge.sharp ? along_crease(edge.ends) : over_surface(edge.ends);
      result.push_back({edge.ends, {offset[0], offset[1], offset[2]}});
    }
    return result;
  }

 private:
  struct Edge {
    std::array<std::int32_t, 2> ends;
    bool sharp;
  };

  Vector3d at(std::int32_t n) const { return Vector3d(nodes_[n].data()); }
  Vector3d normal_of(const std::array<std::int32_t, 3>& t) const {
    return (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0])).normalized();
  }

  void find_edges() {
    struct Side {
      std::array<std::int32_t, 2> ends;
      std::size_t triangle;
    };
    std::vector<Side> sides;
    for (std::size_t t = 0; t < triangles_.size(); ++t)
      for (std::size_t i = 0; i < 3; ++i) {
        const auto [a, b] = std::minmax(triangles_[t][i], triangles_[t][(i + 1) % 3]);
        sides.push_back({{a, b}, t});
      }
    std::stable_sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) { return a.ends < b.ends; });
    for (std::size_t from = 0, to = 0; from < sides.size(); from = to) {
      while (to < sides.size() && sides[to].ends == sides[from].ends) ++to;
      const bool smooth =
          to - from == 2 &&
          normal_of(triangles_[sides[from].triangle]).dot(normal_of(triangles_[sides[from + 1].triangle])) > kSmooth;
      const auto ends = sides[from].ends;
      edges_.push_back({ends, !smooth});
      if (!smooth) sharp_at_[ends[0]].push_back(ends[1]), sharp_at_[ends[1]].push_back(ends[0]);
    }
  }

  void find_normals() {
    normal_.assign(nodes_.size(), Vector3d::Zero());
    for (const auto& t : triangles_)
      for (std::size_t i = 0; i < 3; ++i) {
        const Vector3d a = at(t[(i + 1) % 3]) - at(t[i]), b = at(t[(i + 2) % 3]) - at(t[i]);
        normal_[t[i]] += a.cross(b) / (a.squaredNorm() * b.squaredNorm());
      }
    for (auto& n : normal_) n.normalize();  // zero stays zero
  }

  // At vertex n of a line of sharp edges: the tangent, towards `to`, of the circle through n and its two neighbours on
  // the line. None at the ends and corners of the line and where several lines meet.
  std::optional<Vector3d> tangent(std::int32_t n, std::int32_t to) const {
    const auto& neighbours = sharp_at_.at(n);
    if (neighbours.size() != 2) return {};
    const std::int32_t from = neighbours[0] == to ? neighbours[1] : neighbours[0];
    const Vector3d before = at(n) - at(from), after = at(to) - at(n);
    if (before.normalized().dot(after.normalized()) < kSmooth) return {};
    return (before / before.squaredNorm() + after / after.squaredNorm()).normalized();
  }

  // The middle of the cubic with the tangents of both ends; where only one end has a tangent, of the parabola.
  Vector3d along_crease(const std::array<std::int32_t, 2>& ends) const {
    const Vector3d chord = at(ends[1]) - at(ends[0]), direction = chord.normalized();
    const auto first = tangent(ends[0], ends[1]);
    auto second = tangent(ends[1], ends[0]);
    if (second) *second = -*second;
    if (first && second) return chord.norm() / 8 * (*first - *second);
    if (first) return chord.norm() / 4 * (*first - direction);
    if (second) return chord.norm() / 4 * (direction - *second);
    return Vector3d::Zero();
  }

  // The same on a smooth part of the surface. At a vertex on a sharp edge there is no one normal, so that end has none.
  Vector3d over_surface(const std::array<std::int32_t, 2>& ends) const {
    const Vector3d chord = at(ends[1]) - at(ends[0]);
    const auto dip = [&](std::int32_t n) { return Vector3d(chord.dot(normal_[n]) * normal_[n]); };
    const bool first = !sharp_at_.count(ends[0]), second = !sharp_at_.count(ends[1]);
    if (first && second) return (dip(ends[1]) - dip(ends[0])) / 8;
    if (first) return -dip(ends[0]) / 4;
    if (second) return dip(ends[1]) / 4;
    return Vector3d::Zero();
  }

  std::span<const std::array<double, 3>> nodes_;
  std::span<const std::array<std::int32_t, 3>> triangles_;
  std::vector<Edge> edges_;
  std::map<std::int32_t, std::vector<std::int32_t>>
      sharp_at_;  // for each vertex on sharp edges: the other ends of those edges
  std::vector<Vector3d> normal_;
};

}  // namespace

std::vector<EdgeOffset> surface_edge_offsets(std::span<const std::array<double, 3>> nodes,
                                             std::span<const std::array<std::int32_t, 3>> triangles) {
  return SmoothSurface(nodes, triangles).offsets();
}

}  // namespace palpate
