#include "runtime/cut/cut_triangles.h"

#include <algorithm>

namespace palpate {

bool CutTriangles::create(SceneMemory& memory, const CutMesh& mesh, const CutBody& body, const std::int32_t* number) {
  number_ = number;
  const auto faces = 4 * static_cast<std::size_t>(body.tetrahedron_count);
  of_face_ = memory.array<std::int32_t>(faces);
  of_surface_ = memory.array<std::int32_t>(faces);
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
  changed_ = memory.array<std::int32_t>(2 * count);
  if (memory.failed()) return false;
  follow_all(mesh);
  return true;
}

void CutTriangles::note(std::int32_t triangle) {
  changed_[changed_count_++] = triangle;
}

void CutTriangles::put(std::int32_t triangle, const std::int32_t corners[3]) {
  for (int c = 0; c < 3; ++c) triangles_[3 * triangle + c] = number_ ? number_[corners[c]] : corners[c];
}

void CutTriangles::follow_all(const CutMesh& mesh) {
  const CutSurface& surface = mesh.surface();
  std::fill_n(active_, count_, std::uint8_t{0});
  for (std::int32_t face = 0; face < 4 * mesh.state().rest().tetrahedra(); ++face) {
    std::int32_t corners[3];
    for (int c = 0; c < 3; ++c) corners[c] = mesh.nodes_of(face / 4)[kFaceCorners[face % 4][c]];
    const std::int32_t of_surface = surface.triangle(face), own = of_face_[face];
    if (own < 0) continue;
    // The body's own triangles have the order of corners that it gave them.
    if (of_surface >= 0) surface.nodes(of_surface, corners), of_surface_[of_surface] = own, active_[own] = 1;
    put(own, corners);
  }
  changed_count_ = 0;
  for (std::int32_t i = 0; i < count_; ++i) note(i);
}

void CutTriangles::follow(const CutMesh& mesh) {
  const CutSurface& surface = mesh.surface();
  const CutMeshChange& change = mesh.change();
  changed_count_ = 0;
  const auto read = [&](std::int32_t triangle) {
    std::int32_t corners[3];
    surface.nodes(triangle, corners);
    put(of_surface_[triangle], corners);
    note(of_surface_[triangle]);
  };
  for (std::int32_t i = change.first_triangle; i < change.end_triangle; ++i) {
    if (surface.face(i) < 0) continue;
    of_surface_[i] = of_face_[surface.face(i)];
    active_[of_surface_[i]] = 1;
    read(i);
  }
  for (const std::int32_t i : change.renamed_triangles)
    if (surface.face(i) >= 0) read(i);
  for (const std::int32_t i : change.removed_triangles) {
    // One that came and went in this step has never been here.
    if (i >= change.first_triangle) continue;
    active_[of_surface_[i]] = 0;
    note(of_surface_[i]);
  }
}

}  // namespace palpate
