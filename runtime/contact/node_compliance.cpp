#include "runtime/contact/node_compliance.h"

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

bool self_compliance(const double stiffness[9], Mat3* compliance) {
  double m[3][3];
  bool moves[3];
  for (int i = 0; i < 3; ++i) moves[i] = stiffness[4 * i] != 0;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      m[i][j] = 0.5 * (stiffness[3 * i + j] + stiffness[3 * j + i]);
      if (!moves[i] || !moves[j]) m[i][j] = i == j ? 1 : 0;
    }
  // Inverse as adjugate over determinant. The matrix is positive definite where its leading minors are positive.
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

bool NodeCompliance::create(SceneMemory& memory, std::int32_t capacity, std::int32_t columns, std::int32_t of_surface,
                            std::int32_t surface_nodes, const Offset* offset) {
  offset_ = offset;
  keys_ = changed() ? surface_nodes : columns;
  const std::size_t entries = static_cast<std::size_t>(capacity),
                    nodes = static_cast<std::size_t>(std::min(capacity, keys_));  // each key has one slot
  stride_ = nodes | 1;  // odd, so that a column of matrices does not fall into few sets of the cache
  matrix_ = memory.array<Mat3>(nodes * stride_);
  self_ = memory.array<Mat3>(nodes);
  column_ = memory.array<std::int32_t>(nodes);
  node_ = memory.array<std::int32_t>(nodes);
  held_in_ = memory.array<std::uint32_t>(nodes);
  taken_in_ = memory.array<std::uint32_t>(nodes);
  by_column_ = memory.array<std::int32_t>(nodes);
  new_ = memory.array<std::int32_t>(nodes);
  slot_of_key_ = memory.array<std::int32_t>(static_cast<std::size_t>(keys_));
  slot_of_contact_node_ = memory.array<std::int32_t>(entries);
  if (memory.failed()) return false;
  capacity_ = static_cast<std::int32_t>(nodes), of_surface_ = of_surface;
  forget();
  return true;
}

void NodeCompliance::release(std::int32_t slot) {
  slot_of_key_[key_of(node_[slot], column_[slot])] = -1;
  column_[slot] = -1;
}

void NodeCompliance::forget() {
  std::fill(column_, column_ + capacity_, -1);
  std::fill(slot_of_key_, slot_of_key_ + keys_, -1);
  slots_ = 0, version_ = version_of_offset();
}

// C_ba = T^u_ba C_aa, and C_ab = C_ba^T by Betti's theorem. Only the later column of the two is read, so that the result does
// not depend on which node came under contact first. One column after the other, because its numbers lie together in memory.
bool NodeCompliance::read(const Tensors& tensors, std::int32_t a, const std::int32_t* earlier, std::int32_t count) {
  bool finite = true;
  const bool follows = this->follows();
  if (follows) offset_->followers().find_response(node_[a], response_);
  ChangedBody* const changed = this->changed();
  if (changed && count > 0) changed->find_response(node_[a]);
  for (std::int32_t k = 0; k < count; ++k) {
    const std::int32_t b = earlier[k];
    Mat3 &ba = matrix_[static_cast<std::size_t>(b) * stride_ + a],
         &ab = matrix_[static_cast<std::size_t>(a) * stride_ + b];
    if (changed && column_[a] == column_[b]) {
      ba = self_[a];  // not read, so that nodes that were one differ by what the changed body adds alone
    } else {
      ba = tensors.displacement(at_rest(b), column_[a]);
      if (column_[a] < of_surface_) ba = ba * self_[a];
    }
    if (follows) add_scaled(ba, -1, offset_->followers().between(node_[b], response_));
    if (changed) add_scaled(ba, 1, changed->between(node_[b]));
    ab = transposed(ba);
    finite = finite && is_finite(ba);
  }
  return finite;
}

bool NodeCompliance::read_self(const Tensors& tensors, std::int32_t a) {
  if (column_[a] < of_surface_)
    return self_compliance(tensors.stiffness + 9 * static_cast<std::size_t>(column_[a]), &self_[a]);
  self_[a] = tensors.displacement(at_rest(a), column_[a]);
  return is_finite(self_[a]);
}

// W_aa. Not where self_ has just been written: a processor waits for a number that it is to read in another width than it wrote it.
bool NodeCompliance::take_self(std::int32_t a) {
  Mat3& own = matrix_[static_cast<std::size_t>(a) * stride_ + a];
  own = self_[a];
  if (ChangedBody* const changed = this->changed()) {
    changed->find_response(node_[a]);
    add_scaled(own, 1, changed->between(node_[a]));
    return is_finite(own);
  }
  if (!follows()) return true;
  offset_->followers().find_response(node_[a], response_);
  add_scaled(own, -1, offset_->followers().between(node_[a], response_));
  return is_finite(own);
}

// Reads all pairs of which at least one node is new.
bool NodeCompliance::read_new(const Tensors& tensors) {
  std::int32_t used = 0, coming = 0;
  for (std::int32_t slot = 0; slot < slots_; ++slot) {
    if (!in_use(slot)) continue;
    by_column_[used++] = slot;
    if (is_new(slot) && !read_self(tensors, slot)) return false;
  }
  std::sort(by_column_, by_column_ + used, [&](std::int32_t a, std::int32_t b) {
    return column_[a] != column_[b] ? column_[a] < column_[b] : node_[a] < node_[b];
  });
  for (std::int32_t p = 0; p < used; ++p)
    if (is_new(by_column_[p])) new_[coming++] = by_column_[p];

  // A new node is paired with all nodes of earlier columns, an old node with the new ones among them. The next node's numbers
  // are prefetched while this node's are read.
  std::int32_t before = 0;
  const auto ask = [&](std::int32_t p) {
    if (p >= used) return;
    const std::int32_t a = by_column_[p];
    const bool all = is_new(a);
    const std::int32_t* const earlier = all ? by_column_ : new_;
    for (std::int32_t k = 0; k < (all ? p : before); ++k) tensors.prefetch(at_rest(earlier[k]), column_[a]);
  };
  ask(0);
  for (std::int32_t p = 0; p < used; ++p) {
    const std::int32_t a = by_column_[p], here = before;
    const bool all = is_new(a);
    before += all;
    ask(p + 1);
    if (!read(tensors, a, all ? by_column_ : new_, all ? p : here) || (all && !take_self(a))) return false;
  }
  return true;
}

bool NodeCompliance::hold(const Tensors& tensors, const ContactConstraints& set) {
  ++round_;
  for (std::int32_t e = 0; e < set.node_count; ++e)
    if (const std::int32_t slot = slot_of_key_[key_of(set.nodes[e].node, set.nodes[e].column)]; slot >= 0)
      held_in_[slot] = round_;
  for (std::int32_t slot = 0; slot < slots_; ++slot)
    if (in_use(slot) && held_in_[slot] != round_) release(slot);
  std::int32_t free = 0;
  bool more = false;
  for (std::int32_t e = 0; e < set.node_count; ++e) {
    const ContactNode& held = set.nodes[e];
    std::int32_t& slot = slot_of_key_[key_of(held.node, held.column)];
    if (slot < 0) {
      while (free < slots_ && in_use(free)) ++free;
      slot = free;
      column_[slot] = held.column, node_[slot] = held.node, held_in_[slot] = taken_in_[slot] = round_;
      slots_ = std::max(slots_, slot + 1);
      more = true;
    }
    slot_of_contact_node_[e] = slot;
  }
  if (more && !read_new(tensors)) {
    forget();
    return false;
  }
  while (slots_ > 0 && !in_use(slots_ - 1)) --slots_;
  return true;
}

}  // namespace palpate
