#include "runtime/cut/cut_triangles.h"

#include <algorithm>

namespace palpate {

bool CutTriangles::create(SceneMemory& memory, const CutMesh& mesh, const CutBody& body) {
  const auto faces = 4 * static_cast<std::size_t>(body.tetrahedron_count);
  triangles_ = memory.array<std::int32_t>(3 * faces);
  active_ = memory.array<std::uint8_t>(faces);
  of_face_ = memory.array<std::int32_t>(faces);
  of_surface_ = memory.array<std::int32_t>(faces);
  changed_ = memory.array<std::int32_t>(2 * faces);
  if (memory.failed()) return false;
  // A face has one triangle on either side, and one of the surface has one in all: there are as many as corners.
  count_ = body.triangle_count;
  for (std::int32_t face = 0; face < 4 * body.tetrahedron_count; ++face) {
    const std::int32_t of_surface = mesh.surface().triangle(face);
    of_face_[face] = of_surface >= 0 ? of_surface : count_++;
    if (of_surface >= 0) of_surface_[of_surface] = of_surface, active_[of_surface] = 1;
    for (int c = 0; c < 3; ++c) triangles_[3 * of_face_[face] + c] = mesh.nodes_of(face / 4)[kFaceCorners[face % 4][c]];
  }
  std::copy_n(body.triangles, 3 * body.triangle_count, triangles_);
  return true;
}

void CutTriangles::note(std::int32_t triangle) {
  changed_[changed_count_++] = triangle;
}

void CutTriangles::follow(const CutMesh& mesh) {
  const CutSurface& surface = mesh.surface();
  const CutMeshChange& change = mesh.change();
  changed_count_ = 0;
  const auto read = [&](std::int32_t triangle) {
    const std::int32_t own = of_surface_[triangle];
    surface.nodes(triangle, triangles_ + 3 * own);
    note(own);
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
