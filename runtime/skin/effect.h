#pragma once

#include "runtime/base/host_struct.h"
#include "runtime/include/palpate/palpate_skin.h"
#include "runtime/scene/effect.h"

namespace palpate {

// A finer mesh that a renderer draws, and the dents of discs in it. The state of the first one is a Skin, which belongs to the shape
// half's thread; the second one acts on the same Skin.
extern const Effect skin_effect, dent_effect;

template <>
inline constexpr std::size_t kLeastStructBytes<palpate_skin_out> = offsetof(palpate_skin_out, normals);

}  // namespace palpate
