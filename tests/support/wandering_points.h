// Tool points that hover, press, slide and jump over a body's surface, in any order: a hostile scene.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "runtime/include/palpate/palpate.h"

namespace palpate::tests {

// Reproducible: each play gets the same tools.
class WanderingRandom {
 public:
  double operator()(double from, double to);
  int below(int count) { return std::min(count - 1, static_cast<int>((*this)(0, count))); }

 private:
  std::uint64_t state_ = 1;
};

// The surface's vertices with their outward normals and neighbours, of which those that can be touched are visited.
struct VisitedSurface {
  using Point = std::array<double, 3>;
  explicit VisitedSurface(const palpate_bundle* bundle);
  std::vector<Point> place, normal;
  std::vector<std::vector<std::int32_t>> near;
  std::vector<std::int32_t> touchable;
};

// A tool point that hovers, presses, slides at its depth over the surface, and jumps to another place, in any order.
class WanderingPoint {
 public:
  using Point = VisitedSurface::Point;
  static constexpr double kDeepest = 5e-3;  // m
  WanderingPoint(const VisitedSurface& surface, WanderingRandom& random);
  Point step();

 private:
  std::int32_t neighbour(std::int32_t of);
  void jump();
  void choose();
  const VisitedSurface& surface_;
  WanderingRandom& random_;
  std::int32_t from_ = 0, to_ = 0;
  double along_ = 0, height_ = 0, wanted_ = 0;
  bool slides_ = false;
  int left_ = 0;
};

}  // namespace palpate::tests
