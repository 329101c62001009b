// A host's fine surface, checked and bound to the mesh's, once, while a scene is created.
#pragma once

#include "runtime/base/scene_memory.h"
#include "runtime/include/palpate/palpate_fine_surface.h"
#include "runtime/surface/bound_surface.h"

namespace palpate {

class FineSurface : public BoundSurface {
 public:
  // The mesh's surface, as it was meshed. triangles: checked, outward, borrowed. nodes and preload are used during the call.
  struct Mesh {
    const double* nodes;            // [node_count][3] m
    const double* preload;          // [node_count][3] m, or nullptr
    const std::int32_t* triangles;  // [triangle_count][3]
    std::int32_t node_count, triangle_count;
  };
  // rest: [node_count][3] m, the mesh's positions without contacts, preload included; borrowed. scratch: memory for the call alone.
  // Errors: ARGUMENT with what is wrong in the surface, MEMORY. Cost: some microseconds per vertex.
  palpate_status bind(SceneMemory& memory, SceneMemory& scratch, const palpate_fine_surface& from, const Mesh& mesh,
                      const double* rest, palpate_error* error);

 private:
  class Binding;
  palpate_status take(SceneMemory& memory, SceneMemory& scratch, const palpate_fine_surface& from,
                      palpate_error* error);
  palpate_status check_closed(SceneMemory& scratch, palpate_error* error) const;
  bool find_fans(SceneMemory& memory, const Mesh& mesh);
  void measure_normals();
};

}  // namespace palpate
