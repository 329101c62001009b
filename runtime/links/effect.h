#pragma once

#include "runtime/base/host_struct.h"
#include "runtime/include/palpate/palpate_links.h"
#include "runtime/scene/effect.h"

namespace palpate {

// Sutures, clips, ligaments and springs of one organ.
extern const Effect links_effect;

template <>
inline constexpr std::size_t kLeastStructBytes<palpate_link> = offsetof(palpate_link, rest_length);

}  // namespace palpate
