#include "runtime/cut/cut_basis.h"

#include <algorithm>

#include "runtime/cut/dense_loops.h"

namespace palpate {

bool CutSlots::create(SceneMemory& memory, const PairCompliance& source, std::int32_t nodes, std::int32_t most) {
  source_ = &source, most_ = most, nodes_ = nodes, stride_ = static_cast<std::size_t>(padded_row(3 * most));
  slot_of_node_ = memory.array<std::int32_t>(static_cast<std::size_t>(nodes));
  node_ = memory.array<std::int32_t>(static_cast<std::size_t>(most));
  pairs_ = memory.array<double>(3 * static_cast<std::size_t>(most) * stride_);
  return !memory.failed();
}

void CutSlots::forget(const PairCompliance& source) {
  std::fill_n(slot_of_node_, nodes_, 0);
  source_ = &source, count_ = 0;
}

std::int32_t CutSlots::take(std::int32_t node) {
  if (slot_of_node_[node] > 0) return slot_of_node_[node] - 1;
  if (count_ == most_) return -1;
  const std::int32_t slot = count_;
  node_[slot] = node;
  double* const own = pairs_ + 3 * static_cast<std::size_t>(slot) * stride_;
  if (!source_->read(node, node_, slot + 1, own, stride_)) return -2;
  for (int i = 0; i < 3; ++i)
    for (std::int32_t c = 0; c < 3 * slot; ++c)
      pairs_[static_cast<std::size_t>(c) * stride_ + static_cast<std::size_t>(3 * slot + i)] =
          own[static_cast<std::size_t>(i) * stride_ + static_cast<std::size_t>(c)];
  slot_of_node_[node] = ++count_;
  return slot;
}

bool CutBasis::create(SceneMemory& memory, std::int32_t most, std::int32_t slots, std::int32_t most_entries) {
  most_ = most, most_entries_ = most_entries, slots_ = slots;
  first_ = memory.array<std::int32_t>(static_cast<std::size_t>(most) + 1);
  slot_ = memory.array<std::int32_t>(static_cast<std::size_t>(most_entries));
  force_ = memory.array<double>(3 * static_cast<std::size_t>(most_entries));
  jump_ = memory.array<std::int32_t>(static_cast<std::size_t>(most));
  nodal_ = memory.array<std::int32_t>(static_cast<std::size_t>(slots));
  return !memory.failed();
}

void CutBasis::forget() {
  std::fill_n(nodal_, slots_, 0);
  count_ = 0;
}

std::int32_t CutBasis::begin(std::int32_t jump) {
  jump_[count_] = jump;
  first_[count_ + 1] = first_[count_];
  return count_++;
}

bool CutBasis::add(std::int32_t slot, Vec3 force) {
  const std::int32_t at = first_[count_];
  if (at == most_entries_) return false;
  slot_[at] = slot;
  store3(force, force_ + 3 * static_cast<std::size_t>(at));
  ++first_[count_];
  return true;
}

void CutBasis::drop_last(std::int32_t patterns) {
  count_ -= patterns;
}

std::int32_t CutBasis::nodal(std::int32_t slot) {
  if (nodal_[slot] > 0) return nodal_[slot] - 1;
  if (!has_room(3) || first_[count_] + 3 > most_entries_) return -1;
  for (int i = 0; i < 3; ++i) {
    Vec3 unit;
    unit[i] = 1;
    begin();
    add(slot, unit);
  }
  nodal_[slot] = count_ - 2;
  return count_ - 3;
}

std::size_t CutBasis::scratch_of_weigh(std::int32_t slots, std::int32_t patterns) {
  return kRowStep * (3 * static_cast<std::size_t>(slots) + static_cast<std::size_t>(patterns));
}

void CutBasis::weigh(const double* fields, std::size_t field_stride, int count, std::int32_t slots, double* of,
                     std::size_t stride, double* scratch) const {
  double* const side_by_side = scratch;
  double* const weighed = scratch + 3 * kRowStep * static_cast<std::size_t>(slots);
  for (int first = 0; first < count; first += kRowStep) {
    const int lanes = count - first < kRowStep ? count - first : kRowStep;
    const double* const from = fields + static_cast<std::size_t>(first) * field_stride;
    for (std::int32_t d = 0; d < 3 * slots; ++d)
      for (int lane = 0; lane < kRowStep; ++lane)
        side_by_side[kRowStep * d + lane] =
            lane < lanes ? from[static_cast<std::size_t>(lane) * field_stride + static_cast<std::size_t>(d)] : 0;
    weigh_fields({first_, slot_, force_}, count_, side_by_side, weighed);
    for (int lane = 0; lane < lanes; ++lane)
      for (std::int32_t i = 0; i < count_; ++i)
        of[static_cast<std::size_t>(first + lane) * stride + static_cast<std::size_t>(i)] =
            weighed[kRowStep * i + lane];
  }
}

bool CutSites::create(SceneMemory& memory, std::int32_t nodes, std::int32_t most) {
  most_ = most, nodes_ = nodes;
  first_ = memory.array<std::int32_t>(static_cast<std::size_t>(nodes));
  sites_ = memory.array<Site>(static_cast<std::size_t>(most));
  return !memory.failed();
}

void CutSites::forget() {
  std::fill_n(first_, nodes_, 0);
  count_ = 0;
}

CutSites::Site* CutSites::find_or_add(std::int32_t node, std::int32_t region) {
  for (std::int32_t at = first_[node]; at > 0; at = sites_[at - 1].next)
    if (sites_[at - 1].region == region) return &sites_[at - 1];
  if (count_ == most_) return nullptr;
  sites_[count_] = {node, region, -1, first_[node]};
  first_[node] = ++count_;
  return &sites_[count_ - 1];
}

void CutSites::move(std::int32_t from, std::int32_t region, std::int32_t to) {
  Site* const old = find_or_add(from, region);
  Site* const now = old ? find_or_add(to, region) : nullptr;
  if (now) now->pattern = old->pattern, old->pattern = -1;
}

}  // namespace palpate
