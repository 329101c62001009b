// The searchable surface of a scene that is cut: a triangle for each face of the bundle's surface, and one for either side of each face inside that can be
// cut, of which those that are surface now are active (runtime/surface).
#pragma once

#include <cstdint>

#include "runtime/contact/touch.h"
#include "runtime/cut/cut_mesh.h"

namespace palpate {

class SceneSurface {
 public:
  // Before the core builds its surface: makes its triangles and which of them are active. node: [mesh's nodes, new ones too] the scene's node. Both are
  // borrowed.
  bool create(SceneMemory& memory, const CutMesh& mesh, const std::int32_t* node);

  std::int32_t capacity() const { return capacity_; }
  const std::int32_t* triangles() const { return triangles_; }
  const std::uint8_t* active() const { return active_; }

  // The mesh's last change, then the search structures of the touch. Cost: the change, and a pass over the triangles.
  void take_change(TouchState& touch);
  // All anew, of the mesh as it is.
  void take_all(TouchState& touch);

  // palpate_scene_cut_surface().
  std::int32_t write(std::int32_t* triangles, std::uint8_t* is_lip, std::int32_t most) const;

 private:
  void put(std::int32_t slot, std::int32_t face);
  void changed(std::int32_t slot);
  void update(TouchState& touch);

  const CutMesh* mesh_ = nullptr;
  const std::int32_t* node_ = nullptr;
  std::int32_t* triangles_ = nullptr;     // [capacity][3] the scene's nodes
  std::uint8_t* active_ = nullptr;        // [capacity]
  std::int32_t* slot_of_face_ = nullptr;  // [tetrahedra][4], -1: it is neither surface nor can be cut
  std::int32_t* face_of_slot_ = nullptr;  // [capacity]
  std::int32_t* changed_ = nullptr;       // [3 capacity] of one change
  std::int32_t capacity_ = 0, changed_count_ = 0;
};

}  // namespace palpate
