#pragma once

#include "runtime/include/palpate/palpate_fine_surface.h"
#include "runtime/scene/effect.h"

namespace palpate {

// A surface finer than the mesh's, bound to it, that tools and queries meet in its place.
extern const Effect fine_surface_effect;

}  // namespace palpate
