// The box bundle with motions (tests/support/box_motions.h), open.
#pragma once

#include "tests/runtime/touched_box.h"
#include "tests/support/box_motions.h"

namespace palpate::tests {

struct MovedBox : TouchedBody {
  explicit MovedBox(bool two)
      : TouchedBody(box_on_supports(two), [&](BundleParts& parts) { add_motions(parts, box_on_supports(two)); }),
        motions(dense_motions(box_on_supports(two))) {}
  DenseMotions motions;
};

inline palpate_scene_def moved_def() {
  palpate_scene_def def = unlimited_def();
  def.collision = PALPATE_COLLISION_DEFORMED, def.contact = PALPATE_CONTACT_POINT, def.motions = 1;
  return def;
}

inline void set_amounts(palpate_scene* scene, const Eigen::Vector4d& q) {
  palpate_error error = {};
  EXPECT_EQ(palpate_scene_set_motions(scene, q.data(), kMotions, &error), PALPATE_OK) << error.text;
}

}  // namespace palpate::tests
