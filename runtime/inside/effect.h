#pragma once

#include "runtime/scene/effect.h"

namespace palpate {

// Strain and stress inside, and carried points. Its state is an InsideField, which belongs to the shape half's thread.
extern const Effect inside_effect;

}  // namespace palpate
