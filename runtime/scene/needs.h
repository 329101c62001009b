// What a scene's effects need, asked by the steps that build the scene and by the plan that describes them.
#pragma once

#include "runtime/base/effects.h"
#include "runtime/scene/scene.h"

namespace palpate {

// The rest surface, searchable. uses: of the scene.
[[maybe_unused]] static bool needs_surface(const palpate_scene_def& def, std::uint32_t uses) {
  return def.collision != PALPATE_COLLISION_OFF || needs_contact_frames(def) || (uses & kUsesSurface) != 0;
}

// Positions of the surface's nodes without contacts.
[[maybe_unused]] static bool needs_rest(const palpate_scene_def& def, std::uint32_t uses) {
  return needs_surface(def, uses) || (uses & kUsesRest) != 0;
}

// The triangles' corners, at least.
[[maybe_unused]] static bool needs_triangles(const palpate_scene_def& def, std::uint32_t uses) {
  return needs_rest(def, uses) || def.contact != PALPATE_CONTACT_NODE;
}

// Displacements of nodes below the surface, from the tensors.
[[maybe_unused]] static bool has_interior_shape(const palpate_scene& scene) {
  const formats::BundleCounts& counts = scene.context.bundle.index.counts;
  return scene.def.shape == PALPATE_SHAPE_VOLUME && !scene.touch.body->surface_field() &&
         counts.nodes > counts.surface_nodes;
}

// Rows of the offset have the nodes inside.
[[maybe_unused]] static bool asks_inside(const palpate_scene& scene) {
  return scene.tensors.corridor || !scene.touch.body->responds_linearly() || has_interior_shape(scene);
}

}  // namespace palpate
