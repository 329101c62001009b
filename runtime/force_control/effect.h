#pragma once

#include "runtime/base/host_struct.h"
#include "runtime/include/palpate/palpate_force_control.h"
#include "runtime/scene/effect.h"

namespace palpate {

template <>
inline constexpr std::size_t kLeastStructBytes<palpate_given_force> = offsetof(palpate_given_force, speed);

// Tools that press with a given force.
extern const Effect force_control_effect;

}  // namespace palpate
