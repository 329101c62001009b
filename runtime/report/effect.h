#pragma once

#include "runtime/include/palpate/palpate_report.h"
#include "runtime/scene/effect.h"

namespace palpate {

// What a step tells about each contact, and what began and ended in it.
extern const Effect report_effect;

}  // namespace palpate
