// A displacement of the surface that adds to what the step's contacts do, of a body that is solved outside of the touch.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/base/vec3.h"

namespace palpate {

class AddedField {
 public:
  // nodes: of the field, surface nodes first.
  bool create(SceneMemory& memory, std::int32_t nodes, std::int32_t surface_nodes) {
    nodes_ = nodes, surface_nodes_ = surface_nodes;
    for (float*& field : field_) {
      field = memory.array<float>(3 * static_cast<std::size_t>(nodes));
      memory.keep_array(field, 3 * static_cast<std::size_t>(nodes));
    }
    memory.keep(now_), memory.keep(before_), memory.keep(longest_), memory.keep(change_), memory.keep(whole_);
    return !memory.failed();
  }
  void forget() {
    now_ = before_ = whole_ = 0, longest_ = change_ = 0;
    std::fill(field_[0], field_[0] + 3 * static_cast<std::size_t>(nodes_), 0.0f);
  }

  // Subtracts a field on the surface, between steps: [surface nodes][3] m. Cost: a pass over them.
  void subtract(const float* field) {
    for (std::size_t i = 0; i < 3 * static_cast<std::size_t>(surface_nodes_); ++i) field_[now_][i] -= field[i];
    float most = 0;
    for (std::int32_t n = 0; n < surface_nodes_; ++n) {
      const float* const u = field_[now_] + 3 * static_cast<std::size_t>(n);
      most = std::max(most, u[0] * u[0] + u[1] * u[1] + u[2] * u[2]);
    }
    longest_ = length_above(most);
  }

  // Begins a step whose field is that of the step before.
  void keep() { before_ = now_, change_ = 0; }
  // Begins a step with the field newest + share (newest - last). Both: [nodes][3] m. fresh: `newest` is another one than in the step before.
  // Cost: a pass over the nodes, where the field changes.
  void set(const float* newest, const float* last, double share, bool fresh) {
    if (whole_ && share == 0 && !fresh) return keep();
    before_ = now_, now_ = 1 - now_, whole_ = share == 0;
    const auto s = static_cast<float>(share);
    for (std::size_t i = 0; i < 3 * static_cast<std::size_t>(nodes_); ++i)
      field_[now_][i] = newest[i] + s * (newest[i] - last[i]);
    float most = 0, moved = 0;
    for (std::int32_t n = 0; n < surface_nodes_; ++n) {
      const float *const u = field_[now_] + 3 * static_cast<std::size_t>(n), *const v = field_[before_] +
                                                                                        3 * static_cast<std::size_t>(n);
      const float x = u[0] - v[0], y = u[1] - v[1], z = u[2] - v[2];
      most = std::max(most, u[0] * u[0] + u[1] * u[1] + u[2] * u[2]), moved = std::max(moved, x * x + y * y + z * z);
    }
    longest_ = length_above(most), change_ = length_above(moved);
  }

  // Scales the field of this step so that it moves no node of the surface by more than `most` metres. Cost: a pass over the nodes.
  void bound(double most) {
    if (longest_ <= most) return;
    const auto part = static_cast<float>(most / longest_);
    for (std::size_t i = 0; i < 3 * static_cast<std::size_t>(nodes_); ++i) field_[now_][i] *= part;
    change_ += longest_ - most, longest_ = most, whole_ = 0;
  }

  // A node has from now on what another one has.
  void copy_node(std::int32_t from, std::int32_t to) {
    for (float* const field : field_)
      std::copy_n(field + 3 * static_cast<std::size_t>(from), 3, field + 3 * static_cast<std::size_t>(to));
  }

  // m, zero of a node that the field does not have.
  Vec3 now(std::int32_t node) const { return read(now_, node); }
  Vec3 before(std::int32_t node) const { return read(before_, node); }
  const float* all() const { return field_[now_]; }
  // m, upper bounds over the surface: of the field; of its change by this step.
  double longest() const { return longest_; }
  double change() const { return change_; }

 private:
  static double length_above(float squared) { return std::sqrt(static_cast<double>(squared)) * (1 + 1e-6); }
  Vec3 read(std::int32_t which, std::int32_t node) const {
    if (node >= nodes_) return {};
    const float* const u = field_[which] + 3 * static_cast<std::size_t>(node);
    return {static_cast<double>(u[0]), static_cast<double>(u[1]), static_cast<double>(u[2])};
  }

  float* field_[2] = {};  // [nodes][3] m
  std::int32_t nodes_ = 0, surface_nodes_ = 0, now_ = 0, before_ = 0;
  std::int32_t whole_ = 0;  // the field is that of set() with a share of 0, which bound() has left as it is
  double longest_ = 0, change_ = 0;
};

}  // namespace palpate
