#include "runtime/surface/surface_measure.h"

#include <algorithm>

namespace palpate {
namespace {

// Linear elements lock as nu approaches 0.5: their blur grows with 1 / (1 - 2 nu). Measured up to nu = 0.49.
constexpr double kMostBlur = 1.5;
constexpr double kPi = 3.14159265358979323846;

}  // namespace

LocalCompliance local_compliance(double young, double poisson, StoredElement element) {
  LocalCompliance local;
  local.normal = (1 - poisson * poisson) / (2 * young);
  local.tangent = (2 - poisson) * (1 + poisson) / (4 * young);
  const double nu = poisson, over_modulus = (1 + nu) / (16 * kPi * young);
  local.curved = 2 * (1 + 6 * nu - 4 * nu * nu) * over_modulus;
  local.curved_trace = (5 - 10 * nu + 12 * nu * nu) * over_modulus;
  const double locking = 1 / (1 - 2 * poisson);
  switch (element) {
    case StoredElement::p1:
      local.normal_blur = std::min(kMostBlur, 0.425 + 0.0105 * locking);
      local.tangent_blur = std::min(kMostBlur, 0.56 + 0.0165 * locking);
      local.tilt_blur = {std::min(kMostBlur, 0.345 + 0.0066 * locking), 0.07};
      local.twist_blur = {std::min(kMostBlur, 0.345 + 0.0085 * locking), 0.15};
      break;
    case StoredElement::p1_anp:
      local.normal_blur = 0.34;
      local.tangent_blur = 0.46;
      local.tilt_blur = {0.25, 0.075};
      local.twist_blur = {0.29, 0.15};
      break;
    case StoredElement::
        p1_ang:  // measured: -0.03 and -0.02, turns 0.05 to 0.02 and 0.1 to 0; a disc is never narrower than itself
      local.normal_blur = 0;
      local.tangent_blur = 0;
      local.tilt_blur = {0, 0.03};
      local.twist_blur = {0, 0.07};
      break;
    case StoredElement::p2_p0:
      local.normal_blur = 0.45;
      local.tangent_blur = 0.49;
      local.tilt_blur = {0.29, 0.25};
      local.twist_blur = {0.34, 0.27};
      break;
  }
  return local;
}

void add_weighted(LocalCompliance& sum, double weight, const LocalCompliance& a) {
  sum.normal += weight * a.normal, sum.tangent += weight * a.tangent;
  sum.normal_blur += weight * a.normal_blur, sum.tangent_blur += weight * a.tangent_blur;
  sum.curved += weight * a.curved, sum.curved_trace += weight * a.curved_trace;
  sum.tilt_blur.first += weight * a.tilt_blur.first, sum.tilt_blur.second += weight * a.tilt_blur.second;
  sum.twist_blur.first += weight * a.twist_blur.first, sum.twist_blur.second += weight * a.twist_blur.second;
}

bool SurfaceMeasure::build(SceneMemory& memory, const double* position, std::int32_t nodes,
                           const std::int32_t* triangles, std::int32_t triangle_count, const std::uint8_t* active) {
  position_ = position, triangles_ = triangles, nodes_ = nodes;
  outward_ = memory.array<Vec3>(static_cast<std::size_t>(nodes));
  spacing_ = memory.array<double>(static_cast<std::size_t>(nodes));
  curvature_ = memory.array<Mat3>(static_cast<std::size_t>(nodes));
  if (memory.failed()) return false;
  const auto for_each = [&](auto visit) {
    for (std::int32_t t = 0; t < triangle_count; ++t)
      if (!active || active[t]) visit(t, triangles + 3 * static_cast<std::size_t>(t));
  };
  for_each([&](std::int32_t t, const std::int32_t* corner) {
    const Vec3 twice = twice_area(t);
    for (int v = 0; v < 3; ++v) add_area(corner[v], twice);
  });
  for (std::int32_t n = 0; n < nodes; ++n) end_area(n);
  for_each([&](std::int32_t t, const std::int32_t* corner) {
    const Mat3 turn = turn_of(t);
    for (int v = 0; v < 3; ++v) add_scaled(curvature_[corner[v]], 1, turn);
  });
  for (std::int32_t n = 0; n < nodes; ++n) end_curvature(n);
  return true;
}

Vec3 SurfaceMeasure::edge(std::int32_t triangle, int from, int to) const {
  const auto at = [&](int v) {
    return load3(position_ + 3 * static_cast<std::size_t>(triangles_[3 * static_cast<std::size_t>(triangle) + v]));
  };
  return at(to) - at(from);
}

Vec3 SurfaceMeasure::twice_area(std::int32_t triangle) const {
  return cross(edge(triangle, 0, 1), edge(triangle, 0, 2));
}

void SurfaceMeasure::add_area(std::int32_t node, Vec3 twice_area) {
  outward_[node] += twice_area;
  spacing_[node] += length(twice_area) / 6;
}

void SurfaceMeasure::end_area(std::int32_t node) {
  outward_[node] = unit_or_zero(outward_[node]);
  spacing_[node] = std::sqrt(spacing_[node]);
}

// The gradient of the normal times the area.
Mat3 SurfaceMeasure::turn_of(std::int32_t triangle) const {
  const Vec3 up = unit_or_zero(twice_area(triangle));
  Mat3 turn;
  for (int v = 0; v < 3; ++v) {
    const Vec3 normal = outward_[triangles_[3 * static_cast<std::size_t>(triangle) + v]],
               rise = cross(up, edge(triangle, (v + 1) % 3, (v + 2) % 3));
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) turn.m[i][j] += 0.25 * (normal[i] * rise[j] + normal[j] * rise[i]);
  }
  return turn;
}

void SurfaceMeasure::end_curvature(std::int32_t node) {
  const double area = 3 * spacing_[node] * spacing_[node];
  Mat3 along, sum;  // projection on the tangent plane
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) along.m[i][j] = (i == j) - outward_[node][i] * outward_[node][j];
  if (area > 0) add_scaled(sum, 1 / area, along * curvature_[node] * along);
  curvature_[node] = sum;
}

LocalCompliance* SurfaceMeasure::tissue_of_nodes(SceneMemory& memory) {
  return of_node_ = memory.array<LocalCompliance>(static_cast<std::size_t>(nodes_));
}

Vec3 SurfaceMeasure::outward(const SurfacePoint& surface_point) const {
  Vec3 sum;
  for (int v = 0; v < 3; ++v)
    sum += surface_point.barycentric[v] * outward_[triangles_[3 * surface_point.triangle + v]];
  return unit_or_zero(sum);
}

double SurfaceMeasure::spacing(const SurfacePoint& surface_point) const {
  double sum = 0;
  for (int v = 0; v < 3; ++v)
    sum += surface_point.barycentric[v] * spacing_[triangles_[3 * surface_point.triangle + v]];
  return sum;
}

LocalCompliance SurfaceMeasure::tissue(const SurfacePoint& surface_point) const {
  if (!of_node_) return everywhere_;
  LocalCompliance sum;
  for (int v = 0; v < 3; ++v) {
    const LocalCompliance& node = of_node_[triangles_[3 * surface_point.triangle + v]];
    add_weighted(sum, surface_point.barycentric[v], node);
  }
  return sum;
}

}  // namespace palpate
