// A host's finer mesh that follows the surface: each vertex is bound once to a surface point and carried by its three nodes.
//
// A node carries its surroundings as a bone carries skin: u(x) = u_node + H (x - x_node). H is the displacement gradient of the
// triangles around the node, averaged by area. Within a triangle's plane the gradient is the triangle's own; across it, the
// gradient maps the rest normal to the deformed normal, both of unit length. A vertex blends the three bones of its triangle:
//   - on the surface it moves by sum_i w_i u_i, the plain barycentric interpolation;
//   - beside the surface its offset turns with the surface;
//   - translations and rotations of the whole organ are reproduced exactly, and the mesh stays continuous.
// Normals follow by the cofactor of I + H, so they need no triangles of the host's mesh.
// Where the scene asks for dents, the vertices around the discs of a step then sink to these (dent.h).
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/include/palpate/palpate_report.h"
#include "runtime/include/palpate/palpate_skin.h"
#include "runtime/skin/dent.h"
#include "runtime/surface/surface_index.h"
#include "runtime/surface/surface_measure.h"

namespace palpate {

class Skin {
 public:
  // Binds the mesh to the surface as it was meshed. nodes: [node_count][3] m, used during the call; triangles: checked, outward.
  // preload: [node_count][3] m, borrowed, or nullptr. scratch: memory for the binding alone. dents: draw_dents() will follow.
  // Errors: ARGUMENT with the vertex, MEMORY. Cost: a few microseconds per vertex near the surface.
  palpate_status bind(SceneMemory& memory, SceneMemory& scratch, const palpate_render_mesh& mesh, const double* nodes,
                      std::int32_t node_count, const float* preload, const std::int32_t* triangles,
                      std::int32_t triangle_count, bool dents, palpate_error* error);

  // After bind(): makes dent() possible. measure: of the surface at rest, borrowed; contacts: that a report has at most.
  bool draw_dents(SceneMemory& memory, const SurfaceMeasure* measure, std::int32_t contacts);

  bool bound() const { return vertex_count_ > 0; }
  bool has_normals() const { return normals_ != nullptr; }
  std::int32_t vertex_count() const { return vertex_count_; }
  std::int32_t node_count() const { return node_count_; }
  std::int32_t triangle_count() const { return triangle_count_; }

  // displacements: [node_count][3] m, any floats. Returns step flags.
  palpate_step_flags move(const float* displacements, palpate_skin_out* out);

  bool draws_dents() const { return measure_ != nullptr; }
  double vertices_near_a_disc() const;  // about, for the plan's cost
  // After move(): sinks what it moved to the discs of out->report, which is not nullptr, and fills out->disc_normals. Returns step flags.
  palpate_step_flags dent(palpate_skin_out* out);

 private:
  struct Triangle {
    std::int32_t node[3];
    float edge[2][3];  // m, from node 0
    float dual[2][3];  // 1/m, in the triangle's plane: dual i . edge j is 1 where i is j, else 0
    float normal[3];   // unit; for a triangle without area zero, like all fields but node
    float share[3];    // of this triangle in the area around each of its nodes
  };
  struct Bone {
    float column[4][4];  // columns of H, then u; the fourth row pads a bone to 64 bytes and is never read
  };
  struct Vertex {
    std::int32_t node[3];
    float weight[3];
    float offset[3];  // m, from its surface point at rest
  };
  bool describe_triangles(SceneMemory& memory, SceneMemory& scratch, const double* nodes,
                          const std::int32_t* triangles);
  void bind_vertex(std::int32_t v, const SurfacePoint& surface_point, Vec3 position, Vec3 surface_position);
  palpate_step_flags take(const float* displacements);
  void turn_bones();
  static Bone blended(const Bone* bones, const std::int32_t* node, const float* weight);
  bool place_vertex(std::int32_t v, const Bone& bone, float* moved) const;
  static void turn_normal(const Bone& bone, const float* n, float* out);
  palpate_step_flags move_vertex(std::int32_t v, palpate_skin_out* out) const;
  bool find_disc(const palpate_contact& contact, DentDisc* disc) const;
  void dent_vertex(std::int32_t v, palpate_skin_out* out) const;

  std::int32_t node_count_ = 0, triangle_count_ = 0, vertex_count_ = 0;
  Triangle* triangles_ = nullptr;   // [triangle_count]
  Bone* bones_ = nullptr;           // [node_count]
  Vertex* vertices_ = nullptr;      // [vertex_count]
  float* positions_ = nullptr;      // [vertex_count][3] m, as bound
  float* normals_ = nullptr;        // [vertex_count][3] unit or zero; nullptr: none
  const float* preload_ = nullptr;  // [node_count][3] m
  // Where the scene draws dents, else nullptr.
  const SurfaceMeasure* measure_ = nullptr;
  Bone* rest_bones_ = nullptr;        // [node_count] under the preload alone; nullptr: no preload
  std::int32_t* triangle_ = nullptr;  // [vertex_count] that each vertex is bound to; nullptr with normals
  std::int32_t most_contacts_ = 0;
  Dents dents_;
};

// Writes the unit normal of two edges to out, or zero and returns false where they span no area. The same edges give the same
// bits, so that an organ at rest turns nothing.
inline bool unit_normal(const float a[3], const float b[3], float out[3]) {
  const float n[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  const float length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
  const bool is_area = length > 0 && length < INFINITY;
  for (int d = 0; d < 3; ++d) out[d] = is_area ? n[d] / length : 0;
  return is_area;
}

}  // namespace palpate
