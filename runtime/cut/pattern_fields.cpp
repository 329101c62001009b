#include "runtime/cut/pattern_fields.h"

#include <algorithm>
#include <utility>

#include "runtime/base/step_work.h"
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
  s.moved_by = memory.array<float>(kPatternsAtOnce * numbers);
  s.row = memory.array<const void*>(kPatternsAtOnce * 3 * slots);
  s.coefficient = memory.array<float>(kPatternsAtOnce * 3 * slots);
  s.entry = memory.array<Entry>(kMostEntries);
  s.first = memory.array<std::int32_t>(slots), s.slot = memory.array<std::int32_t>(slots);
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
  new_count_ = filled_ = 0, base_ = nullptr, operations_ = 0;
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

// Rows in single precision, which most bundles have, are summed twice as fast as those of a base.
double PatternFields::cost_of(std::int32_t first, std::int32_t end) const {
  double forces = 0;
  for (std::int32_t p = first; p < end; ++p)
    source_.compliance->basis().for_each_force(p, [&](std::int32_t, Vec3) { ++forces; });
  return forces * 9 * (base_ ? 1.5 : 0.5) * source_.surface_nodes / kDense;
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

// The fields of patterns as sums of stored rows, as the shape of any forces is: run by run of numbers, so that the patterns of a change, which act on the
// same nodes, find their rows in the cache.
bool PatternFields::superpose_patterns(std::int32_t first, std::int32_t end) {
  constexpr std::size_t kRun = 384;
  const std::size_t rows = 3 * static_cast<std::size_t>(source_.compliance->most_slots()),
                    numbers = 3 * static_cast<std::size_t>(source_.first_reserve),
                    patterns = static_cast<std::size_t>(end - first);
  int count[kPatternsAtOnce];
  for (std::size_t k = 0; k < patterns; ++k)
    if (!list_rows(first + static_cast<std::int32_t>(k), k * rows, &count[k])) return false;
  for (std::size_t begin = 0; begin < numbers; begin += kRun)
    for (std::size_t k = 0; k < patterns; ++k)
      superpose(source_.tensors->surface.type, shared_.row + k * rows, shared_.coefficient + k * rows, count[k], begin,
                std::min(kRun, numbers - begin), shared_.moved_by + k * numbers + begin);
  for (std::int32_t n = 0; n < nodes(); ++n)
    for (std::size_t i = 0; i < 3; ++i) {
      double* const z = row(n) + i * stride_ + static_cast<std::size_t>(first);
      const float* const moved = shared_.moved_by + 3 * static_cast<std::size_t>(origin_[n]) + i;
      for (std::size_t k = 0; k < patterns; ++k) z[k] = static_cast<double>(moved[k * numbers]);
    }
  return true;
}

// The stored rows of a pattern and their coefficients, from a place on in the lists.
bool PatternFields::list_rows(std::int32_t pattern, std::size_t at, int* count) {
  const CutCompliance& compliance = *source_.compliance;
  const Tensors& tensors = *source_.tensors;
  bool known = true;
  *count = 0;
  compliance.basis().for_each_force(pattern, [&](std::int32_t slot, Vec3 force) {
    const std::int32_t node = compliance.tissue().origin(compliance.node_of_slot(slot)),
                       column = node < source_.surface_nodes ? shared_.column[node] : -1;
    Mat3 self;
    if (column < 0) return;
    known = known && self_compliance(tensors.stiffness + 9 * static_cast<std::size_t>(column), &self);
    const Vec3 modified = self * force;
    for (int j = 0; j < 3; ++j, ++*count) {
      const std::size_t place = at + static_cast<std::size_t>(*count);
      shared_.row[place] = tensors.surface.row(column, j);
      shared_.coefficient[place] = static_cast<float>(modified[j]) * tensors.surface.row_scale(column, j);
    }
  });
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
    known = superpose_patterns(first, end);
    const auto read = [this](std::int32_t node) { return read_pairs(node); };
    if (source_.pair_count > 0)
      known = known && fill_by_columns(first, end, shared_.pair_row, source_.pair_count, read, paired);
  }
  if (!known) return false;
  if (base_) add_base(first, end);
  operations_ += cost_of(first, end);
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

bool PatternFields::create_base(SceneMemory& memory, const std::int32_t* base_number, std::size_t stride) {
  base_number_ = base_number;
  shared_.sum = memory.array<double>(kPatternsAtOnce * stride);
  shared_.sum_row = memory.array<const double*>(kMostSources);
  shared_.sum_coefficient = memory.array<double>(kPatternsAtOnce * kMostSources);
  return !memory.failed();
}

// Of patterns first .. end - 1 at once: they act on the same nodes, whose rows are long.
void PatternFields::add_base(std::int32_t first, std::int32_t end) {
  const CutCompliance& compliance = *source_.compliance;
  const CutBasis& basis = compliance.basis();
  const std::size_t stride = base_->stride, patterns = static_cast<std::size_t>(end - first);
  std::int32_t slots = 0;
  for (std::int32_t p = first; p < end; ++p)
    basis.for_each_force(p, [&](std::int32_t slot, Vec3) {
      if (shared_.first[slot] == 0) shared_.slot[slots] = slot, shared_.first[slot] = ++slots;
    });
  std::fill_n(shared_.sum, patterns * stride, 0.0);
  for (std::int32_t begin = 0; begin < slots; begin += kMostSources / 3) {
    const std::int32_t count = std::min(kMostSources / 3, slots - begin), sources = 3 * count;
    for (std::int32_t k = 0; k < count; ++k) {
      const std::int32_t number = number_[surface_node(compliance.node_of_slot(shared_.slot[begin + k]))];
      for (int i = 0; i < 3; ++i) shared_.sum_row[3 * k + i] = base_->row(std::max(0, number), i);
    }
    std::fill_n(shared_.sum_coefficient, patterns * static_cast<std::size_t>(sources), 0.0);
    for (std::int32_t p = first; p < end; ++p)
      basis.for_each_force(p, [&](std::int32_t slot, Vec3 force) {
        const std::int32_t k = shared_.first[slot] - 1 - begin;
        if (k < 0 || k >= count || number_[surface_node(compliance.node_of_slot(slot))] < 0) return;
        double* const of_slot = shared_.sum_coefficient + (p - first) * sources + 3 * k;
        store3(load3(of_slot) + force, of_slot);  // of a node and of those that split from it
      });
    add_row_sums(shared_.sum, end - first, stride, padded_row(3 * base_->count), shared_.sum_row, sources,
                 shared_.sum_coefficient);
  }
  for (std::int32_t s = 0; s < slots; ++s) shared_.first[shared_.slot[s]] = 0;
  for (std::int32_t n = 0; n < nodes(); ++n)
    for (std::size_t i = 0; i < 3 && number_[n] >= 0; ++i) {
      double* const z = row(n) + i * stride_ + static_cast<std::size_t>(first);
      const double* const sum = shared_.sum + 3 * static_cast<std::size_t>(number_[n]) + i;
      for (std::size_t k = 0; k < patterns; ++k) z[k] += sum[k * stride];
    }
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
