// The reference for collision with a deformed organ: every triangle of the surface is looked at, slowly.
#pragma once

#include <Eigen/Dense>

#include "runtime/surface/surface_index.h"
#include "tests/support/tiny_bundle.h"

namespace palpate::tests {

class DeformedTruth {
 public:
  explicit DeformedTruth(const SurfaceFirst& body);
  // displacement: [surface nodes][3] m
  void move(const std::vector<float>& displacement);
  // m: below zero inside. The side is that of the winding number, by the solid angles of all triangles.
  double signed_distance(const Eigen::Vector3d& p) const;
  // The first crossing of a ray with the triangles: triangle -1 where there is none. along: unit length.
  struct Crossing {
    std::int32_t triangle = -1;
    double distance = INFINITY;  // m
    double slope = 0;            // cosine between the ray and the triangle's normal
    double from_border = 0;      // smallest barycentric weight
  };
  Crossing first_crossing(const Eigen::Vector3d& origin, const Eigen::Vector3d& along, double longest) const;
  Eigen::Vector3d place(std::int32_t node) const { return place_[node]; }
  Eigen::Vector3d corner(std::size_t triangle, int v) const { return place_[body_->triangles[triangle][v]]; }
  Eigen::Vector3d outward(std::size_t triangle) const;
  // m, the largest distance that any node moved to another truth's place.
  double largest_move(const DeformedTruth& other) const;

 private:
  const SurfaceFirst* body_;
  std::vector<Eigen::Vector3d> place_;
};

}  // namespace palpate::tests
