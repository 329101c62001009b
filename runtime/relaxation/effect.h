#pragma once

#include "runtime/include/palpate/palpate_relaxation.h"
#include "runtime/scene/effect.h"

namespace palpate {

// The force on a tool falls while a displacement is held.
extern const Effect relaxation_effect;

}  // namespace palpate
