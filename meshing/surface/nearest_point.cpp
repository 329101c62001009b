#include "meshing/surface/nearest_point.h"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <vector>

namespace palpate {

struct NearestPoint::Tree {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  using Primitive = CGAL::AABB_triangle_primitive<Kernel, std::vector<Kernel::Triangle_3>::const_iterator>;
  std::vector<Kernel::Triangle_3> triangles;
  CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>> tree;

  explicit Tree(const TriangleSurface& surface) {
    const auto corner = [&](std::int32_t p) {
      return Kernel::Point_3(surface.points[p][0], surface.points[p][1], surface.points[p][2]);
    };
    for (const auto& [a, b, c] : surface.triangles) {
      const Kernel::Triangle_3 triangle(corner(a), corner(b), corner(c));
      if (!triangle.is_degenerate()) triangles.push_back(triangle);  // CGAL's distance wants a plane
    }
    tree.insert(triangles.begin(), triangles.end());
    tree.accelerate_distance_queries();
  }
};

NearestPoint::NearestPoint(const TriangleSurface& surface) : tree_(std::make_unique<Tree>(surface)) {}

NearestPoint::~NearestPoint() = default;

Point NearestPoint::operator()(const Point& p) const {
  const auto found = tree_->tree.closest_point({p[0], p[1], p[2]});
  return {found.x(), found.y(), found.z()};
}

}  // namespace palpate
