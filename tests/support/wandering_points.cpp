#include "tests/support/wandering_points.h"

namespace palpate::tests {

double WanderingRandom::operator()(double from, double to) {
  state_ = state_ * 6364136223846793005u + 1442695040888963407u;
  return from + (to - from) * static_cast<double>(state_ >> 11) * 0x1p-53;
}

VisitedSurface::VisitedSurface(const palpate_bundle* bundle) {
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

WanderingPoint::WanderingPoint(const VisitedSurface& surface, WanderingRandom& random)
    : surface_(surface), random_(random) {
  jump();
}

WanderingPoint::Point WanderingPoint::step() {
  if (left_-- == 0) choose();
  height_ += std::clamp(wanted_ - height_, -5e-5, 5e-5);  // 50 mm/s
  if (slides_ && (along_ += 0.02) > 1) from_ = to_, to_ = neighbour(from_), along_ = 0;
  Point p;
  for (int d = 0; d < 3; ++d)
    p[d] = (1 - along_) * (surface_.place[from_][d] + height_ * surface_.normal[from_][d]) +
           along_ * (surface_.place[to_][d] + height_ * surface_.normal[to_][d]);
  return p;
}

std::int32_t WanderingPoint::neighbour(std::int32_t of) {
  const auto& near = surface_.near[of];
  return near.empty() ? of : near[random_.below(static_cast<int>(near.size()))];
}

void WanderingPoint::jump() {
  from_ = surface_.touchable[random_.below(static_cast<int>(surface_.touchable.size()))];
  to_ = neighbour(from_);
  along_ = 0, height_ = wanted_ = 1e-3;
}

void WanderingPoint::choose() {
  left_ = 20 + random_.below(300);
  const double what = random_(0, 1);
  if (what < 0.1) jump();
  slides_ = what > 0.5;
  wanted_ = what < 0.25 ? 1e-3 : random_(-kDeepest, 0);  // a quarter hovers 1 mm above
}

}  // namespace palpate::tests
