#include "programs/player/organ_crossings.h"

#include <algorithm>

namespace palpate {

OrganCrossings::OrganCrossings(palpate_scene* runtime_scene) : runtime_scene_(runtime_scene), places_(64) {
  found_.crossings = places_.data(), found_.capacity = static_cast<std::int32_t>(places_.size());
}

palpate_step_flags OrganCrossings::follow(const palpate_shape_out& shape) {
  return palpate_scene_crossings(runtime_scene_, &shape, &found_);
}

void CrossingsSummary::add(double time, const palpate_crossings_out& found) {
  checks = found.checks, most_pairs = std::max(most_pairs, found.pairs);
  if (found.pairs > 0 && !first) first = found.crossings[0], first_time = time;
}

}  // namespace palpate
