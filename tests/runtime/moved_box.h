// The box bundle with motions (tests/support/box_motions.h), open.
#pragma once

#include <palpate/palpate_scene_def.hpp>

#include "tests/runtime/touched_box.h"
#include "tests/support/box_motions.h"

namespace palpate::tests {

struct MovedBox : TouchedBody {
  explicit MovedBox(bool two)
      : TouchedBody(box_on_supports(two), [&](BundleParts& parts) { add_motions(parts, box_on_supports(two)); }),
        motions(dense_motions(box_on_supports(two))) {}
  DenseMotions motions;
};

SceneDef moved_def();

void set_amounts(palpate_scene* scene, const Eigen::Vector4d& q);

}  // namespace palpate::tests
