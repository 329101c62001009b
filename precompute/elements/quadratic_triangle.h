// Integration over the curved triangles of ten-node tetrahedra: Dunavant's twelve points, and the six shape functions.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <vector>

namespace palpate {

// Of degree 6, weights positive.
struct TrianglePoint {
  std::array<double, 3> at;  // barycentric
  double weight;             // of the area
};
inline const std::vector<TrianglePoint>& triangle_points() {
  static const std::vector<TrianglePoint> points = [] {
    std::vector<TrianglePoint> all;
    const auto three = [&all](double far, double weight) {
      const double near = 1 - 2 * far;
      for (const auto& at : {std::array{near, far, far}, std::array{far, near, far}, std::array{far, far, near}})
        all.push_back({at, weight});
    };
    three(0.249286745170910421, 0.116786275726379366);
    three(0.063089014491502227, 0.050844906370206817);
    constexpr double a = 0.053145049844816947, b = 0.310352451033784405, c = 1 - a - b;
    for (const auto& at : {std::array{a, b, c}, std::array{a, c, b}, std::array{b, a, c}, std::array{b, c, a},
                           std::array{c, a, b}, std::array{c, b, a}})
      all.push_back({at, 0.082851075618373575});
    return all;
  }();
  return points;
}

// Of the nodes a b c ab bc ca: the shape functions, and their derivatives with respect to barycentric coordinates b and c.
struct TriangleShapes {
  std::array<double, 6> value, by_b, by_c;
};
inline TriangleShapes shapes_of(const std::array<double, 3>& l) {
  TriangleShapes s;
  s.value = {l[0] * (2 * l[0] - 1), l[1] * (2 * l[1] - 1), l[2] * (2 * l[2] - 1),
             4 * l[0] * l[1],       4 * l[1] * l[2],       4 * l[2] * l[0]};
  s.by_b = {1 - 4 * l[0], 4 * l[1] - 1, 0, 4 * (l[0] - l[1]), 4 * l[2], -4 * l[2]};
  s.by_c = {1 - 4 * l[0], 0, 4 * l[2] - 1, -4 * l[1], 4 * l[1], 4 * (l[0] - l[2])};
  return s;
}

// m^2: twice the area vector per area of the reference triangle, at the place of the shapes. corner(i): m, of nodes 0 .. 5.
template <class Corner>
Eigen::Vector3d twice_area(const TriangleShapes& s, Corner corner) {
  const Eigen::Vector3d origin = corner(0);
  Eigen::Vector3d along_b = Eigen::Vector3d::Zero(), along_c = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < 6; ++i) {
    const Eigen::Vector3d p = corner(i) - origin;
    along_b += s.by_b[i] * p, along_c += s.by_c[i] * p;
  }
  return along_b.cross(along_c);
}

}  // namespace palpate
