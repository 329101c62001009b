#pragma once

#include "runtime/base/host_struct.h"
#include "runtime/include/palpate/palpate_inside.h"
#include "runtime/scene/effect.h"

namespace palpate {

// Strain and stress inside, and carried points. Its state is an InsideField, which belongs to the shape half's thread.
extern const Effect inside_effect;

template <>
inline constexpr std::size_t kLeastStructBytes<palpate_inside_out> = offsetof(palpate_inside_out, displacements);

}  // namespace palpate
