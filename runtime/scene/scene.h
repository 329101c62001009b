// One organ under one set of effects: what palpate_scene of palpate.h points to.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/bundle/step_context.h"
#include "runtime/contact/touch.h"
#include "runtime/scene/plan.h"
#include "runtime/shape/shape.h"
#include "runtime/shape/skin.h"

struct palpate_scene {
  palpate_scene(const palpate_scene_def& wanted, palpate_bundle& opened)
      : def(wanted), memory(wanted.allocator), context{def, opened, tensors, watch} {}
  palpate_scene_def def;
  palpate::SceneMemory memory;
  palpate::Tensors tensors;
  palpate::Compliance compliance;  // where the bundle stores the compliance in blocks
  palpate::PassWatch watch;
  const palpate::StepContext context;
  palpate::TouchState touch;
  palpate::ShapeState shape;
  palpate::Skin skin;  // bound where the host gave a render mesh; belongs to the shape half's thread
  palpate::Plan plan;
};
