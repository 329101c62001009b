// The surface of a cut body as triangles whose numbers and count stay: those of the body at rest, then one for each side of each face between two
// tetrahedra that can be cut. Each is active while it is part of the surface. What searches a surface is built once over all of them and follows the flags and
// the corners (change() in runtime/surface).
#pragma once

#include <cstdint>

#include "runtime/cut/cut_mesh.h"

namespace palpate {

class CutTriangles {
 public:
  // mesh: before any cut. number: [nodes of the mesh, new ones too] of each as the corners have it, borrowed; nullptr: that of the mesh. Nothing
  // is allocated afterwards. False where memory ends.
  bool create(SceneMemory& memory, const CutMesh& mesh, const CutBody& body, const std::int32_t* number = nullptr);
  // Takes over the mesh as it is now: where these tetrahedra have other nodes or are gone, between begin() and the use of changed(); what
  // its last step changed; all of it.
  void begin() { changed_count_ = 0; }
  void follow(const CutMesh& mesh, std::int32_t tetrahedron);
  void follow(const CutMesh& mesh);
  void follow_all(const CutMesh& mesh);
  void keep(SceneMemory& memory);

  std::int32_t count() const { return count_; }
  std::int32_t* triangles() const { return triangles_; }    // [count][3]
  const std::uint8_t* active() const { return active_; }    // [count] 1: part of the surface
  const std::int32_t* changed() const { return changed_; }  // each once
  std::int32_t of_face(std::int32_t face) const { return of_face_[face]; }
  std::int32_t changed_count() const { return changed_count_; }

 private:
  void follow_face(const CutMesh& mesh, std::int32_t face);

  const std::int32_t* number_ = nullptr;
  std::int32_t count_ = 0, changed_count_ = 0;
  std::int32_t* triangles_ = nullptr;
  std::uint8_t* active_ = nullptr;
  std::int32_t* of_face_ = nullptr;  // [tetrahedra][4], by face; -1: it stays whole
  std::int32_t* changed_ = nullptr;  // [count]
};

}  // namespace palpate
