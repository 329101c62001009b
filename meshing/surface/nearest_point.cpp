#include "meshing/surface/nearest_point.h"

#include <CGAL/AABB_face_graph_triangle_primitive.h>
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>

#include "meshing/surface/surface_mesh.h"

namespace palpate {

struct NearestPoint::Tree {
  using Primitive = CGAL::AABB_face_graph_triangle_primitive<CgalMesh>;
  CgalMesh mesh;
  CGAL::AABB_tree<CGAL::AABB_traits<CgalKernel, Primitive>> triangles;

  explicit Tree(const TriangleSurface& surface)
      : mesh(to_cgal(surface)), triangles(faces(mesh).begin(), faces(mesh).end(), mesh) {
    triangles.accelerate_distance_queries();
  }
};

NearestPoint::NearestPoint(const TriangleSurface& surface) : tree_(std::make_unique<Tree>(surface)) {}

NearestPoint::~NearestPoint() = default;

Point NearestPoint::operator()(const Point& p) const {
  const auto found = tree_->triangles.closest_point({p[0], p[1], p[2]});
  return {found.x(), found.y(), found.z()};
}

}  // namespace palpate
