#pragma once

#include "runtime/include/palpate/palpate_needles.h"
#include "runtime/scene/effect.h"

namespace palpate {

// Tools that have a needle. Its state is a Needles.
extern const Effect needles_effect;

}  // namespace palpate
