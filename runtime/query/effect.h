#pragma once

#include "runtime/scene/effect.h"

namespace palpate {

// Rays and nearest points. Its state is a SurfaceQuery, which belongs to the thread of the queries.
extern const Effect queries_effect;

}  // namespace palpate
