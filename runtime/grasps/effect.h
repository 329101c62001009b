#pragma once

#include "runtime/base/host_struct.h"
#include "runtime/include/palpate/palpate_grasps.h"
#include "runtime/scene/effect.h"

namespace palpate {

// Tools that grasp.
extern const Effect grasps_effect;

template <>
inline constexpr std::size_t kLeastStructBytes<palpate_grasp> = offsetof(palpate_grasp, closing);

}  // namespace palpate
