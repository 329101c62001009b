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
  // Takes over what the last step of the mesh changed; the mesh as it is, whatever was before.
  void follow(const CutMesh& mesh);
  void follow_all(const CutMesh& mesh);

  std::int32_t count() const { return count_; }
  std::int32_t* triangles() const { return triangles_; }    // [count][3]
  const std::uint8_t* active() const { return active_; }    // [count] 1: part of the surface
  const std::int32_t* changed() const { return changed_; }  // of the last follow(), some perhaps twice
  std::int32_t changed_count() const { return changed_count_; }
  // The number here of a triangle that CutSurface knows, or knew.
  std::int32_t of_surface(std::int32_t triangle) const { return of_surface_[triangle]; }

 private:
  void note(std::int32_t triangle);
  void put(std::int32_t triangle, const std::int32_t corners[3]);

  const std::int32_t* number_ = nullptr;
  std::int32_t count_ = 0, changed_count_ = 0;
  std::int32_t* triangles_ = nullptr;
  std::uint8_t* active_ = nullptr;
  std::int32_t* of_face_ = nullptr;     // [tetrahedra][4], by face; -1: it stays whole
  std::int32_t* of_surface_ = nullptr;  // [tetrahedra][4], by the number in CutSurface
  std::int32_t* changed_ = nullptr;     // [2 tetrahedra][4]
};

}  // namespace palpate
