#include "runtime/cut/cut_triangles.h"

#include <algorithm>

namespace palpate {

bool CutTriangles::create(SceneMemory& memory, const CutMesh& mesh, const CutBody& body, const std::int32_t* number) {
  number_ = number;
  of_face_ = memory.array<std::int32_t>(4 * static_cast<std::size_t>(body.tetrahedron_count));
  if (memory.failed()) return false;
  count_ = body.triangle_count;
  for (std::int32_t face = 0; face < 4 * body.tetrahedron_count; ++face) {
    const std::int32_t of_surface = mesh.surface().triangle(face);
    const bool stays = of_surface < 0 && mesh.state().face(face) == FaceState::kept;
    of_face_[face] = of_surface >= 0 ? of_surface : stays ? -1 : count_++;
  }
  const auto count = static_cast<std::size_t>(count_);
  triangles_ = memory.array<std::int32_t>(3 * count);
  active_ = memory.array<std::uint8_t>(count);
  changed_ = memory.array<std::int32_t>(count);
  if (memory.failed()) return false;
  std::fill_n(active_, count_, std::uint8_t{2});  // so that each one gets its corners
  follow_all(mesh);
  return true;
}

void CutTriangles::keep(SceneMemory& memory) {
  const auto count = static_cast<std::size_t>(count_);
  memory.keep_array(triangles_, 3 * count), memory.keep_array(active_, count);
}

// A triangle changes once: then it is as the mesh has it.
void CutTriangles::follow_face(const CutMesh& mesh, std::int32_t face) {
  const std::int32_t own = of_face_[face], of_surface = mesh.surface().triangle(face);
  if (own < 0) return;
  std::int32_t corner[3];
  // The body's own triangles have the order of corners that it gave them.
  if (of_surface >= 0)
    mesh.surface().nodes(of_surface, corner);
  else
    for (int c = 0; c < 3; ++c) corner[c] = mesh.nodes_of(face / 4)[kFaceCorners[face % 4][c]];
  for (std::int32_t& node : corner) node = number_ ? number_[node] : node;
  const std::uint8_t active = of_surface >= 0;
  std::int32_t* const now = triangles_ + 3 * own;
  if (active == active_[own] && (!active || std::equal(corner, corner + 3, now))) return;
  std::copy_n(corner, 3, now);
  active_[own] = active;
  changed_[changed_count_++] = own;
}

// Of a face that is cut, one of the two tetrahedra has another node.
void CutTriangles::follow(const CutMesh& mesh, std::int32_t tetrahedron) {
  for (std::int32_t face = 4 * tetrahedron; face < 4 * tetrahedron + 4; ++face) {
    follow_face(mesh, face);
    if (const std::int32_t other = mesh.state().rest().other_side(face); other >= 0) follow_face(mesh, other);
  }
}

void CutTriangles::follow(const CutMesh& mesh) {
  begin();
  for (const std::int32_t t : mesh.change().tetrahedra) follow(mesh, t);
  for (const std::int32_t t : mesh.change().removed_tetrahedra) follow(mesh, t);
}

void CutTriangles::follow_all(const CutMesh& mesh) {
  begin();
  for (std::int32_t face = 0; face < 4 * mesh.state().rest().tetrahedra(); ++face) follow_face(mesh, face);
}

}  // namespace palpate
