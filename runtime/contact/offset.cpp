#include "runtime/contact/offset.h"

#include <algorithm>
#include <cmath>

namespace palpate {

std::int32_t Offset::add(SceneMemory& memory, const OffsetRows& rows) {
  const std::int32_t first = rows_.count;
  if (first + rows.count > kMostOffsetRows) return -1;
  if (first == 0) return rows_ = rows, first;
  OffsetRows all = rows_;
  all.count += rows.count;
  const auto join = [&](std::int32_t nodes, const float* before, const float* behind) {
    const std::size_t row = 3 * static_cast<std::size_t>(nodes);
    float* const both = memory.array<float>(static_cast<std::size_t>(all.count) * row);
    if (both)
      std::copy_n(behind, static_cast<std::size_t>(rows.count) * row,
                  std::copy_n(before, static_cast<std::size_t>(first) * row, both));
    return both;
  };
  auto* const force = memory.array<RowForce>(static_cast<std::size_t>(all.count));
  for (std::int32_t m = 0; force && m < all.count; ++m)
    if (const RowForce* const from = m < first ? rows_.force : rows.force) force[m] = from[m < first ? m : m - first];
  all.force = force;
  all.numbers = join(all.nodes, rows_.numbers, rows.numbers);
  if (all.inside) all.inside = join(all.nodes_inside, rows_.inside, rows.inside);
  rows_ = all;
  return memory.failed() ? -1 : first;
}

bool Offset::create(SceneMemory& memory, std::int32_t constraint_capacity) {
  const OffsetRows rows = rows_;
  const auto count = static_cast<std::size_t>(rows.count);
  acting_.target = memory.array<Vec3>(static_cast<std::size_t>(constraint_capacity));
  for (double** const array : {&longest_, &step_}) *array = memory.array<double>(count);
  for (double** const array : {&now_, &before_, &given_, &given_before_}) {
    *array = memory.array<double>(count);
    memory.keep_array(*array, count);
  }
  factor_ = memory.array<double>(count * count), follower_ = memory.array<std::int32_t>(count);
  memory.keep_array(factor_, count * count), memory.keep_array(follower_, count);
  for (std::int32_t* const number : {&follower_count_, &version_, &factored_, &first_}) memory.keep(*number);
  if (memory.failed()) return false;
  for (std::int32_t m = 0; m < rows.count; ++m) {
    double most = 0;
    for (std::int32_t n = 0; n < rows.nodes; ++n) most = std::max(most, dot(rows.at(m, n), rows.at(m, n)));
    longest_[m] = std::sqrt(most) * (1 + 1e-12);
  }
  rows_.longest = longest_;
  return true;
}

void Offset::forget() {
  for (double* const array : {now_, before_, given_, given_before_}) std::fill_n(array, count(), 0.0);
  first_ = 1;
}

void Offset::end_last_step() {
  std::copy_n(now_, count(), before_);
}

void Offset::begin_step() {
  stepped_ = change();
  for (std::int32_t m = 0; m < count(); ++m) step_[m] = now_[m] - before_[m];
  if (first_) std::copy_n(now_, count(), before_);
  first_ = 0;
}

// from: nullptr for zeros.
double Offset::length_of(const double* amounts, const double* from) const {
  double sum = 0;
  for (std::int32_t m = 0; m < count(); ++m) sum += std::fabs(amounts[m] - (from ? from[m] : 0)) * longest_[m];
  return sum;
}

Vec3 Offset::held_by(const ContactConstraints& set, const ContactConstraint& constraint) const {
  Vec3 sum;
  if (!exists()) return sum;
  for (std::int32_t e = constraint.first_node; e < constraint.first_node + constraint.node_count; ++e)
    sum += set.nodes[e].weight * now(set.nodes[e].node);
  return sum;
}

Vec3 Offset::left_of_target(const ContactConstraints& set, std::int32_t p) const {
  if (!exists()) return set.target[p];
  const ContactConstraint& constraint = set.constraints[p];
  const Vec3 held = held_by(set, constraint);
  return set.target[p] - (constraint.framed ? constraint.frame * held : held);
}

const ContactConstraints& Offset::acting(const ContactConstraints& set) {
  if (!exists()) return set;
  Vec3* const target = acting_.target;
  acting_ = set, acting_.target = target;
  for (std::int32_t p = 0; p < set.constraint_count; ++p) target[p] = left_of_target(set, p);
  return acting_;
}

}  // namespace palpate
