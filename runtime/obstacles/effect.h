#pragma once

#include "runtime/base/host_struct.h"
#include "runtime/include/palpate/palpate_obstacles.h"
#include "runtime/scene/effect.h"

namespace palpate {

// Rigid surfaces that the organ does not enter.
extern const Effect obstacles_effect;

template <>
inline constexpr std::size_t kLeastStructBytes<palpate_obstacle> = offsetof(palpate_obstacle, position);

}  // namespace palpate
