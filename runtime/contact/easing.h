// How much of what a disc that slides almost freely asks for it gets in a step. Where the disc goes and how its normal turns follow from the
// last step's solution. On a thin part the solution answers by more than that, the other way: full steps would swing for ever.
#pragma once

#include <algorithm>

#include "runtime/base/vec3.h"

namespace palpate {

struct Easing {
  Vec3 asked;        // in the last step
  double share = 1;  // of what is asked

  // What the disc gets of `now`. If it asks for the opposite of the last step's, the share becomes that of a secant of the two.
  Vec3 take(Vec3 now) {
    // With more than 1.2 a lobe's discs swing more often, with less a disc that is dragged lags and loses more of its energy.
    constexpr double least = 0.05, more = 1.2;
    const double before = length(asked);
    if (dot(now, asked) < 0)
      share = std::max(least, share * before / (before + length(now)));
    else
      share = std::min(1.0, more * share);
    asked = now;
    return share * now;
  }
};

}  // namespace palpate
