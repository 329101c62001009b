#pragma once

#include "runtime/base/host_struct.h"
#include "runtime/include/palpate/palpate_cut.h"
#include "runtime/scene/effect.h"

namespace palpate {

// An organ that is cut while it is touched.
extern const Effect cut_effect;

template <>
inline constexpr std::size_t kLeastStructBytes<palpate_blade> = offsetof(palpate_blade, direction);

}  // namespace palpate
