#pragma once

#include "runtime/include/palpate/palpate_loads.h"
#include "runtime/scene/effect.h"

namespace palpate {

// Dead weights and tractions on patches of the surface.
extern const Effect loads_effect;

}  // namespace palpate
