#pragma once

#include "runtime/include/palpate/palpate_motions.h"
#include "runtime/scene/effect.h"

namespace palpate {

// Supports, pressures and gravity that move the organ from outside.
extern const Effect motions_effect;

}  // namespace palpate
