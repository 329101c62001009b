// Another surface that tools meet in place of the mesh's own. Each of its vertices is bound once to a point of the mesh's surface and
// moves with the nodes around it. A module fills in the data (a class that derives from this one).
//
// With w the barycentric weights of that point, o the vertex' offset from it and H the displacement gradient there, a vertex moves by
//     u = sum_i w_i u_i + shortened(o + H o) - o.
// H is the gradient of the triangles around the three nodes, averaged over the nodes, but linear in the displacements:
// across a triangle's plane the normal turns by -(gradient)^T n. "Shortened" gives a vector that is longer than o the length of o. A
// turn of o would lengthen it, and a displacement along the normal has then, however steep, the normal of the moved triangles.
// Shortening brings no two vectors farther apart, so |u(a) - u(b)| is bounded by sum_i w_i |a_i - b_i| + sum_j |M_j| |a_j - b_j|, with
// H o = sum_j M_j u_j: the bounds of a SurfaceTree over the mesh's nodes hold for the vertices, too (reach).
#pragma once

#include <cstdint>

#include "runtime/base/step_work.h"
#include "runtime/surface/surface_index.h"
#include "runtime/surface/surface_tree.h"

namespace palpate {

class BoundSurface {
 public:
  std::int32_t vertex_count() const { return vertex_count_; }
  std::int32_t triangle_count() const { return triangle_count_; }
  const double* rest() const { return rest_; }                  // [vertex_count][3] m, preload included
  const std::int32_t* triangles() const { return triangles_; }  // [triangle_count][3]
  std::uint64_t identity() const { return identity_; }          // checksum of what the host gave

  // m, of a vertex. at(node): displacement of a node of the mesh.
  template <class At>
  Vec3 displacement(std::int32_t vertex, At at) const;
  // Calls visit(node) for the nodes that displacement() asks for.
  template <class Visit>
  void nodes_of(std::int32_t vertex, Visit visit) const;
  Operations cost(std::int32_t vertex) const { return 12 + 6 * vertices_[vertex].turns; }
  // m / sqrt(J), as surface_tree.h explains. of_node: [node_count], those of the mesh.
  double reach(std::int32_t vertex, const double* of_node) const;

  // The point of the mesh's surface that lies below a point of this one: it moves continuously with it. Any thread may call it.
  // Cost: nanoseconds where the triangle is bound to one triangle of the mesh, else about a microsecond.
  SurfacePoint beneath(const SurfacePoint& point) const;

  // The outward unit normal at rest: interpolated between the triangle's vertices; its mean over a disc of that radius (m), which
  // for the radius 0 is the former. tree: of this surface. Cost of the mean: some twenty nanoseconds for each triangle below the disc.
  Vec3 outward(const SurfacePoint& point) const;
  Vec3 outward(const SurfacePoint& point, double radius, const SurfaceTree& tree, Operations* work) const;
  SurfaceIndex& index() { return index_; }  // this surface at rest, for the touch half alone

 protected:
  struct Vertex {
    std::int32_t triangle;      // of the mesh
    std::int32_t first, turns;  // its turns, in turns_
    std::int32_t unused;
    double weight[3];  // barycentric
    Vec3 offset;       // m
  };
  // The part M_j of a node in H o.
  struct Turn {
    std::int32_t node;
    float m[3][3];
  };
  const std::int32_t* mesh_corners(std::int32_t triangle) const {
    return mesh_triangles_ + 3 * static_cast<std::size_t>(triangle);
  }
  const std::int32_t* corners(std::int32_t triangle) const {
    return triangles_ + 3 * static_cast<std::size_t>(triangle);
  }
  Vec3 mesh_at_rest(std::int32_t node) const { return load3(mesh_rest_ + 3 * static_cast<std::size_t>(node)); }
  std::int32_t vertex_count_ = 0, triangle_count_ = 0;
  double* rest_ = nullptr;             // [vertex_count][3] m
  std::int32_t* triangles_ = nullptr;  // [triangle_count][3]
  Vertex* vertices_ = nullptr;         // [vertex_count]
  Turn* turns_ = nullptr;
  Vec3* area_ = nullptr;               // [vertex_count] m^2, of the vertex' share of the surface, along its normal
  std::int32_t* fan_start_ = nullptr;  // [mesh nodes + 1] into fan_
  std::int32_t* fan_ = nullptr;        // the mesh's triangles around each of its nodes
  const std::int32_t* mesh_triangles_ = nullptr;
  const double* mesh_rest_ = nullptr;
  SurfaceIndex index_;
  std::uint64_t identity_ = 0;
};

template <class At>
Vec3 BoundSurface::displacement(std::int32_t vertex, At at) const {
  const Vertex& bound = vertices_[vertex];
  const std::int32_t* node = mesh_corners(bound.triangle);
  Vec3 u;
  for (int i = 0; i < 3; ++i)
    if (bound.weight[i] != 0) u += bound.weight[i] * at(node[i]);
  if (bound.turns == 0) return u;
  Vec3 turned = bound.offset;
  for (const Turn* turn = turns_ + bound.first; turn < turns_ + bound.first + bound.turns; ++turn) {
    const Vec3 by = at(turn->node);
    for (int d = 0; d < 3; ++d)
      turned[d] += static_cast<double>(turn->m[d][0]) * by.x + static_cast<double>(turn->m[d][1]) * by.y +
                   static_cast<double>(turn->m[d][2]) * by.z;
  }
  const double square = dot(turned, turned), most = dot(bound.offset, bound.offset);
  if (square > most) turned = std::sqrt(most / square) * turned;
  return u + (turned - bound.offset);
}

template <class Visit>
void BoundSurface::nodes_of(std::int32_t vertex, Visit visit) const {
  const Vertex& bound = vertices_[vertex];
  for (int i = 0; i < 3; ++i)
    if (bound.weight[i] != 0) visit(mesh_corners(bound.triangle)[i]);
  for (std::int32_t t = bound.first; t < bound.first + bound.turns; ++t) visit(turns_[t].node);
}

}  // namespace palpate
