#include "meshing/tetrahedra/triangle_crossings.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/box_intersection_d.h>

#include <algorithm>

namespace palpate {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point3 = Kernel::Point_3;
using TriangleBox = CGAL::Box_intersection_d::Box_with_info_d<double, 3, std::size_t>;

// A triangle with the corners that it shares with another one first.
struct Sorted {
  Triangle corners;
  int shared = 0;
};

Sorted shared_first(const Triangle& t, const Triangle& other) {
  Sorted sorted{t};
  for (int i = 0; i < 3; ++i)
    if (std::find(other.begin(), other.end(), t[i]) != other.end())
      std::swap(sorted.corners[sorted.shared++], *std::find(sorted.corners.begin(), sorted.corners.end(), t[i]));
  return sorted;
}

class Crossings {
 public:
  explicit Crossings(const std::vector<Point>& points) {
    points_.reserve(points.size());
    for (const auto& [x, y, z] : points) points_.emplace_back(x, y, z);
  }

  bool cross(const Triangle& one, const Triangle& two) const {
    const Sorted a = shared_first(one, two);
    const Triangle& p = a.corners;
    if (a.shared == 0) return CGAL::do_intersect(triangle(one), triangle(two));
    const Triangle q = shared_first(two, one).corners;
    if (a.shared ==
        1)  // beyond the shared corner the triangles meet only where an opposite edge meets the other triangle
      return CGAL::do_intersect(segment(p[1], p[2]), triangle(two)) ||
             CGAL::do_intersect(segment(q[1], q[2]), triangle(one));
    const auto &u = points_[p[0]], &v = points_[p[1]], &w = points_[p[2]], &x = points_[q[2]];
    return a.shared == 3 || (CGAL::coplanar(u, v, w, x) && CGAL::coplanar_orientation(u, v, w, x) == CGAL::POSITIVE);
  }

  CGAL::Bbox_3 box(const Triangle& t) const {
    return points_[t[0]].bbox() + points_[t[1]].bbox() + points_[t[2]].bbox();
  }

 private:
  Kernel::Triangle_3 triangle(const Triangle& t) const { return {points_[t[0]], points_[t[1]], points_[t[2]]}; }
  Kernel::Segment_3 segment(std::int32_t a, std::int32_t b) const { return {points_[a], points_[b]}; }
  std::vector<Point3> points_;
};

}  // namespace

std::optional<Point> first_crossing(const std::vector<Point>& points, const std::vector<Triangle>& triangles) {
  const Crossings crossings(points);
  std::vector<TriangleBox> boxes;
  boxes.reserve(triangles.size());
  for (std::size_t t = 0; t < triangles.size(); ++t) boxes.emplace_back(crossings.box(triangles[t]), t);
  std::size_t first = triangles.size();  // the order in which CGAL reports the pairs is not that of the triangles
  CGAL::box_self_intersection_d(boxes.begin(), boxes.end(), [&](const TriangleBox& a, const TriangleBox& b) {
    const std::size_t lower = std::min(a.info(), b.info());
    if (lower < first && crossings.cross(triangles[a.info()], triangles[b.info()])) first = lower;
  });
  if (first == triangles.size()) return {};
  const auto& [a, b, c] = triangles[first];
  return (1.0 / 3) * (points[a] + points[b] + points[c]);
}

}  // namespace palpate
