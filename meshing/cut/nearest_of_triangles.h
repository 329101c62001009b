// The nearest point to a place on triangles that are given one after the other.
#pragma once

#include <array>
#include <limits>

#include "runtime/base/vec3.h"
#include "runtime/surface/surface_index.h"

namespace palpate {

class NearestOfTriangles {
 public:
  explicit NearestOfTriangles(const std::array<double, 3>& place) : place_(load3(place.data())) {}
  void take(Vec3 a, Vec3 b, Vec3 c) {
    double k[3];
    const double square = closest_on_triangle(place_, a, b, c, k);
    if (square < least_) least_ = square, point_ = k[0] * a + k[1] * b + k[2] * c;
  }
  std::array<double, 3> point() const { return {point_.x, point_.y, point_.z}; }

 private:
  Vec3 place_, point_;
  double least_ = std::numeric_limits<double>::infinity();
};

}  // namespace palpate
