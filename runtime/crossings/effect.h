#pragma once

#include "runtime/base/host_struct.h"
#include "runtime/include/palpate/palpate_crossings.h"
#include "runtime/scene/effect.h"

namespace palpate {

// Whether the deformed surface crosses itself. Its state is a CrossingCheck, which belongs to the shape half's thread.
extern const Effect crossings_effect;

template <>
inline constexpr std::size_t kLeastStructBytes<palpate_crossings_out> = offsetof(palpate_crossings_out, crossings);

}  // namespace palpate
