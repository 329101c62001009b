#include "runtime/cut/scene_surface.h"

#include <algorithm>

#include "runtime/contact/surface_change.h"

namespace palpate {

bool SceneSurface::create(SceneMemory& memory, const CutMesh& mesh, const std::int32_t* node) {
  const CutBody& body = mesh.state().rest().body();
  outside_ = body.triangle_count;
  if (!triangles_.create(memory, mesh, body, node)) return false;
  triangles_.keep(memory);
  return true;
}

void SceneSurface::show(const CutMesh& mesh, const CutChange& change, const Touched& of) {
  triangles_.begin();
  for (std::int32_t i = 0; i < change.moved_count; ++i) triangles_.follow(mesh, change.moved[i].tetrahedron);
  for (std::int32_t i = 0; i < change.removed_count; ++i) triangles_.follow(mesh, change.removed[i]);
  update(of);
}

void SceneSurface::forget(const CutMesh& mesh, const Touched& of) {
  triangles_.follow_all(mesh);
  update(of);
}

// An old patch may lie on triangles that have other corners now.
void SceneSurface::update(const Touched& of) {
  TouchState& touch = *of.touch;
  change_surface(touch.surface, touch.tree, touch.points, of.points, triangles_.changed(), triangles_.changed_count());
  touch.rows.forget();
}

void SceneSurface::restored(TouchState& touch) {
  ++touch.surface.versions;
  for (std::int32_t triangle = 0; triangle < capacity(); ++triangle) touch.surface.index.change(&triangle, 1);
  touch.tree.restored();
  if (touch.surface.measure.is_built()) touch.surface.measure.change(touch.tree.fans());
}

std::int32_t SceneSurface::write(std::int32_t* triangles, std::uint8_t* is_lip, std::int32_t most) const {
  std::int32_t count = 0;
  for (std::int32_t i = 0; i < capacity(); ++i) {
    if (!active()[i]) continue;
    if (count < most && triangles) std::copy_n(this->triangles() + 3 * i, 3, triangles + 3 * count);
    if (count < most && is_lip) is_lip[count] = i >= outside_;
    ++count;
  }
  return count;
}

}  // namespace palpate
