#pragma once

#include "runtime/base/host_struct.h"
#include "runtime/include/palpate/palpate_fine_surface.h"
#include "runtime/scene/effect.h"

namespace palpate {

// A surface finer than the mesh's, bound to it, that tools and queries meet in its place.
extern const Effect fine_surface_effect;

template <>
inline constexpr std::size_t kLeastStructBytes<palpate_fine_surface> = sizeof(palpate_fine_surface);

}  // namespace palpate
