// A finer mesh of the host's that follows the surface: every vertex is bound once to a place of the surface and carried by
// the three nodes there.
//
// A node carries what is near it as a bone does, by u(x) = u_node + H (x - place): H is the displacement's gradient on the
// triangles about the node, their mean by area. In a triangle's plane the gradient is the triangle's own; across it, the
// normal stays a unit normal. So a vertex on the surface moves by sum w_i u_i, the plain barycentric weights; one beside it
// turns with the surface; translations and turns of the whole are reproduced exactly; and the mesh stays as continuous as
// the surface. Normals follow by the cofactor of I + H, whatever triangles the host has.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/surface/surface_index.h"

namespace palpate {

class Skin {
 public:
  // Binds the mesh to the surface as it was meshed: nodes [node_count][3] m, triangles checked and outward; borrowed.
  // preload: [node_count][3] m, kept, or nullptr. What only binding needs is taken from scratch.
  // Errors: ARGUMENT with the vertex, MEMORY. Cost: a few microseconds per vertex near the surface.
  palpate_status bind(SceneMemory& memory, SceneMemory& scratch, const palpate_render_mesh& mesh, const double* nodes,
                      std::int32_t node_count, const float* preload, const std::int32_t* triangles,
                      std::int32_t triangle_count, palpate_error* error);

  bool bound() const { return vertex_count_ > 0; }
  bool has_normals() const { return normals_ != nullptr; }
  std::int32_t vertex_count() const { return vertex_count_; }
  std::int32_t node_count() const { return node_count_; }
  std::int32_t triangle_count() const { return triangle_count_; }

  // displacements: [node_count][3] m, any floats. Returns flag bits.
  palpate_step_flags move(const float* displacements, palpate_skin_out* out);

 private:
  struct Triangle {
    std::int32_t node[3];
    float edge[2][3];  // m, from node 0
    float dual[2][3];  // 1/m, in the triangle's plane: dual i . edge j is 1 where i is j, else 0
    float normal[3];   // unit; zero, as all but the nodes, where the triangle is flat
    float share[3];    // of the triangle in the area about each node
  };
  struct Bone {
    float column[4][4];  // of [H | u]; the last lane is never read, and makes a bone 64 bytes
  };
  struct Vertex {
    std::int32_t node[3];
    float weight[3];
    float offset[3];  // m, from its place on the surface
  };
  bool describe_triangles(SceneMemory& memory, SceneMemory& scratch, const double* nodes,
                          const std::int32_t* triangles);
  void bind_vertex(std::int32_t v, const SurfacePlace& place, Vec3 position, Vec3 place_at);
  palpate_step_flags take(const float* displacements);
  void turn_bones();
  palpate_step_flags move_vertex(std::int32_t v, palpate_skin_out* out) const;

  std::int32_t node_count_ = 0, triangle_count_ = 0, vertex_count_ = 0;
  Triangle* triangles_ = nullptr;   // [triangle_count]
  Bone* bones_ = nullptr;           // [node_count]
  Vertex* vertices_ = nullptr;      // [vertex_count]
  float* positions_ = nullptr;      // [vertex_count][3] m, as bound
  float* normals_ = nullptr;        // [vertex_count][3] unit or zero; nullptr: none
  const float* preload_ = nullptr;  // [node_count][3] m
};

// The unit normal of two edges, written to out; zero where they make no area. The same bits for the same edges: what rests
// does not turn.
inline bool unit_normal(const float a[3], const float b[3], float out[3]) {
  const float n[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  const float length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
  const bool is_area = length > 0 && length < INFINITY;
  for (int d = 0; d < 3; ++d) out[d] = is_area ? n[d] / length : 0;
  return is_area;
}

}  // namespace palpate
