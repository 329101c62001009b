#include "runtime/cut/scene_surface.h"

#include <algorithm>

namespace palpate {

bool SceneSurface::create(SceneMemory& memory, const CutMesh& mesh, const std::int32_t* node) {
  const CutBody& body = mesh.state().rest().body();
  outside_ = body.triangle_count;
  return triangles_.create(memory, mesh, body, node);
}

void SceneSurface::take_change(const CutMesh& mesh, TouchState& touch) {
  triangles_.follow(mesh);
  update(touch);
  // An old patch may lie on triangles that have other corners now, and what was far from the surface may be near a lip.
  touch.rows.forget();
  for (PointState* const points : touch.points.of_tool)
    for (PointState* point = points; point && point->known; ++point) {
      point->clear = {};
      if (point->contact && !active()[point->anchor.triangle]) *point = {};
    }
}

void SceneSurface::update(TouchState& touch) {
  const std::int32_t *const changed = triangles_.changed(), count = triangles_.changed_count();
  touch.surface.index.change(changed, count);
  touch.tree.change(changed, count);
  touch.surface.measure.change(touch.tree.fans());
}

void SceneSurface::take_all(const CutMesh& mesh, TouchState& touch) {
  triangles_.follow_all(mesh);
  update(touch);
}

void SceneSurface::restored(const CutMesh& mesh, TouchState& touch) {
  triangles_.follow_all(mesh);
  touch.surface.index.change(triangles_.changed(), triangles_.changed_count());
  touch.tree.restored();
  touch.surface.measure.change(touch.tree.fans());
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
