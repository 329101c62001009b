#include "runtime/large/surface_pressures.h"

#include <algorithm>
#include <cmath>

namespace palpate {

bool SurfacePressures::create(SceneMemory& memory, const OffsetRows& rows, const HyperelasticBody& body,
                              std::int32_t new_nodes, const std::int32_t* place) {
  std::int32_t triangles = 0;
  for (std::int32_t m = 0; rows.pressure && m < rows.count; ++m)
    if (rows.pressure[m].count > 0) ++count_, triangles += rows.pressure[m].count;
  if (count_ == 0) return true;
  of_ = memory.array<Piece>(static_cast<std::size_t>(count_));
  held_ = memory.array<Held>(static_cast<std::size_t>(count_));
  held_before_ = memory.array<Held>(static_cast<std::size_t>(count_));
  corner_ = memory.array<std::int32_t>(3 * static_cast<std::size_t>(triangles));
  node_ = memory.array<std::int32_t>(3 * static_cast<std::size_t>(triangles) + static_cast<std::size_t>(new_nodes));
  SceneMemory scratch = memory.of_same_host();
  std::int32_t* const number = scratch.array<std::int32_t>(static_cast<std::size_t>(body.node_count));
  if (!number || memory.failed()) return scratch.release_all(), false;
  std::fill(number, number + body.node_count, -1);
  std::int32_t pieces = 0, end = 0;
  for (std::int32_t m = 0; m < rows.count; ++m) {
    const RowPressure& on = rows.pressure[m];
    if (on.count == 0) continue;
    of_[pieces++] = {m, end, end + on.count};
    for (std::int32_t k = 0; k < 3 * on.count; ++k) {
      const std::int32_t n = on.triangle[k];
      if (number[n] < 0) number[n] = node_count_, node_[node_count_++] = n;
      corner_[3 * end + k] = number[n];
    }
    end += on.count;
  }
  const bool found = new_nodes == 0 || find_below(memory, body, number);
  scratch.release_all();
  for (Vec3** const array : {&rest_, &base_, &now_, &trial_})
    *array = memory.array<Vec3>(static_cast<std::size_t>(node_count_ + new_nodes));
  if (memory.failed() || !found) return false;
  for (std::int32_t n = 0; n < node_count_; ++n) {
    rest_[n] = load3(body.nodes + 3 * static_cast<std::size_t>(node_[n]));
    node_[n] = place[node_[n]];
  }
  return true;
}

// ---- a mesh that is cut ----------------------------------------------------------------------------------------------

// number: [nodes] of each node here; -1: none.
bool SurfacePressures::find_below(SceneMemory& memory, const HyperelasticBody& body, const std::int32_t* number) {
  const auto all = static_cast<std::size_t>(triangles());
  below_ = memory.array<std::int32_t>(all), uncut_ = memory.array<std::int32_t>(3 * all);
  if (memory.failed()) return false;
  std::copy_n(corner_, 3 * all, uncut_), uncut_nodes_ = node_count_;
  for (std::int32_t e = 0; e < body.tetrahedron_count; ++e) {
    std::int32_t own[4];
    std::transform(body.tetrahedra + 4 * static_cast<std::int64_t>(e),
                   body.tetrahedra + 4 * static_cast<std::int64_t>(e) + 4, own,
                   [&](std::int32_t n) { return number[n]; });
    if (std::count(own, own + 4, -1) > 1) continue;
    for (std::int32_t t = 0; t < triangles(); ++t)
      if (std::all_of(corner_ + 3 * t, corner_ + 3 * t + 3,
                      [&](std::int32_t n) { return std::find(own, own + 4, n) != own + 4; }))
        below_[t] = e;
  }
  return true;
}

void SurfacePressures::split(std::int32_t from, std::int32_t to, const std::int32_t* tetrahedra, std::int32_t count) {
  std::int32_t made = -1;
  for (std::int32_t c = 0; c < 3 * triangles(); ++c) {
    const std::int32_t old = corner_[c];
    if (node_[old] != from || std::find(tetrahedra, tetrahedra + count, below_[c / 3]) == tetrahedra + count) continue;
    if (made < 0) {
      made = node_count_++, node_[made] = to;
      for (Vec3* const array : {rest_, base_, now_, trial_}) array[made] = array[old];
    }
    corner_[c] = made;
  }
}

// A triangle without area neither presses nor sweeps.
void SurfacePressures::remove(std::int32_t tetrahedron) {
  for (std::int32_t t = 0; t < triangles(); ++t)
    if (below_[t] == tetrahedron) corner_[3 * t + 1] = corner_[3 * t + 2] = corner_[3 * t];
}

void SurfacePressures::forget_changes() {
  if (!uncut_) return;
  std::copy_n(uncut_, 3 * static_cast<std::size_t>(triangles()), corner_);
  node_count_ = uncut_nodes_;
}

void SurfacePressures::keep(SceneMemory& memory) {
  memory.keep_array(held_, static_cast<std::size_t>(count_));
}

bool SurfacePressures::act() const {
  return std::any_of(held_, held_ + count_,
                     [](const Held& held) { return held.stiffness > 0 || held.multiplier != 0; });
}

void SurfacePressures::begin_step() {
  std::copy(held_, held_ + count_, held_before_);
}

void SurfacePressures::give_up() {
  std::copy(held_before_, held_before_ + count_, held_);
}

Vec3 SurfacePressures::area(const std::int32_t* corner, const Vec3* moved) const {
  const Vec3 a = place_of(corner[0], moved);
  return 0.5 * cross(place_of(corner[1], moved) - a, place_of(corner[2], moved) - a);
}

// The area vector is quadratic along the way: Simpson's rule is exact.
Vec3 SurfacePressures::mean_area(const std::int32_t* corner, const Vec3* from, const Vec3* to) const {
  const auto edge = [&](int v, const Vec3* moved) { return place_of(corner[v], moved) - place_of(corner[0], moved); };
  const Vec3 b0 = edge(1, from), b1 = edge(1, to), c0 = edge(2, from), c1 = edge(2, to);
  return 1.0 / 12 * (cross(b0, c0) + cross(b0 + b1, c0 + c1) + cross(b1, c1));
}

double SurfacePressures::swept_by(const std::int32_t* corner, const Vec3* from, const Vec3* to) const {
  Vec3 way;
  for (int v = 0; v < 3; ++v) way += to[corner[v]] - from[corner[v]];
  return -1.0 / 3 * dot(way, mean_area(corner, from, to));
}

double SurfacePressures::swept_between(std::int32_t i, const Vec3* from, const Vec3* to) const {
  double sum = 0;
  for (std::int32_t t = of_[i].first; t < of_[i].end; ++t) sum += swept_by(corner_ + 3 * t, from, to);
  return sum;
}

double SurfacePressures::gross(std::int32_t i) const {
  double sum = 0;
  for (std::int32_t t = of_[i].first; t < of_[i].end; ++t) sum += std::fabs(swept_by(corner_ + 3 * t, base_, now_));
  return sum;
}

void SurfacePressures::add_areas(std::int32_t i, const Vec3* moved, double factor, std::int32_t rows, float* f) const {
  for (std::int32_t t = of_[i].first; t < of_[i].end; ++t) {
    const Vec3 third = factor / 3 * area(corner_ + 3 * t, moved);
    for (int v = 0; v < 3; ++v)
      if (const std::int32_t at = node_[corner_[3 * t + v]]; at < rows)
        for (int d = 0; d < 3; ++d)
          f[3 * static_cast<std::size_t>(at) + static_cast<std::size_t>(d)] += static_cast<float>(third[d]);
  }
}

double SurfacePressures::evaluate(const float* at, const double* amounts, std::int32_t rows, float* f) {
  for (std::int32_t n = 0; n < node_count_; ++n) {
    const float* const u = at + 3 * static_cast<std::size_t>(node_[n]);
    trial_[n] = {static_cast<double>(u[0]), static_cast<double>(u[1]), static_cast<double>(u[2])};
  }
  double energy = 0;
  for (std::int32_t i = 0; i < count_; ++i) {
    const Held& held = held_[i];
    const double swept = of_[i].trial = held.swept + swept_between(i, now_, trial_), left = held.volume - swept;
    energy -= amounts[of_[i].row] * (swept - of_[i].from);
    if (held.stiffness > 0)
      energy += left * (0.5 * held.stiffness * left + held.multiplier);
    else
      energy -= held.multiplier * swept;
    if (const double pressure = pressure_at(i, amounts, swept); pressure != 0) add_areas(i, trial_, pressure, rows, f);
  }
  return energy;
}

void SurfacePressures::accept() {
  std::swap(now_, trial_);
  for (std::int32_t i = 0; i < count_; ++i) held_[i].swept = of_[i].trial;
}

}  // namespace palpate
