// One organ under one set of effects: what palpate_scene of palpate.h points to.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/bundle/step_context.h"
#include "runtime/contact/touch.h"
#include "runtime/inside/inside_field.h"
#include "runtime/query/surface_query.h"
#include "runtime/scene/plan.h"
#include "runtime/shape/shape.h"
#include "runtime/shape/skin.h"

struct palpate_scene {
  palpate_scene(const palpate_scene_def& wanted, palpate_bundle& opened)
      : def(wanted), memory(wanted.allocator), context{def, opened, tensors, watch} {}
  palpate_scene_def def;
  palpate::SceneMemory memory;
  std::uint64_t definition = 0;  // checksum of what a saved state must have in common with the scene
  palpate::Tensors tensors;
  palpate::Compliance compliance;  // where the bundle stores the compliance in blocks
  palpate::Corridor corridor;      // where the scene has needles
  palpate::PassWatch watch;
  const palpate::StepContext context;
  palpate::TouchState touch;
  palpate::ShapeState shape;
  palpate::Skin skin;           // bound where the host gave a render mesh; belongs to the shape half's thread
  palpate::InsideField inside;  // with inside; belongs to the shape half's thread
  palpate::SurfaceQuery query;  // with queries; belongs to the thread of the queries
  palpate::Plan plan;
  bool in_world = false;  // an organ of a world, which steps, saves and restores it
};

namespace palpate {

// Fills in the plan's most_operations. Refuses fewer than a step can do with.
palpate_status state_work_bounds(palpate_scene& scene, palpate_error* error);

}  // namespace palpate
