#pragma once

#include "runtime/include/palpate/palpate_cut.h"
#include "runtime/scene/effect.h"

namespace palpate {

// An organ that is cut while it is touched.
extern const Effect cut_effect;

}  // namespace palpate
