// What both halves of a step read and neither half writes.
#pragma once

#include "runtime/base/passes.h"
#include "runtime/bundle/bundle.h"
#include "runtime/bundle/tensors.h"

namespace palpate {

// All of it belongs to the scene.
struct StepContext {
  const palpate_scene_def& def;
  palpate_bundle& bundle;
  const Tensors& tensors;
  const PassWatch& watch;
};

}  // namespace palpate
