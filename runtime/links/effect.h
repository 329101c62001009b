#pragma once

#include "runtime/scene/effect.h"

namespace palpate {

// Sutures, clips, ligaments and springs of one organ.
extern const Effect links_effect;

}  // namespace palpate
