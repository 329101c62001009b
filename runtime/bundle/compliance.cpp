#include "runtime/bundle/compliance.h"

#include <algorithm>
#include <cstring>

#include "runtime/bundle/fetch_block.h"
#include "runtime/dense/superposition.h"

namespace palpate {

using formats::ComplianceBlock;

namespace {

// superpose_onto adds runs by threes at least; one or two left over would take a pass of their own, longer than a third that counts
// for nothing.
constexpr int kRunsAtOnce = 3;

}  // namespace

// Visits every block from each touchable cluster that it covers: as columns and, for blocks off the diagonal, as rows.
template <class Visit>
void Compliance::for_each_side(Visit visit) const {
  for (std::int32_t b = 0; b < stored_.block_count; ++b) {
    const formats::StoredBlock& s = stored_.blocks[b];
    const ComplianceBlock& block = blocks_[b];
    for (std::int32_t q = s.column_begin; q < s.column_end; ++q)
      visit(q, Side{b, 0, block.row, block.row + block.rows});
    const bool diagonal = s.row_begin == s.column_begin && s.row_end == s.column_end;
    if (diagonal || s.row_begin >= touchable_clusters_) continue;
    for (std::int32_t q = s.row_begin; q < s.row_end; ++q)
      visit(q, Side{b, 1, block.column, block.column + block.columns});
  }
}

Compliance::Outcome Compliance::create(SceneMemory& memory, const Stored& stored, std::int32_t most_loaded) {
  stored_ = stored;
  blocks_ = memory.array<ComplianceBlock>(static_cast<std::size_t>(stored.block_count));
  if (memory.failed()) return Outcome::no_memory;
  std::uint64_t first = 0;
  std::int32_t most_runs = 3 * most_loaded;
  for (std::int32_t b = 0; b < stored.block_count; ++b) {
    blocks_[b] = formats::placed_block(stored.blocks[b], stored.cluster_ends, first, stored.scale[b]);
    first += blocks_[b].numbers();
    most_runs = std::max(most_runs, blocks_[b].rank);
  }
  loaded_slot_ = memory.array<std::int32_t>(static_cast<std::size_t>(most_loaded));
  loaded_force_ = memory.array<float>(3 * static_cast<std::size_t>(most_loaded));
  const std::size_t runs = static_cast<std::size_t>(most_runs) + kRunsAtOnce - 1;
  runs_ = memory.array<const void*>(runs);
  coefficients_ = memory.array<float>(runs);
  Outcome outcome = assign_slots(memory);
  if (outcome == Outcome::made) outcome = list_sides(memory);
  if (outcome == Outcome::made) measure();
  return outcome;
}

Compliance::Outcome Compliance::assign_slots(SceneMemory& memory) {
  const std::int32_t nodes = stored_.surface_nodes, columns = stored_.columns;
  slot_of_node_ = memory.array<std::int32_t>(static_cast<std::size_t>(nodes));
  slot_of_column_ = memory.array<std::int32_t>(static_cast<std::size_t>(columns));
  cluster_of_slot_ = memory.array<std::int32_t>(static_cast<std::size_t>(columns));
  if (memory.failed()) return Outcome::no_memory;
  std::fill(slot_of_node_, slot_of_node_ + nodes, -1);
  for (std::int32_t p = 0; p < nodes; ++p) {
    if (slot_of_node_[stored_.nodes[p]] >= 0) return Outcome::inconsistent;
    slot_of_node_[stored_.nodes[p]] = p;
  }
  for (std::int32_t k = 0; k < columns; ++k) {
    slot_of_column_[k] = slot_of_node_[stored_.touchable[k]];
    if (slot_of_column_[k] >= columns) return Outcome::inconsistent;
  }
  for (std::int32_t q = 0, p = 0; p < columns; ++q, touchable_clusters_ = q)
    for (; p < stored_.cluster_ends[q]; ++p) cluster_of_slot_[p] = q;
  return Outcome::made;
}

Compliance::Outcome Compliance::list_sides(SceneMemory& memory) {
  first_side_ = memory.array<std::int32_t>(static_cast<std::size_t>(touchable_clusters_) + 1);
  if (memory.failed()) return Outcome::no_memory;
  // No two clusters may share two blocks, so the number of ways to take two clusters bounds the number of sides.
  const std::uint64_t most =
      static_cast<std::uint64_t>(touchable_clusters_) * static_cast<std::uint64_t>(stored_.clusters);
  std::uint64_t couples = 0;
  for (std::int32_t b = 0; b < stored_.block_count; ++b) {
    const formats::StoredBlock& s = stored_.blocks[b];
    couples +=
        static_cast<std::uint64_t>(s.row_end - s.row_begin) * static_cast<std::uint64_t>(s.column_end - s.column_begin);
    if (couples > most) return Outcome::inconsistent;
  }
  for_each_side([&](std::int32_t q, const Side&) { ++first_side_[q + 1]; });
  for (std::int32_t q = 0; q < touchable_clusters_; ++q) first_side_[q + 1] += first_side_[q];
  sides_ = memory.array<Side>(static_cast<std::size_t>(first_side_[touchable_clusters_]));
  if (memory.failed()) return Outcome::no_memory;
  for_each_side([&](std::int32_t q, const Side& side) { sides_[first_side_[q]++] = side; });
  for (std::int32_t q = touchable_clusters_; q > 0; --q) first_side_[q] = first_side_[q - 1];
  first_side_[0] = 0;
  for (std::int32_t q = 0; q < touchable_clusters_; ++q) {
    Side *begin = sides_ + first_side_[q], *end = sides_ + first_side_[q + 1];
    std::sort(begin, end, [](const Side& a, const Side& b) { return a.other_begin < b.other_begin; });
    for (const Side* side = begin; side + 1 < end; ++side)
      if (side[0].other_end > side[1].other_begin) return Outcome::inconsistent;
  }
  return Outcome::made;
}

void Compliance::measure() {
  std::uint64_t of_columns = 0;
  for_each_side([&](std::int32_t q, const Side& side) {
    const ComplianceBlock& block = blocks_[side.block];
    const auto nodes =
        static_cast<std::uint64_t>(stored_.cluster_ends[q] - formats::cluster_begin(stored_.cluster_ends, q));
    const auto other = static_cast<std::uint64_t>(side.other_end - side.other_begin);
    const auto rank = static_cast<std::uint64_t>(block.rank);
    of_columns += nodes * (rank == 0 ? 9 * other : 3 * rank * (other + 1));
  });
  numbers_per_column_ = of_columns / static_cast<std::uint64_t>(std::max(1, stored_.columns));
}

Mat3 Compliance::entry(std::int32_t node, std::int32_t column) const {
  Mat3 c;
  const std::int32_t own = slot_of_column_[column], other = slot_of_node_[node], q = cluster_of_slot_[own];
  const Side *begin = sides_ + first_side_[q], *end = sides_ + first_side_[q + 1];
  const Side* after =
      std::upper_bound(begin, end, other, [](std::int32_t slot, const Side& side) { return slot < side.other_begin; });
  if (after == begin || other >= after[-1].other_end) return c;
  const Side& side = after[-1];
  const ComplianceBlock& block = blocks_[side.block];
  double number[9];
  if (side.transposed)
    block.entry(stored_.type, stored_.values, own - block.row, other - block.column, number);
  else
    block.entry(stored_.type, stored_.values, other - block.row, own - block.column, number);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) c.m[i][j] = side.transposed ? number[3 * j + i] : number[3 * i + j];
  return c;
}

void Compliance::field(LoadedColumn* loads, std::int32_t count, float* of_slots) {
  field_of_slot_ = of_slots;
  std::fill(of_slots, of_slots + 3 * static_cast<std::size_t>(stored_.surface_nodes), 0.0f);
  apply_blocks(sorted(loads, count));
}

void Compliance::at_nodes(const float* of_slots, std::int32_t first, std::int32_t count, float* out) const {
  const std::int32_t* const slot = slot_of_node_ + first;
  const auto copy = [&](std::int32_t n, std::size_t numbers) {
    std::memcpy(out + 3 * static_cast<std::ptrdiff_t>(n), of_slots + 3 * static_cast<std::ptrdiff_t>(slot[n]),
                numbers * sizeof(float));
  };
  // Four numbers are one move; the next node overwrites the fourth.
  for (std::int32_t n = 0; n + 1 < count; ++n) copy(n, 4);
  if (count > 0) copy(count - 1, 3);
}

Loads Compliance::sorted(LoadedColumn* loads, std::int32_t count) {
  std::sort(loads, loads + count, [](const LoadedColumn& a, const LoadedColumn& b) { return a.slot < b.slot; });
  for (std::int32_t l = 0; l < count; ++l) {
    loaded_slot_[l] = loads[l].slot;
    for (int d = 0; d < 3; ++d) loaded_force_[3 * l + d] = static_cast<float>(loads[l].force[d]);
  }
  return {loaded_slot_, loaded_force_, count};
}

// The end of the loads that are on the cluster of the first one.
int Compliance::end_of_cluster(const Loads& loads, int first) const {
  int end = first + 1;
  while (end < loads.count && cluster_of_slot_[loads.slot[end]] == cluster_of_slot_[loads.slot[first]]) ++end;
  return end;
}

// The loads that the block of a side is applied to when the loads first .. next - 1, those of one cluster, have their turn. A block may
// cover several clusters: the first loaded one applies it, for the loads of all of them; the others apply it to none.
Loads Compliance::covered(const Side& side, const Loads& loads, int first, int next) const {
  const ComplianceBlock& block = blocks_[side.block];
  const std::int32_t begin = side.transposed ? block.row : block.column;
  const std::int32_t end = begin + (side.transposed ? block.rows : block.columns);
  if (first > 0 && loads.slot[first - 1] >= begin) return loads.part(first, first);
  while (next < loads.count && loads.slot[next] < end) ++next;
  return loads.part(first, next);
}

// While a block is applied, the next one is on its way from memory: blocks are short and lie apart, so that the processor foresees nothing.
// More blocks ahead, or fetching to the first-level cache, took as long or longer (touch_and_shape of runtime_bench).
void Compliance::apply_blocks(const Loads& loads) {
  for (int first = 0, next = 0; first < loads.count; first = next) {
    next = end_of_cluster(loads, first);
    const std::int32_t q = cluster_of_slot_[loads.slot[first]], end = first_side_[q + 1];
    for (std::int32_t s = first_side_[q]; s < end; ++s) {
      if (kPrefetches && s + 1 < end)
        if (const Loads part = covered(sides_[s + 1], loads, first, next); part.count > 0)
          fetch_block(blocks_[sides_[s + 1].block], stored_.type, stored_.values, sides_[s + 1].transposed != 0, part);
      if (const Loads part = covered(sides_[s], loads, first, next); part.count > 0) apply(sides_[s], part);
    }
  }
}

void Compliance::apply(const Side& side, const Loads& loads) {
  const ComplianceBlock& block = blocks_[side.block];
  if (block.rank > 0)
    apply_low_rank(block, side.transposed != 0, loads);
  else if (side.transposed)
    apply_dense_transposed(block, loads);
  else
    apply_dense(block, loads);
}

void Compliance::apply_dense(const ComplianceBlock& block, const Loads& loads) {
  int runs = 0;
  for (int l = 0; l < loads.count; ++l)
    for (int j = 0; j < 3; ++j, ++runs) {
      runs_[runs] = run(block.dense_run(loads.slot[l] - block.column, j));
      coefficients_[runs] = block.scale * loads.force[3 * l + j];
    }
  superpose_onto(stored_.type, runs_, coefficients_, runs, 0, 3 * static_cast<std::size_t>(block.rows),
                 field_of_slot_ + 3 * static_cast<std::size_t>(block.row));
}

void Compliance::apply_dense_transposed(const ComplianceBlock& block, const Loads& loads) {
  multiply_loads_onto({stored_.type, run(block.first), 3 * static_cast<std::size_t>(block.rows), 3 * block.columns,
                       block.row, block.scale},
                      loads, field_of_slot_ + 3 * static_cast<std::size_t>(block.column));
}

// C = U V^T: first the products of V^T with the loads, one weight per rank, then the sum of the columns of U with those weights
// (with U and V exchanged where the loads are on the rows).
void Compliance::apply_low_rank(const ComplianceBlock& block, bool transposed, const Loads& loads) {
  const auto rows = static_cast<std::size_t>(block.rows), columns = static_cast<std::size_t>(block.columns);
  const RunsOfSlots of_rows = {stored_.type, run(block.u_run(0)), 3 * rows, block.rank, block.row, block.scale},
                    of_columns = {stored_.type, run(block.v_run(0)), 3 * columns,
                                  block.rank,   block.column,        block.scale};
  const RunsOfSlots &own = transposed ? of_rows : of_columns, &other = transposed ? of_columns : of_rows;
  std::fill(coefficients_, coefficients_ + block.rank, 0.0f);
  multiply_loads_onto(own, loads, coefficients_);
  for (std::int32_t q = 0; q < block.rank; ++q)
    runs_[q] = static_cast<const unsigned char*>(other.numbers) +
               static_cast<std::size_t>(q) * other.stride * formats::element_bytes(stored_.type);
  superpose_onto(stored_.type, runs_, coefficients_, block.rank, 0, other.stride,
                 field_of_slot_ + 3 * static_cast<std::size_t>(other.slot));
}

}  // namespace palpate
