// Motions of the box of tests/support: its held face as a piston along x and as a rotation, a pressure on its far face, and gravity along z.
#pragma once

#include <Eigen/Dense>

#include "tests/support/tiny_bundle.h"

namespace palpate::tests {

enum MotionOfBox { kPiston, kTurn, kFilling, kWeight, kMotions };

// Dense answers: u per unit of each motion, [3N][4], and the row a of the pressure's volume.
struct DenseMotions {
  Eigen::MatrixXd field;
  Eigen::VectorXd sweep;
};

Eigen::Vector3d node_of(const DenseBody& dense, std::size_t n);

DenseMotions dense_motions(const DenseBody& dense);

void add_motions(BundleParts& parts, const DenseBody& dense);

// Held at the face x = 0 and, with `two`, at the face y = 0.05 too, which never moves.
DenseBody box_on_supports(bool two);

}  // namespace palpate::tests
