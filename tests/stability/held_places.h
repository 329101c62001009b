// Places on the faces of a body, and grasps of them.
#pragma once

#include "tests/runtime/touched_box.h"

namespace palpate::tests {

// The place on a face that looks along `outward`, nearest to p: the middle of a triangle.
struct FacePlace {
  std::int32_t triangle = -1;
  double barycentric[3] = {1.0 / 3, 1.0 / 3, 1.0 / 3};
};
inline FacePlace face_place(const TouchedBody& body, const Eigen::Vector3d& outward, const Eigen::Vector3d& p) {
  FacePlace best;
  double least = INFINITY;
  for (std::size_t t = 0; t < body.body.triangles.size(); ++t) {
    const auto triangle = static_cast<std::int32_t>(t);
    if (body.outward(triangle).dot(outward) < 0.99) continue;
    const Eigen::Vector3d middle = body.place(triangle, Eigen::Vector3d::Constant(1.0 / 3));
    if ((middle - p).norm() < least) least = (middle - p).norm(), best.triangle = triangle;
  }
  return best;
}

// Jaws that close at p.
inline palpate_grasp face_grasp(const TouchedBody& body, const Eigen::Vector3d& outward, const Eigen::Vector3d& p,
                                double radius) {
  const FacePlace place = face_place(body, outward, p);
  palpate_grasp grasp = palpate_default_grasp();
  grasp.triangle = place.triangle, grasp.radius = radius;
  std::copy(place.barycentric, place.barycentric + 3, grasp.barycentric);
  Eigen::Map<Eigen::Vector3d>(grasp.position) = p;
  return grasp;
}
inline void oppose(const TouchedBody& body, palpate_grasp& grasp, const Eigen::Vector3d& outward,
                   const Eigen::Vector3d& p) {
  const FacePlace place = face_place(body, outward, p);
  grasp.opposite_triangle = place.triangle;
  std::copy(place.barycentric, place.barycentric + 3, grasp.opposite_barycentric);
}

}  // namespace palpate::tests
