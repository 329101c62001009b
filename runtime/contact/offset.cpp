#include "runtime/contact/offset.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

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
  const auto join_parts = [&](auto* before, auto* behind) {
    using Part = std::remove_cvref_t<decltype(*before)>;
    auto* const both = before || behind ? memory.array<Part>(static_cast<std::size_t>(all.count)) : nullptr;
    for (std::int32_t m = 0; both && m < all.count; ++m)
      if (const Part* const from = m < first ? before : behind) both[m] = from[m < first ? m : m - first];
    return both;
  };
  all.force = join_parts(rows_.force, rows.force), all.pressure = join_parts(rows_.pressure, rows.pressure);
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
  if (rows.pressure) volumes_ = memory.array<RowVolume>(count), memory.keep_array(volumes_, count);
  for (std::int32_t* const number : {&version_, &first_}) memory.keep(*number);
  if (memory.failed()) return false;
  for (std::int32_t m = 0; m < rows.count; ++m) {
    double most = 0;
    for (std::int32_t n = 0; n < rows.nodes; ++n) most = std::max(most, dot(rows.at(m, n), rows.at(m, n)));
    longest_[m] = std::sqrt(most) * (1 + 1e-12);
  }
  rows_.longest = longest_;
  if (!followers_.create(memory, &rows_)) return false;
  followers_.keep(memory);
  return true;
}

void Offset::forget() {
  for (double* const array : {now_, before_, given_, given_before_}) std::fill_n(array, count(), 0.0);
  if (volumes_) std::fill_n(volumes_, count(), RowVolume{});
  first_ = 1;
}

void Offset::end_last_step() {
  std::copy_n(now_, count(), before_);
}

void Offset::begin_step() {
  if (changed_) changed_->begin_step(*this);
  stepped_ = change();
  for (std::int32_t m = 0; m < count(); ++m) step_[m] = now_[m] - before_[m];
  if (first_) std::copy_n(now_, count(), before_);
  if (first_ && changed_) changed_->keep_moved();
  first_ = 0;
}

void Offset::follow(std::int32_t of, const std::int32_t* which, const double* v) {
  followers_.follow(of, which, v), ++version_;
}

void Offset::follow_held(const RowVolume* volumes, OffsetFollowers* followers) const {
  std::int32_t which[kMostOffsetRows];
  for (std::int32_t m = 0; m < volume_rows_; ++m) which[m] = volumes[m].holds;
  followers->follow(volume_rows_, which, volume_of_);
}

void Offset::take_told(const RowVolume* told) {
  bool others = false;
  for (std::int32_t m = 0; m < volume_rows_; ++m) {
    others = others || (told[m].holds != 0) != followers_.follows(m);
    volumes_[m].pressure = told[m].pressure, volumes_[m].beyond = told[m].beyond, volumes_[m].swept = told[m].swept;
  }
  if (others) follow_held(told, &followers_), ++version_;
}

void Offset::start_from(const double* q, const double* whole) {
  restarted_ = length_of(given_, nullptr);
  for (std::int32_t m = 0; m < count(); ++m) now_[m] = q[m], given_[m] = whole[m] - q[m];
}

void Offset::take_forces(const ContactConstraints& set, const Vec3* force) {
  restarted_ = 0;
  if (!has_given()) return;
  std::copy_n(given_, count(), given_before_);
  std::fill_n(given_, count(), 0.0);
  for (std::int32_t e = 0; e < set.node_count; ++e) followers_.subtract_force(set.nodes[e].node, force[e], given_);
  followers_.solve(given_);
}

Vec3 Offset::given_by(const double* amounts, std::int32_t node) const {
  return rows_.sum_at(amounts, node);
}

// from: nullptr for zeros.
double Offset::length_of(const double* amounts, const double* from) const {
  double sum = 0;
  for (std::int32_t m = 0; m < count(); ++m) sum += std::fabs(amounts[m] - (from ? from[m] : 0)) * longest_[m];
  return sum;
}

double Offset::longest() const {
  const double length = length_of(now_, nullptr) + restarted_;
  return changed_ ? length + changed_->moved().longest() : length;
}

double Offset::change() const {
  const double length = length_of(now_, before_);
  return changed_ ? length + changed_->moved().change() : length;
}

// In functions of their own: many places call them, and the rows are a loop.
Vec3 Offset::now(std::int32_t node) const {
  if (!changed_) return rows_.sum_at(now_, node);
  return rows_.sum_at(now_, changed_->at_rest(node)) + changed_->moved().now(node);
}

Vec3 Offset::before(std::int32_t node) const {
  if (!changed_) return rows_.sum_at(before_, node);
  return rows_.sum_at(before_, changed_->at_rest(node)) + changed_->moved().before(node);
}

Vec3 Offset::step_of(std::int32_t node) const {
  if (!changed_) return rows_.sum_at(step_, node);
  return rows_.sum_at(step_, changed_->at_rest(node)) + (changed_->moved().now(node) - changed_->moved().before(node));
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
