#pragma once

#include "runtime/base/host_struct.h"
#include "runtime/include/palpate/palpate_needles.h"
#include "runtime/scene/effect.h"

namespace palpate {

// Tools that have a needle. Its state is a Needles.
extern const Effect needles_effect;

template <>
inline constexpr std::size_t kLeastStructBytes<palpate_needle> = offsetof(palpate_needle, friction);

}  // namespace palpate
