#include "runtime/cut/cut_stream.h"

#include <algorithm>
#include <cmath>

namespace palpate {

bool CutStream::create(SceneMemory& memory, std::int32_t most) {
  most_ = most, numbers_ = memory.array<std::int32_t>(static_cast<std::size_t>(most));
  memory.keep(used_);
  memory.keep_array(numbers_, static_cast<std::size_t>(most), used_);
  return !memory.failed();
}

// A tetrahedron has four faces, each of which has two sides.
bool CutStream::has_room(const CutChange& change) const {
  const std::int64_t tetrahedra = change.moved_count + change.removed_count + 1, of_each = 5 + 8 * 5 + 4 * kHead;
  return used_ + tetrahedra * of_each + 8 <= most_;
}

std::int32_t* CutStream::begin(Kind kind, std::int32_t length) {
  std::int32_t* const at = numbers_ + used_;
  at[0] = static_cast<std::int32_t>(kind), at[1] = kHead + length;
  used_ += kHead + length;
  return at + kHead;
}

void CutStream::add(const CutChange& change, const CutResult& result) {
  for (std::int32_t i = 0; i < result.new_nodes; ++i) {
    const CutChange::NewNode& made = change.new_nodes[i];
    const auto goes = [&](const CutChange::Moved& moved) {
      return std::find(moved.corners, moved.corners + 4, made.node) != moved.corners + 4;
    };
    const auto count = static_cast<std::int32_t>(std::count_if(change.moved, change.moved + change.moved_count, goes));
    std::int32_t* to = begin(Kind::split, 2 + 5 * count);
    *to++ = made.node, *to++ = made.from;
    for (std::int32_t k = 0; k < change.moved_count; ++k) {
      if (!goes(change.moved[k])) continue;
      *to++ = change.moved[k].tetrahedron;
      to = std::copy_n(change.moved[k].corners, 4, to);
    }
  }
  for (std::int32_t i = 0; i < result.removed; ++i) *begin(Kind::remove, 1) = change.removed[i];
}

// uN/m.
void CutStream::add_hold(std::int32_t node, double stiffness) {
  std::int32_t* const to = begin(Kind::hold, 2);
  to[0] = node, to[1] = static_cast<std::int32_t>(std::lround(1e6 * stiffness));
}

void CutStream::add(const CutTriangles& triangles) {
  for (std::int32_t first = 0; first < triangles.changed_count(); first += kTriangles) {
    const std::int32_t count = std::min(kTriangles, triangles.changed_count() - first);
    if (used_ + kHead + 5 * count > most_) return;
    std::int32_t* to = begin(Kind::triangles, 5 * count);
    for (std::int32_t i = first; i < first + count; ++i) {
      const std::int32_t triangle = triangles.changed()[i];
      *to++ = triangle;
      to = std::copy_n(triangles.triangles() + 3 * triangle, 3, to);
      *to++ = triangles.active()[triangle];
    }
  }
}

std::int32_t CutStream::copy(std::int32_t from, std::int32_t most, std::int32_t* out) const {
  std::int32_t end = from;
  while (end < used_ && end + numbers_[end + 1] - from <= most) end += numbers_[end + 1];
  std::copy(numbers_ + from, numbers_ + end, out);
  return end - from;
}

}  // namespace palpate
