#include "studies/validation/shapes.h"

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <numbers>

#include "studies/bodies/box_mesh.h"
#include "studies/bodies/layered_tetrahedra.h"

namespace palpate::validation {
namespace {

double squared(double x) {
  return x * x;
}

void name_one_region(TetrahedralMesh& mesh, const char* name) {
  mesh.region.assign(mesh.tetrahedra.size(), 0);
  mesh.region_names = {name};
}

// Moves the node (i, j) of a square grid to the circle of the radius that belongs to max(i, j), and to the height z.
template <class Radius>
void bend_to_circle(std::array<double, 3>& p, const Radius& radius, double z) {
  const double i = std::round(p[0]), j = std::round(p[1]), ring = std::max(i, j), r = radius(ring);
  const double angle = ring == 0 ? 0 : std::numbers::pi / 4 * (i >= j ? j / i : 2 - i / j);
  p = {i == 0 ? 0 : r * std::cos(angle), j == 0 ? 0 : r * std::sin(angle), z};
}

}  // namespace

TetrahedralMesh shell_octant(double a, double b, int n, int layers) {
  if (layers == 0) layers = n;
  using Eigen::Vector3d;
  TetrahedralMesh mesh;
  std::vector<Vector3d> directions;
  std::vector<std::array<std::int32_t, 3>> triangles;
  const auto node = [n](int i, int j) { return i * (n + 1) - i * (i - 1) / 2 + j; };  // i + j <= n
  for (int i = 0; i <= n; ++i)
    for (int j = 0; i + j <= n; ++j) {
      directions.push_back(Vector3d(i, j, n - i - j).normalized());
      if (i + j < n) triangles.push_back({node(i, j), node(i + 1, j), node(i, j + 1)});
      if (i + j < n - 1) triangles.push_back({node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)});
    }
  const auto count = static_cast<std::int32_t>(directions.size());
  for (int layer = 0; layer <= layers; ++layer)
    for (const auto& direction : directions) {
      const Vector3d p = a * std::pow(b / a, static_cast<double>(layer) / layers) * direction;
      mesh.nodes.push_back({p[0], p[1], p[2]});
    }
  fill_layers(triangles, count, layers, mesh);
  name_one_region(mesh, "shell");
  return mesh;
}

TetrahedralMesh cylinder_mesh(double radius, double height, int rings, int layers) {
  TetrahedralMesh mesh;
  std::vector<std::array<std::int32_t, 3>> triangles;
  std::vector<std::array<double, 2>> disc = {{0, 0}};
  std::vector<std::int32_t> first = {0};
  for (int ring = 1; ring <= rings; ++ring) {  // 6 r points on ring r
    first.push_back(static_cast<std::int32_t>(disc.size()));
    for (int i = 0; i < 6 * ring; ++i) {
      const double angle = 2 * std::numbers::pi * i / (6 * ring), r = radius * ring / rings;
      disc.push_back({r * std::cos(angle), r * std::sin(angle)});
    }
  }
  for (int ring = 1; ring <= rings; ++ring)
    for (int sector = 0; sector < 6; ++sector)
      for (int i = 0; i < ring; ++i) {
        const auto outer = [&](int k) { return first[ring] + (sector * ring + k) % (6 * ring); };
        const auto inner = [&](int k) {
          return ring == 1 ? 0 : first[ring - 1] + (sector * (ring - 1) + k) % (6 * (ring - 1));
        };
        triangles.push_back({outer(i), outer(i + 1), inner(i)});
        if (i + 1 < ring) triangles.push_back({inner(i), outer(i + 1), inner(i + 1)});
      }
  const auto count = static_cast<std::int32_t>(disc.size());
  for (int layer = 0; layer <= layers; ++layer)
    for (const auto& p : disc) mesh.nodes.push_back({p[0], p[1], height * layer / layers});
  fill_layers(triangles, count, layers, mesh);
  name_one_region(mesh, "brain");
  return mesh;
}

TetrahedralMesh quarter_cylinder(double radius, double height, int n, int layers) {
  TetrahedralMesh mesh = box_mesh({n, n, layers}, {1.0 * n, 1.0 * n, height});
  for (auto& p : mesh.nodes)
    bend_to_circle(
        p, [&](double ring) { return radius * ring / n; }, p[2]);
  return mesh;
}

TetrahedralMesh indented_quarter(double a, int n, TowardsEdge cells) {
  TetrahedralMesh mesh = box_mesh({3 * n, 3 * n, 2 * n}, {3.0 * n, 3.0 * n, 2.0 * n});
  const bool even = cells == TowardsEdge::even;
  // In radii; t runs from 0 at the edge, or at the top, to 1 at the far end.
  const auto under = [&](double t) { return even ? t : 1 - squared(1 - t); };
  const auto beyond = [&](double t) { return even ? 1 + 2 * t + 2 * t * t : 1 + 4 * squared(t); };
  const auto deep = [&](double t) { return even ? 2 * t + 3 * t * t : 5 * squared(t); };
  for (auto& p : mesh.nodes)
    bend_to_circle(
        p, [&](double ring) { return a * (ring <= n ? under(ring / n) : beyond((ring - n) / (2 * n))); },
        a * deep(std::round(p[2]) / (2 * n)));
  return mesh;
}

TetrahedralMesh elliptic_plate(int n) {
  TetrahedralMesh mesh = box_mesh({2 * n, 3 * n, n}, {1, 1, kPlateThickness});
  for (auto& p : mesh.nodes) {
    const double s = std::pow(p[0], 1.5);  // smaller cells at the inner edge, where the stress is asked for
    const double t = std::numbers::pi / 2 * p[1], c = p[1] == 1 ? 0 : std::cos(t), q = std::sin(t);
    p = {((1 - s) * 2 + s * 3.25) * c, ((1 - s) * 1 + s * 2.75) * q, p[2]};
  }
  return mesh;
}

TetrahedralMesh cook_membrane(int n) {
  TetrahedralMesh mesh = box_mesh({n, n, 1}, {1, 1, 0.001});
  for (auto& p : mesh.nodes) p = {0.048 * p[0], 0.044 * p[0] + (0.044 - 0.028 * p[0]) * p[1], p[2]};
  return mesh;
}

}  // namespace palpate::validation
