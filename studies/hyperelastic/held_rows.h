// The rows of a large body's last step that hold, for Newton's method.
#pragma once

#include <Eigen/Dense>

#include "runtime/large/deforming_body.h"

namespace palpate {

// With [3N] node weights each, what gives way beside the body (m/N), places (m) and the forces that the scene has found (N). load: [3N] N, of the
// rows that are at a limit of their force: they slide, or cut.
struct HeldRows {
  Eigen::MatrixXd weights, compliance;
  Eigen::VectorXd place, carried, load;
};
HeldRows held_rows(const DeformingBody& body, std::int32_t node_count);
// Of a scene with such a body.
HeldRows held_rows(const palpate_scene& scene, std::int32_t node_count);

}  // namespace palpate
