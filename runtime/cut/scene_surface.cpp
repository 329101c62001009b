#include "runtime/cut/scene_surface.h"

#include <algorithm>

namespace palpate {

bool SceneSurface::create(SceneMemory& memory, const CutMesh& mesh, const std::int32_t* node) {
  mesh_ = &mesh, node_ = node;
  const RestMesh& rest = mesh.state().rest();
  const std::int32_t faces = 4 * rest.tetrahedra(), outside = rest.body().triangle_count;
  slot_of_face_ = memory.array<std::int32_t>(static_cast<std::size_t>(faces));
  if (memory.failed()) return false;
  std::fill_n(slot_of_face_, faces, -1);
  for (std::int32_t t = 0; t < outside; ++t) slot_of_face_[rest.face_of_triangle(t)] = t;
  capacity_ = outside;
  for (std::int32_t face = 0; face < faces; ++face)
    if (rest.neighbour(face) >= 0 && mesh.state().face(face) != FaceState::kept) slot_of_face_[face] = capacity_++;
  const auto slots = static_cast<std::size_t>(capacity_);
  triangles_ = memory.array<std::int32_t>(3 * slots), active_ = memory.array<std::uint8_t>(slots);
  face_of_slot_ = memory.array<std::int32_t>(slots), changed_ = memory.array<std::int32_t>(3 * slots);
  if (memory.failed()) return false;
  for (std::int32_t face = 0; face < faces; ++face)
    if (slot_of_face_[face] >= 0) face_of_slot_[slot_of_face_[face]] = face;
  for (std::int32_t slot = 0; slot < capacity_; ++slot) {
    put(slot, face_of_slot_[slot]);
    active_[slot] = slot < outside;
  }
  return true;
}

// The corners of a face as it is in the mesh; the order of the bundle's own triangles is theirs.
void SceneSurface::put(std::int32_t slot, std::int32_t face) {
  const RestMesh& rest = mesh_->state().rest();
  const std::int32_t tetrahedron = face / 4, *const now = mesh_->nodes_of(tetrahedron);
  for (int c = 0; c < 3; ++c) {
    const bool is_own = slot < rest.body().triangle_count;
    const std::int32_t corner =
        is_own ? rest.corner_at(tetrahedron, rest.body().triangles[3 * slot + c]) % 4 : kFaceCorners[face % 4][c];
    triangles_[3 * slot + c] = node_[now[corner]];
  }
}

void SceneSurface::changed(std::int32_t slot) {
  const std::int32_t face = face_of_slot_[slot];
  put(slot, face);
  active_[slot] = mesh_->surface().triangle(face) >= 0;
  changed_[changed_count_++] = slot;
}

void SceneSurface::take_change(TouchState& touch) {
  const CutMeshChange& change = mesh_->change();
  changed_count_ = 0;
  const auto take = [&](std::int32_t face) {
    if (face >= 0 && slot_of_face_[face] >= 0) changed(slot_of_face_[face]);
  };
  // The faces of all tetrahedra that have other nodes, and of those that are gone, cover what was renamed, added and removed but for new faces of others.
  for (const std::int32_t t : change.tetrahedra)
    for (std::int32_t face = 4 * t; face < 4 * t + 4; ++face) take(face);
  for (const std::int32_t t : change.removed_tetrahedra)
    for (std::int32_t face = 4 * t; face < 4 * t + 4; ++face) take(face);
  for (std::int32_t i = change.first_triangle; i < change.end_triangle; ++i) take(mesh_->surface().face(i));
  std::sort(changed_, changed_ + changed_count_);
  changed_count_ = static_cast<std::int32_t>(std::unique(changed_, changed_ + changed_count_) - changed_);
  if (changed_count_ > 0) update(touch);
}

void SceneSurface::update(TouchState&) {}

void SceneSurface::take_all(TouchState& touch) {
  changed_count_ = 0;
  for (std::int32_t slot = 0; slot < capacity_; ++slot) changed(slot);
  update(touch);
}

std::int32_t SceneSurface::write(std::int32_t* triangles, std::uint8_t* is_lip, std::int32_t most) const {
  std::int32_t count = 0;
  for (std::int32_t slot = 0; slot < capacity_; ++slot) {
    if (!active_[slot]) continue;
    if (count < most && triangles) std::copy_n(triangles_ + 3 * slot, 3, triangles + 3 * count);
    if (count < most && is_lip) is_lip[count] = slot >= mesh_->state().rest().body().triangle_count;
    ++count;
  }
  return count;
}

}  // namespace palpate
