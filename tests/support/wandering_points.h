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
  double operator()(double from, double to) {
    state_ = state_ * 6364136223846793005u + 1442695040888963407u;
    return from + (to - from) * static_cast<double>(state_ >> 11) * 0x1p-53;
  }
  int below(int count) { return std::min(count - 1, static_cast<int>((*this)(0, count))); }

 private:
  std::uint64_t state_ = 1;
};

// The surface's vertices with their outward normals and neighbours, of which those that can be touched are visited.
struct VisitedSurface {
  using Point = std::array<double, 3>;
  explicit VisitedSurface(const palpate_bundle* bundle) {
    const palpate_bundle_info info = palpate_bundle_describe(bundle);
    const double* nodes = palpate_bundle_nodes(bundle);
    place.resize(info.surface_node_count), normal.resize(place.size()), near.resize(place.size());
    touchable.assign(palpate_bundle_touchable(bundle), palpate_bundle_touchable(bundle) + info.touchable_count);
    for (std::size_t n = 0; n < place.size(); ++n) std::copy_n(nodes + 3 * n, 3, place[n].begin());
    for (int t = 0; t < info.triangle_count; ++t) {
      const std::int32_t* v = palpate_bundle_triangles(bundle) + 3 * t;
      const Point &a = place[v[0]], &b = place[v[1]], &c = place[v[2]];
      for (int d = 0; d < 3; ++d) {
        const int e = (d + 1) % 3, f = (d + 2) % 3;
        const double area = (b[e] - a[e]) * (c[f] - a[f]) - (b[f] - a[f]) * (c[e] - a[e]);
        for (int i = 0; i < 3; ++i) normal[v[i]][d] += area;
      }
      for (int i = 0; i < 3; ++i) near[v[i]].push_back(v[(i + 1) % 3]);
    }
    for (Point& n : normal) {
      const double l = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
      for (double& x : n) x /= l > 0 ? l : 1;
    }
  }
  std::vector<Point> place, normal;
  std::vector<std::vector<std::int32_t>> near;
  std::vector<std::int32_t> touchable;
};

// A tool point that hovers, presses, slides at its depth over the surface, and jumps to another place, in any order.
class WanderingPoint {
 public:
  using Point = VisitedSurface::Point;
  static constexpr double kDeepest = 5e-3;  // m
  WanderingPoint(const VisitedSurface& surface, WanderingRandom& random) : surface_(surface), random_(random) {
    jump();
  }
  Point step() {
    if (left_-- == 0) choose();
    height_ += std::clamp(wanted_ - height_, -5e-5, 5e-5);  // 50 mm/s
    if (slides_ && (along_ += 0.02) > 1) from_ = to_, to_ = neighbour(from_), along_ = 0;
    Point p;
    for (int d = 0; d < 3; ++d)
      p[d] = (1 - along_) * (surface_.place[from_][d] + height_ * surface_.normal[from_][d]) +
             along_ * (surface_.place[to_][d] + height_ * surface_.normal[to_][d]);
    return p;
  }

 private:
  std::int32_t neighbour(std::int32_t of) {
    const auto& near = surface_.near[of];
    return near.empty() ? of : near[random_.below(static_cast<int>(near.size()))];
  }
  void jump() {
    from_ = surface_.touchable[random_.below(static_cast<int>(surface_.touchable.size()))];
    to_ = neighbour(from_);
    along_ = 0, height_ = wanted_ = 1e-3;
  }
  void choose() {
    left_ = 20 + random_.below(300);
    const double what = random_(0, 1);
    if (what < 0.1) jump();
    slides_ = what > 0.5;
    wanted_ = what < 0.25 ? 1e-3 : random_(-kDeepest, 0);  // a quarter hovers 1 mm above
  }
  const VisitedSurface& surface_;
  WanderingRandom& random_;
  std::int32_t from_ = 0, to_ = 0;
  double along_ = 0, height_ = 0, wanted_ = 0;
  bool slides_ = false;
  int left_ = 0;
};

}  // namespace palpate::tests
