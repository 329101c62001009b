// The C functions between a body's frame and the world's.
#include <algorithm>

#include "runtime/include/palpate/palpate_pose.h"
#include "runtime/pose/pose.h"

namespace palpate {
namespace {

Pose pose_of(const double* position, const double* orientation) {
  Pose pose;
  if (position) pose.position = load3(position);
  pose.orientation = unit({orientation[0], orientation[1], orientation[2], orientation[3]});
  pose.axes = matrix_of(pose.orientation);
  return pose;
}

}  // namespace
}  // namespace palpate

using namespace palpate;

void palpate_point_to_world(const double position[3], const double orientation[4], const double organ[3],
                            double world[3]) {
  store3(pose_of(position, orientation).to_world(load3(organ)), world);
}

void palpate_point_to_organ(const double position[3], const double orientation[4], const double world[3],
                            double organ[3]) {
  store3(pose_of(position, orientation).to_body(load3(world)), organ);
}

void palpate_vector_to_world(const double orientation[4], const double organ[3], double world[3]) {
  store3(pose_of(nullptr, orientation).turned_to_world(load3(organ)), world);
}

void palpate_vector_to_organ(const double orientation[4], const double world[3], double organ[3]) {
  store3(pose_of(nullptr, orientation).turned_to_body(load3(world)), organ);
}

void palpate_pose_matrix(const double position[3], const double orientation[4], double matrix[16]) {
  const Pose pose = pose_of(position, orientation);
  std::fill(matrix, matrix + 16, 0.0);
  for (int column = 0; column < 3; ++column)
    for (int row = 0; row < 3; ++row) matrix[4 * column + row] = pose.axes.m[row][column];
  store3(pose.position, matrix + 12);
  matrix[15] = 1;
}
