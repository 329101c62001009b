#include "runtime/cut/pattern_fields.h"

#include <algorithm>
#include <utility>

#include "runtime/contact/node_compliance.h"
#include "runtime/cut/dense_loops.h"
#include "runtime/dense/superposition.h"

namespace palpate {
namespace {

constexpr std::int32_t kPatternsAtOnce = 16;
// Forces of a pattern at most: nodes of one change.
constexpr std::int32_t kMostEntries = kPatternsAtOnce * 1024;
// Rows of a base that are summed at once.
constexpr std::int32_t kMostSources = 768;

}  // namespace

bool PatternFields::create(SceneMemory& memory, const Source& source) {
  source_ = source;
  const auto nodes = static_cast<std::size_t>(source.surface_nodes), numbers = 3 * nodes,
             slots = static_cast<std::size_t>(source.compliance->most_slots());
  Shared& s = shared_;
  s.pair = memory.array<std::int32_t>(nodes), s.column = memory.array<std::int32_t>(nodes);
  s.of_node = memory.array<double>(3 * numbers);
  s.pair_row = memory.array<double>(9 * static_cast<std::size_t>(source.pair_count));
  s.pattern = memory.array<double>(static_cast<std::size_t>(kPatternsAtOnce) * numbers);
  s.moved_by = memory.array<float>(numbers);
  s.row = memory.array<const void*>(3 * slots);
  s.coefficient = memory.array<float>(3 * slots);
  s.entry = memory.array<Entry>(kMostEntries);
  s.first = memory.array<std::int32_t>(slots), s.slot = memory.array<std::int32_t>(slots);
  s.sum = memory.array<double>(static_cast<std::size_t>(padded_row(3 * source.surface_nodes)));
  s.sum_row = memory.array<const double*>(kMostSources), s.sum_coefficient = memory.array<double>(kMostSources);
  if (memory.failed()) return false;
  for (std::int32_t n = 0; n < source.surface_nodes; ++n) s.column[n] = -1;
  for (std::int32_t k = 0; k < source.tensors->columns; ++k) s.column[source.touchable[k]] = k;
  std::fill_n(s.pair, nodes, -1);
  for (std::int32_t k = 0; k < source.pair_count; ++k) s.pair[source.pair_nodes[k]] = k;
  return create_beside(memory, *this, *source.compliance);
}

bool PatternFields::create_beside(SceneMemory& memory, const PatternFields& other, const CutCompliance& compliance) {
  source_ = other.source_, shared_ = other.shared_, base_number_ = other.base_number_;
  source_.compliance = &compliance, stride_ = compliance.stride();
  const auto nodes = static_cast<std::size_t>(source_.surface_nodes);
  z_ = memory.array<double>(3 * nodes * stride_);
  origin_ = memory.array<std::int32_t>(nodes), number_ = memory.array<std::int32_t>(nodes);
  for (std::int32_t n = 0; n < source_.surface_nodes && !memory.failed(); ++n) origin_[n] = n;
  return !memory.failed();
}

void PatternFields::forget() {
  for (std::int32_t n = source_.first_reserve; n < nodes(); ++n) origin_[n] = n;
  new_count_ = filled_ = 0, base_ = nullptr;
}

void PatternFields::begin_from(const PatternFields& now, const CutBase& base) {
  new_count_ = now.new_count_, filled_ = 0, base_ = &base;
  std::copy_n(now.origin_, source_.surface_nodes, origin_);
  std::copy_n(base_number_, source_.surface_nodes, number_);
}

void PatternFields::exchange(PatternFields& other) {
  std::swap(*this, other);
  std::swap(source_.compliance, other.source_.compliance);
}

void PatternFields::add_node(std::int32_t own, std::int32_t parent) {
  origin_[own] = origin_[parent];
  if (base_) number_[own] = number_[parent];
  for (int i = 0; i < 3; ++i)
    std::copy_n(row(parent) + static_cast<std::size_t>(i) * stride_, filled_,
                row(own) + static_cast<std::size_t>(i) * stride_);
  ++new_count_;
}

bool PatternFields::add_patterns() {
  bool known = true;
  const std::int32_t rank = source_.compliance->rank();
  for (; filled_ < rank && known; filled_ = std::min(rank, filled_ + kPatternsAtOnce))
    known = fill(filled_, std::min(rank, filled_ + kPatternsAtOnce));
  return known;
}

// shared_.of_node: C of the surface nodes at rest, by their numbers, for unit forces on a node at rest.
bool PatternFields::read_column(std::int32_t node) {
  const auto numbers = 3 * static_cast<std::size_t>(source_.surface_nodes);
  const std::int32_t column = node < source_.surface_nodes ? shared_.column[node] : -1;
  double* const c = shared_.of_node;
  Mat3 self;
  const Tensors& tensors = *source_.tensors;
  if (column >= 0 && !self_compliance(tensors.stiffness + 9 * static_cast<std::size_t>(column), &self)) return false;
  for (std::int32_t n = 0; n < source_.first_reserve; ++n) {
    if (shared_.pair[n] >= 0) continue;
    Mat3 of;
    if (column >= 0) of = tensors.displacement(n, column) * self;
    for (std::size_t j = 0; j < 3; ++j)
      for (std::size_t i = 0; i < 3; ++i) c[j * numbers + 3 * static_cast<std::size_t>(n) + i] = of.m[i][j];
  }
  if (source_.pair_count == 0) return true;
  if (!read_pairs(node)) return false;
  for (std::size_t j = 0; j < 3; ++j)
    for (std::size_t k = 0; k < static_cast<std::size_t>(source_.pair_count); ++k)
      std::copy_n(shared_.pair_row + 3 * (j * static_cast<std::size_t>(source_.pair_count) + k), 3,
                  c + j * numbers + 3 * static_cast<std::size_t>(source_.pair_nodes[k]));
  return true;
}

// shared_.pair_row: the same of the nodes of `pairs`, in their order.
bool PatternFields::read_pairs(std::int32_t node) {
  return source_.pairs->read(node, source_.pair_nodes, source_.pair_count, shared_.pair_row,
                             3 * static_cast<std::size_t>(source_.pair_count));
}

// A pattern's field as a sum of stored rows, as the shape of any forces is.
bool PatternFields::superpose_pattern(std::int32_t pattern) {
  const CutCompliance& compliance = *source_.compliance;
  const Tensors& tensors = *source_.tensors;
  int rows = 0;
  bool known = true;
  compliance.basis().for_each_force(pattern, [&](std::int32_t slot, Vec3 force) {
    const std::int32_t node = compliance.tissue().origin(compliance.node_of_slot(slot)),
                       column = node < source_.surface_nodes ? shared_.column[node] : -1;
    Mat3 self;
    if (column < 0) return;
    known = known && self_compliance(tensors.stiffness + 9 * static_cast<std::size_t>(column), &self);
    const Vec3 modified = self * force;
    for (int j = 0; j < 3; ++j) {
      shared_.row[rows] = tensors.surface.row(column, j);
      shared_.coefficient[rows++] = static_cast<float>(modified[j]) * tensors.surface.row_scale(column, j);
    }
  });
  const auto numbers = 3 * static_cast<std::size_t>(source_.first_reserve);
  superpose(tensors.surface.type, shared_.row, shared_.coefficient, rows, 0, numbers, shared_.moved_by);
  for (std::int32_t n = 0; n < nodes(); ++n)
    for (std::size_t i = 0; i < 3; ++i)
      row(n)[i * stride_ + static_cast<std::size_t>(pattern)] =
          static_cast<double>(shared_.moved_by[3 * static_cast<std::size_t>(origin_[n]) + i]);
  return known;
}

// Patterns first .. end - 1.
bool PatternFields::fill(std::int32_t first, std::int32_t end) {
  const auto all = [this](std::int32_t n) { return origin_[n]; };
  const auto paired = [this](std::int32_t n) { return shared_.pair[origin_[n]]; };
  bool known = true;
  if (source_.tensors->compliance) {
    const auto read = [this](std::int32_t node) { return read_column(node); };
    known = fill_by_columns(first, end, shared_.of_node, source_.surface_nodes, read, all);
  } else {
    for (std::int32_t p = first; p < end; ++p) known = superpose_pattern(p) && known;
    const auto read = [this](std::int32_t node) { return read_pairs(node); };
    if (source_.pair_count > 0)
      known = known && fill_by_columns(first, end, shared_.pair_row, source_.pair_count, read, paired);
  }
  if (!known) return false;
  for (std::int32_t p = first; p < end && base_; ++p) add_base(p);
  // The jump of a new node moves it and those that come from it.
  const CutBasis& basis = source_.compliance->basis();
  const CutTissue& tissue = source_.compliance->tissue();
  for (std::int32_t own = tissue.base_nodes(); own < tissue.nodes(); ++own)
    for (std::int32_t node = own; node >= tissue.base_nodes(); node = tissue.parent(node))
      for (std::int32_t p = first; p < end; ++p)
        if (const std::int32_t jump = basis.jump(p); jump >= 0 && jump / 3 == node - source_.rest_nodes)
          row(surface_node(own))[static_cast<std::size_t>(jump % 3) * stride_ + static_cast<std::size_t>(p)] += 1;
  return true;
}

// Slot by slot: read(node at rest) puts its column of `count` nodes into `column`, [3][3 count]; index(surface node): which of them it has, -1: none.
template <class Read, class Index>
bool PatternFields::fill_by_columns(std::int32_t first, std::int32_t end, const double* column, std::int32_t count,
                                    Read read, Index index) {
  const CutCompliance& compliance = *source_.compliance;
  const CutBasis& basis = compliance.basis();
  const auto numbers = 3 * static_cast<std::size_t>(count);
  std::int32_t entries = 0, slots = 0;
  for (std::int32_t p = first; p < end; ++p)
    basis.for_each_force(p, [&](std::int32_t slot, Vec3 force) {
      if (entries == kMostEntries) return;
      if (shared_.first[slot] == 0) shared_.slot[slots++] = slot;
      shared_.entry[entries] = {p, shared_.first[slot], force};
      shared_.first[slot] = ++entries;
    });
  std::fill_n(shared_.pattern, static_cast<std::size_t>(end - first) * numbers, 0.0);
  bool known = entries < kMostEntries;
  for (std::int32_t s = 0; s < slots; ++s) {
    const std::int32_t slot = shared_.slot[s];
    known = known && read(compliance.tissue().origin(compliance.node_of_slot(slot)));
    for (std::int32_t at = shared_.first[slot]; at > 0 && known; at = shared_.entry[at - 1].next) {
      const Entry& entry = shared_.entry[at - 1];
      double* const to = shared_.pattern + static_cast<std::size_t>(entry.pattern - first) * numbers;
      for (int j = 0; j < 3; ++j) {
        const double force = entry.force[j], *const from = column + static_cast<std::size_t>(j) * numbers;
        if (force == 0) continue;
        for (std::size_t i = 0; i < numbers; ++i) to[i] += force * from[i];
      }
    }
    shared_.first[slot] = 0;
  }
  if (!known) return false;
  for (std::int32_t n = 0; n < nodes(); ++n) {
    const std::int32_t at = index(n);
    for (std::size_t i = 0; i < 3 && at >= 0; ++i) {
      double* const z = row(n) + i * stride_;
      for (std::int32_t p = first; p < end; ++p)
        z[p] = shared_.pattern[static_cast<std::size_t>(p - first) * numbers + 3 * static_cast<std::size_t>(at) + i];
    }
  }
  return true;
}

// ---- the base --------------------------------------------------------------------------------------------------------

void PatternFields::add_base(std::int32_t pattern) {
  const CutCompliance& compliance = *source_.compliance;
  begin_sum();
  compliance.basis().for_each_force(
      pattern, [&](std::int32_t slot, Vec3 force) { add_to_sum(surface_node(compliance.node_of_slot(slot)), force); });
  const double* const sum = end_sum();
  for (std::int32_t n = 0; n < nodes(); ++n)
    for (int i = 0; i < 3 && number_[n] >= 0; ++i)
      row(n)[static_cast<std::size_t>(i) * stride_ + static_cast<std::size_t>(pattern)] += sum[3 * number_[n] + i];
}

Mat3 PatternFields::added(std::int32_t a, std::int32_t b) const {
  Mat3 c;
  const std::int32_t of_a = number_in_base(a), of_b = number_in_base(b);
  for (int i = 0; i < 3 && of_a >= 0 && of_b >= 0; ++i)
    for (int j = 0; j < 3; ++j) c.m[i][j] = base_->row(of_a, i)[3 * of_b + j];
  return c;
}

void PatternFields::begin_sum() const {
  std::fill_n(shared_.sum, base_->stride, 0.0);
  sources_ = 0;
}

void PatternFields::add_to_sum(std::int32_t node, Vec3 force) const {
  const std::int32_t number = number_[node];
  if (number < 0) return;
  if (sources_ + 3 > kMostSources) flush_sum();
  for (int i = 0; i < 3; ++i)
    shared_.sum_row[sources_] = base_->row(number, i), shared_.sum_coefficient[sources_++] = force[i];
}

void PatternFields::flush_sum() const {
  add_row_sums(shared_.sum, 1, base_->stride, padded_row(3 * base_->count), shared_.sum_row, sources_,
               shared_.sum_coefficient);
  sources_ = 0;
}

const double* PatternFields::end_sum() const {
  flush_sum();
  return shared_.sum;
}

}  // namespace palpate
