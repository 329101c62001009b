#include "runtime/cut/blades.h"

#include <algorithm>

namespace palpate {
namespace {

// A walk from one tetrahedron to the next one towards a point ends behind so many, where the mesh has been turned over.
constexpr int kMostWalked = 200;
// A point belongs to a tetrahedron if none of its weights is below this.
constexpr double kInside = -1e-9;

// Six times the signed volume.
double volume(Vec3 a, Vec3 b, Vec3 c, Vec3 d) {
  return dot(cross(b - a, c - a), d - a);
}

}  // namespace

void Blades::create(SceneMemory& memory, const RestMesh* rest) {
  rest_ = rest;
  memory.keep(blades_), memory.keep(turn_);
  forget();
}

void Blades::forget() {
  std::fill(blades_, blades_ + PALPATE_MAX_BLADES, Blade{});
  turn_ = 0;
}

void Blades::set(std::int32_t blade, const double* points, std::int32_t count) {
  Blade& of = blades_[blade];
  if (count != of.count) of.followed = 0;
  of.count = count;
  for (std::int32_t i = 0; i < count; ++i) std::copy_n(points + 3 * i, 3, of.sent[i]);
}

bool Blades::are_there() const {
  return std::any_of(blades_, blades_ + PALPATE_MAX_BLADES, [](const Blade& blade) { return blade.count > 0; });
}

std::int32_t Blades::next() {
  for (; asked_ < PALPATE_MAX_BLADES; ++asked_) {
    const std::int32_t blade = turn_;
    turn_ = (turn_ + 1) % PALPATE_MAX_BLADES;
    if (blades_[blade].count == 0) continue;
    ++asked_;
    return blade;
  }
  return -1;
}

BladeSweep Blades::sweep(std::int32_t blade, const std::int32_t* nodes, const double* positions) {
  const Blade& of = blades_[blade];
  for (std::int32_t i = 0; i < of.followed; ++i) {
    const Place& last = of.last[i];
    Vec3 at = load3(last.at);
    if (last.tetrahedron >= 0) {
      at = {};
      for (int c = 0; c < 4; ++c) at += last.weight[c] * corner(nodes, positions, 4 * last.tetrahedron + c);
    }
    store3(at, from_[i]);
  }
  return {of.followed > 0 ? from_[0] : of.now[0], of.now[0], of.count};
}

void Blades::followed(std::int32_t blade, const std::int32_t* nodes, const double* positions) {
  Blade& of = blades_[blade];
  for (std::int32_t i = 0; i < of.count; ++i) {
    std::int32_t begin = of.followed > 0 ? of.last[i].tetrahedron : -1;
    if (begin < 0) begin = nearest_tetrahedron(load3(of.now[i]), nodes, positions);
    of.last[i] = locate(load3(of.now[i]), begin, nodes, positions);
  }
  of.followed = of.count;
}

// Cost: a pass over all tetrahedra.
std::int32_t Blades::nearest_tetrahedron(Vec3 p, const std::int32_t* nodes, const double* positions) const {
  std::int32_t nearest = 0;
  double least = INFINITY;
  for (std::int32_t t = 0; t < rest_->tetrahedra(); ++t) {
    const Vec3 away = corner(nodes, positions, 4 * t) - p;
    if (dot(away, away) < least) least = dot(away, away), nearest = t;
  }
  return nearest;
}

// Walks across the face that the point is farthest behind. A walk that leaves the mesh ends outside: a point in a hollow between two parts may be
// taken for one outside, which then does not go along with the tissue.
Blades::Place Blades::locate(Vec3 p, std::int32_t begin, const std::int32_t* nodes, const double* positions) const {
  Place place = {-1, 0, {}, {p.x, p.y, p.z}};
  std::int32_t at = begin;
  for (int walked = 0; at >= 0 && walked < kMostWalked; ++walked) {
    Vec3 x[4];
    for (int c = 0; c < 4; ++c) x[c] = corner(nodes, positions, 4 * at + c);
    const double whole = volume(x[0], x[1], x[2], x[3]);
    if (!(whole != 0)) return place;
    int worst = 0;
    for (int c = 0; c < 4; ++c) {
      Vec3 part[4] = {x[0], x[1], x[2], x[3]};
      part[c] = p;
      place.weight[c] = volume(part[0], part[1], part[2], part[3]) / whole;
      if (place.weight[c] < place.weight[worst]) worst = c;
    }
    if (place.weight[worst] >= kInside) {
      place.tetrahedron = at;
      return place;
    }
    at = rest_->neighbour(4 * at + worst);
  }
  return place;
}

}  // namespace palpate
