#pragma once

#include "runtime/include/palpate/palpate_grasps.h"
#include "runtime/scene/effect.h"

namespace palpate {

// Tools that grasp.
extern const Effect grasps_effect;

}  // namespace palpate
