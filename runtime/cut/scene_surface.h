// The searchable surface of a scene that is cut: the triangles of cut_triangles.h in the search structures of the touch.
#pragma once

#include <cstdint>

#include "runtime/contact/touch.h"
#include "runtime/cut/cut_log.h"
#include "runtime/cut/cut_triangles.h"

namespace palpate {

class SceneSurface {
 public:
  // Before the core builds its surface of triangles() and active(). node: [mesh's nodes, new ones too] the scene's node, borrowed.
  bool create(SceneMemory& memory, const CutMesh& mesh, const std::int32_t* node);

  const CutTriangles& all() const { return triangles_; }
  std::int32_t capacity() const { return triangles_.count(); }
  const std::int32_t* triangles() const { return triangles_.triangles(); }
  const std::uint8_t* active() const { return triangles_.active(); }
  // The triangle of a face of a tetrahedron; -1: it has none.
  std::int32_t triangle_of(std::int32_t face) const { return triangles_.of_face(face); }

  // Whose surface it is: with so many points of a tool.
  struct Touched {
    TouchState* touch = nullptr;
    std::int32_t points = 0;
  };
  // Shows the log's last change, once the new nodes have places at rest. Contacts on triangles that are gone end, and all points are tested anew.
  // Cost: the change.
  void show(const CutMesh& mesh, const CutChange& change, const Touched& of);
  // Shows the body at rest.
  void forget(const CutMesh& mesh, const Touched& of);
  // The triangles are those of a state that was restored, and so is what the tree has seen.
  void restored(TouchState& touch);

  // palpate_scene_cut_surface().
  std::int32_t write(std::int32_t* triangles, std::uint8_t* is_lip, std::int32_t most) const;

 private:
  void update(const Touched& of);

  CutTriangles triangles_;
  std::int32_t outside_ = 0;  // triangles of the body at rest
};

}  // namespace palpate
