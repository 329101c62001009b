#include "runtime/contact/shared_nodes.h"

#include <algorithm>

#include "runtime/dense/dense_rows.h"

namespace palpate {

bool SharedNodes::create(SceneMemory& memory, std::int32_t contact_nodes) {
  const std::size_t entries = static_cast<std::size_t>(contact_nodes);
  capacity_ = std::min(contact_nodes, kMostNodes);
  const std::size_t nodes = static_cast<std::size_t>(capacity_);
  stride_ = odd_lines(3 * nodes);
  compliance_ = memory.array<double>(3 * nodes * stride_);
  sums_ = memory.array<double>(2 * 3 * std::size_t{kMostNodes});
  frame_ = memory.array<Mat3>(nodes);
  block_ = memory.array<Mat3>(entries);
  node_ = memory.array<std::int32_t>(entries);
  slot_ = memory.array<std::int32_t>(nodes);
  node_of_slot_ = memory.array<std::int32_t>(entries);
  return !memory.failed();
}

// A node's axes are those of the first constraint that holds it. A normal force then stands before the friction that it allows, and
// an elimination in this order meets no pivot near zero.
bool SharedNodes::take(const NodeCompliance& held, const ContactConstraints& set, std::int32_t rows) {
  count_ = entries_ = 0, pairs_ = 0;
  std::fill(node_of_slot_, node_of_slot_ + held.slots(), -1);
  for (std::int32_t p = 0; p < set.constraint_count; ++p) {
    const ContactConstraint& constraint = set.constraints[p];
    if (constraint.node_count > 1) pairs_ += std::int64_t{constraint.node_count} * constraint.node_count;
    for (std::int32_t e = constraint.first_node; e < constraint.first_node + constraint.node_count; ++e) {
      std::int32_t& node = node_of_slot_[held.slot_of_contact_node(e)];
      if (node < 0) {
        if (count_ == capacity_) return false;
        node = count_++;
        slot_[node] = held.slot_of_contact_node(e);
        frame_[node] = constraint.framed ? constraint.frame : Mat3{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
      }
      node_[e] = node;
      Mat3 to = constraint.framed ? times_transposed(constraint.frame, frame_[node]) : Mat3{};
      if (!constraint.framed)
        for (int i = 0; i < 3; ++i)
          for (int j = 0; j < 3; ++j) to.m[i][j] = frame_[node].m[j][i];
      block_[e] = Mat3{};
      add_scaled(block_[e], set.nodes[e].weight, to);
    }
  }
  entries_ = set.node_count, pairs_ = std::min(pairs_ + count_, std::int64_t{count_} * count_);
  if (operations_to_take() / 10 + 2 * operations_to_spread() + operations_to_move() > std::int64_t{rows} * rows)
    return false;  // of some ten products
  for (std::int32_t a = 0; a < count_; ++a)
    for (std::int32_t b = 0; b < count_; ++b) {
      const Mat3 turned = times_transposed(frame_[a] * held.at(slot_[a])[slot_[b]], frame_[b]);
      for (int i = 0; i < 3; ++i)
        std::copy(turned.m[i], turned.m[i] + 3,
                  compliance_ + static_cast<std::size_t>(3 * a + i) * stride_ + static_cast<std::size_t>(3 * b));
    }
  return true;
}

// A product of 3 x 3 blocks with rows of W takes about twice as long as as many multiply-adds of long rows.
std::int64_t SharedNodes::operations_to_factor() const {
  const std::int64_t all = axes();
  return all * all * all / 3 + 3 * all * all + 2 * 9 * pairs_ * all;
}

void SharedNodes::copy(const SharedNodes& from) {
  count_ = from.count_, entries_ = from.entries_, pairs_ = from.pairs_;
  std::copy(from.node_, from.node_ + entries_, node_);
  std::copy(from.block_, from.block_ + entries_, block_);
  for (std::int32_t a = 0; a < axes(); ++a)
    std::copy(from.compliance(a), from.compliance(a) + axes(), compliance_ + static_cast<std::size_t>(a) * stride_);
}

Vec3 SharedNodes::along(const ContactConstraint& constraint, const double* moved) const {
  Vec3 sum;
  for (std::int32_t e = constraint.first_node; e < constraint.first_node + constraint.node_count; ++e)
    sum += block_[e] * load3(moved + 3 * node_[e]);
  return sum;
}

void SharedNodes::spread(const ContactConstraint& constraint, Vec3 r, double* force) const {
  for (std::int32_t e = constraint.first_node; e < constraint.first_node + constraint.node_count; ++e) {
    double* const to = force + 3 * node_[e];
    store3(load3(to) + transposed_times(block_[e], r), to);
  }
}

void SharedNodes::move(const double* force, double* moved) const {
  for (std::int32_t a = 0; a < axes(); ++a) moved[a] = dot_rows(axes(), compliance(a), force);
}

void SharedNodes::add_moved(const ContactConstraint& constraint, Vec3 r, double* moved) const {
  for (std::int32_t e = constraint.first_node; e < constraint.first_node + constraint.node_count; ++e) {
    const Vec3 f = transposed_times(block_[e], r);
    const double *const x = compliance(3 * node_[e]), *const y = x + stride_, *const z = y + stride_;
    for (std::int32_t a = 0; a < axes(); ++a) moved[a] += f.x * x[a] + f.y * y[a] + f.z * z[a];
  }
}

}  // namespace palpate
