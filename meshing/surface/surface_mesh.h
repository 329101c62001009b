// Converts between TriangleSurface and CGAL's mesh. Include this header in sources only: CGAL takes long to compile.
#pragma once

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>

#include <stdexcept>

#include "meshing/surface/triangle_surface.h"

namespace palpate {

using CgalKernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using CgalMesh = CGAL::Surface_mesh<CgalKernel::Point_3>;

// The surface must be an oriented manifold (else std::logic_error). Both functions keep the order of points and
// triangles. They are inline because a source of their own would take longer to compile than all their copies.
inline CgalMesh to_cgal(const TriangleSurface& surface) {
  CgalMesh mesh;
  mesh.reserve(static_cast<unsigned>(surface.points.size()), static_cast<unsigned>(surface.triangles.size() * 3 / 2),
               static_cast<unsigned>(surface.triangles.size()));
  for (const auto& [x, y, z] : surface.points) mesh.add_vertex({x, y, z});
  for (const auto& [a, b, c] : surface.triangles) {
    using Vertex = CgalMesh::Vertex_index;
    const auto face = mesh.add_face(Vertex(static_cast<unsigned>(a)), Vertex(static_cast<unsigned>(b)),
                                    Vertex(static_cast<unsigned>(c)));
    if (face == CgalMesh::null_face()) throw std::logic_error("the surface is not an oriented manifold");
  }
  return mesh;
}

inline TriangleSurface from_cgal(const CgalMesh& mesh) {
  TriangleSurface surface;
  std::vector<std::int32_t> number(mesh.number_of_vertices() + mesh.number_of_removed_vertices(), -1);
  for (const auto vertex : mesh.vertices()) {
    number[vertex] = static_cast<std::int32_t>(surface.points.size());
    const auto& p = mesh.point(vertex);
    surface.points.push_back({p.x(), p.y(), p.z()});
  }
  for (const auto face : mesh.faces()) {
    Triangle triangle{};
    int corner = 0;
    for (const auto vertex : mesh.vertices_around_face(mesh.halfedge(face))) triangle[corner++] = number[vertex];
    surface.triangles.push_back(triangle);
  }
  return surface;
}

}  // namespace palpate
