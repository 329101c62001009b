#include "tests/runtime/moved_box.h"

namespace palpate::tests {

SceneDef moved_def() {
  SceneDef def = unlimited_def();
  def.collision = PALPATE_COLLISION_DEFORMED, def.contact = PALPATE_CONTACT_POINT, def.motions.motions = 1;
  return def;
}

void set_amounts(palpate_scene* scene, const Eigen::Vector4d& q) {
  palpate_error error = {};
  EXPECT_EQ(palpate_scene_set_motions(scene, q.data(), kMotions, &error), PALPATE_OK) << error.text;
}

}  // namespace palpate::tests
