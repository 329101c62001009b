#pragma once

#include "runtime/base/host_struct.h"
#include "runtime/include/palpate/palpate_queries.h"
#include "runtime/scene/effect.h"

namespace palpate {

// Rays and nearest points. Its state is a SurfaceQuery, which belongs to the thread of the queries.
extern const Effect queries_effect;

template <>
inline constexpr std::size_t kLeastStructBytes<palpate_surface_hit> = sizeof(palpate_surface_hit);

}  // namespace palpate
