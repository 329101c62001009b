// The surface of a cut body. A triangle is a face of a tetrahedron, and keeps its number as long as it is part of the surface. Those of the body
// at rest have the numbers and the order of corners that the body gave them. Each face gets a number once at most.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/cut/rest_mesh.h"

namespace palpate {

class CutSurface {
 public:
  // nodes: of the corners [tetrahedra][4], as they are now; it may change. False where memory ends.
  bool create(SceneMemory& memory, const RestMesh& rest, const std::int32_t* nodes);
  // The surface of the body at rest.
  void forget();
  // All numbers that were ever given.
  std::int32_t count() const { return count_; }
  // The face, 4 tetrahedron + the corner opposite to it; -1: no longer part of the surface.
  std::int32_t face(std::int32_t triangle) const { return face_[triangle]; }
  // The triangle of a face; -1: it is inside, or its tetrahedron is removed.
  std::int32_t triangle(std::int32_t face) const { return triangle_[face]; }
  // Three nodes, counter-clockwise from outside.
  void nodes(std::int32_t triangle, std::int32_t found[3]) const;
  // The triangle on the other lip of the cut; -1: there is none. A lip's side is that of its tetrahedron.
  std::int32_t other_lip(std::int32_t triangle) const;

  std::int32_t add(std::int32_t face);
  // The number of the triangle that the face was.
  std::int32_t remove(std::int32_t face);

 private:
  const RestMesh* rest_ = nullptr;
  const std::int32_t* nodes_ = nullptr;
  std::int32_t* face_ = nullptr;      // [tetrahedra][4], by triangle
  std::int32_t* triangle_ = nullptr;  // [tetrahedra][4], by face
  std::int32_t count_ = 0;
};

}  // namespace palpate
