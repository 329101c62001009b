#include "runtime/node_compliance.h"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

bool is_finite(const Mat3& c) {
  double sum = 0;
  for (const auto& row : c.m)
    for (const double x : row) sum += x;
  return std::isfinite(sum);
}

Mat3 transposed(const Mat3& a) {
  Mat3 t;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) t.m[i][j] = a.m[j][i];
  return t;
}

}  // namespace

bool self_compliance(const double force[9], Mat3* compliance) {
  double m[3][3];
  bool moves[3];
  for (int i = 0; i < 3; ++i) moves[i] = force[4 * i] != 0;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      m[i][j] = 0.5 * (force[3 * i + j] + force[3 * j + i]);
      if (!moves[i] || !moves[j]) m[i][j] = i == j ? 1 : 0;
    }
  // Adjugate over determinant; positive leading minors make it positive definite.
  const double c00 = m[1][1] * m[2][2] - m[1][2] * m[1][2], c01 = m[0][2] * m[1][2] - m[0][1] * m[2][2],
               c02 = m[0][1] * m[1][2] - m[0][2] * m[1][1], c11 = m[0][0] * m[2][2] - m[0][2] * m[0][2],
               c12 = m[0][1] * m[0][2] - m[0][0] * m[1][2], c22 = m[0][0] * m[1][1] - m[0][1] * m[0][1];
  const double determinant = m[0][0] * c00 + m[0][1] * c01 + m[0][2] * c02;
  const double inverse[3][3] = {{c00, c01, c02}, {c01, c11, c12}, {c02, c12, c22}};
  if (!(m[0][0] > 0 && c22 > 0 && determinant > 0 && std::isfinite(determinant))) return false;
  bool finite = true;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      compliance->m[i][j] = moves[i] && moves[j] ? inverse[i][j] / determinant : 0;
      finite = finite && std::isfinite(compliance->m[i][j]);
    }
  return finite;
}

bool NodeCompliance::create(SceneMemory& memory, std::int32_t capacity, std::int32_t columns) {
  const std::size_t nodes = static_cast<std::size_t>(capacity);
  stride_ = nodes | 1;  // odd: columns of blocks do not all fall into the same few places of the cache
  matrix_ = memory.array<Mat3>(nodes * stride_);
  column_ = memory.array<std::int32_t>(nodes);
  node_ = memory.array<std::int32_t>(nodes);
  held_in_ = memory.array<std::uint32_t>(nodes);
  slot_of_column_ = memory.array<std::int32_t>(static_cast<std::size_t>(columns));
  slot_of_entry_ = memory.array<std::int32_t>(nodes);
  if (memory.failed()) return false;
  std::fill(slot_of_column_, slot_of_column_ + columns, -1);
  return true;
}

void NodeCompliance::release(std::int32_t slot) {
  slot_of_column_[column_[slot]] = -1;
  column_[slot] = -1;
}

void NodeCompliance::forget() {
  for (std::int32_t slot = 0; slot < slots_; ++slot)
    if (in_use(slot)) release(slot);
  slots_ = 0;
}

// C_ab = T^u_ab C_bb = C_ba^T, by Betti as well as the store holds: read once, from the later of the two columns, so that
// it does not depend on which of the nodes came first.
bool NodeCompliance::read(const Tensors& tensors, std::int32_t a) {
  Mat3* const of_a = matrix_ + static_cast<std::size_t>(a) * stride_;
  if (!self_compliance(tensors.force + 9 * static_cast<std::size_t>(column_[a]), &of_a[a])) return false;
  for (std::int32_t b = 0; b < slots_; ++b)
    if (b != a && in_use(b)) {
      const bool later = column_[a] > column_[b];
      tensors.prefetch(later ? node_[b] : node_[a], later ? column_[a] : column_[b]);
    }
  bool finite = true;
  for (std::int32_t b = 0; b < slots_; ++b) {
    if (b == a || !in_use(b)) continue;
    Mat3 &ab = of_a[b], &ba = matrix_[static_cast<std::size_t>(b) * stride_ + a];
    if (column_[a] > column_[b]) {
      ba = tensors.displacement(node_[b], column_[a]) * of_a[a];
      ab = transposed(ba);
    } else {
      ab = tensors.displacement(node_[a], column_[b]) * self(b);
      ba = transposed(ab);
    }
    finite = finite && is_finite(ab);
  }
  return finite;
}

bool NodeCompliance::hold(const Tensors& tensors, const ContactSet& set) {
  ++round_;
  for (std::int32_t e = 0; e < set.entry_count; ++e)
    if (const std::int32_t slot = slot_of_column_[set.entries[e].column]; slot >= 0) held_in_[slot] = round_;
  for (std::int32_t slot = 0; slot < slots_; ++slot)
    if (in_use(slot) && held_in_[slot] != round_) release(slot);
  std::int32_t free = 0;
  for (std::int32_t e = 0; e < set.entry_count; ++e) {
    const ContactEntry& entry = set.entries[e];
    std::int32_t& slot = slot_of_column_[entry.column];
    if (slot < 0) {
      while (free < slots_ && in_use(free)) ++free;
      slot = free;
      column_[slot] = entry.column, node_[slot] = entry.node, held_in_[slot] = round_;
      slots_ = std::max(slots_, slot + 1);
      if (!read(tensors, slot)) {
        forget();
        return false;
      }
    }
    slot_of_entry_[e] = slot;
  }
  while (slots_ > 0 && !in_use(slots_ - 1)) --slots_;
  return true;
}

}  // namespace palpate
