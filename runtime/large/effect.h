#pragma once

#include "runtime/include/palpate/palpate_large.h"
#include "runtime/scene/effect.h"

namespace palpate {

class DeformingBody;

// The organ is a hyperelastic body under large displacements, solved in the touch or beside it.
extern const Effect large_effect;

// For measuring: the body of a scene that has the effect.
const DeformingBody& deforming_body_of(const palpate_scene& scene);

}  // namespace palpate
