// What an effect gets when a scene is built.
#pragma once

#include "runtime/scene/scene.h"
#include "runtime/scene/section_reader.h"

namespace palpate {

struct EffectBuild {
  SectionReader& reader;
  palpate_scene& scene;
  Pass pass;    // of the effect, for PassWatch::ended()
  void* state;  // build() fills it in: what palpate_scene::state_of() gives to the effect's own code
};

}  // namespace palpate
