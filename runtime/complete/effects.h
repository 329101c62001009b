// The list of all effects of the library.
#pragma once

#include "runtime/scene/effect.h"

namespace palpate {

// In the order in which they are built and act.
EffectList all_effects();

}  // namespace palpate
