#include "runtime/cut/cut_rebase.h"

#include <algorithm>

#include "runtime/base/step_work.h"
#include "runtime/cut/dense_loops.h"

namespace palpate {

bool CutRebase::create(SceneMemory& memory, const Parts& parts) {
  parts_ = parts;
  PatternFields& fields = parts.response->fields();
  const PatternFields::Source& of = fields.source();
  numbers_.columns = of.tensors->columns, numbers_.most = numbers_.columns + parts.capacity.new_nodes;
  numbers_.of_node = memory.array<std::int32_t>(static_cast<std::size_t>(of.surface_nodes));
  numbers_.node = memory.array<std::int32_t>(static_cast<std::size_t>(numbers_.most));
  if (memory.failed()) return false;
  std::fill_n(numbers_.of_node, of.surface_nodes, -1);
  for (std::int32_t k = 0; k < numbers_.most; ++k) {
    numbers_.node[k] = k < numbers_.columns ? of.touchable[k] : of.first_reserve + k - numbers_.columns;
    numbers_.of_node[numbers_.node[k]] = k;
  }
  const std::size_t stride = static_cast<std::size_t>(padded_row(3 * numbers_.most));
  if (!fields.create_base(memory, numbers_.of_node, stride) ||
      !next_.create(memory, *parts.body, *parts.pairs, parts.capacity, parts.supports) ||
      !next_fields_.create_beside(memory, fields, next_))
    return false;
  const std::size_t of_rank = next_.stride(),
                    all_nodes = static_cast<std::size_t>(parts.body->node_count + parts.capacity.new_nodes);
  for (int b = 0; b < 2; ++b) {
    bases_[b].stride = stride;
    bases_[b].added = memory.array<double>(3 * static_cast<std::size_t>(numbers_.most) * stride);
    bases_[b].share = memory.array<LoadShare>(all_nodes);
    if (!pairs_[b].create(memory, *parts.pairs, compliance().tissue(), bases_[b], numbers_, of.first_reserve,
                          parts.capacity.nodes))
      return false;
  }
  matrix_ = memory.array<double>(static_cast<std::size_t>(parts.capacity.patterns) * of_rank);
  weighed_ = memory.array<double>(3 * kBlock * of_rank), scratch_.z = memory.array<double>(3 * kBlock * of_rank);
  scratch_.product = memory.array<double>(3 * kBlock * of_rank);
  scratch_.tile = memory.array<double>(9 * kBlock);
  scratch_.moved = memory.array<float>(3 * static_cast<std::size_t>(of.surface_nodes));
  begun_ = memory.array<std::int32_t>(kMost);
  memory.keep(state_), memory.keep_array(begun_, kMost, state_.count);
  return !memory.failed();
}

bool CutRebase::take_loads(SceneMemory& memory) {
  const auto loads = static_cast<std::size_t>(parts_.response->loads());
  for (CutBase& base : bases_) base.moved = memory.array<float>(loads * base.stride);
  return !memory.failed();
}

void CutRebase::forget() {
  state_ = {};
  next_.forget(), next_fields_.forget();
}

void CutRebase::begin(std::int32_t place) {
  state_.stage = kFill, state_.block = state_.run = 0;
  state_.begun = state_.followed = place;
  rank_ = compliance().rank();
  std::copy_n(compliance().matrix(), static_cast<std::size_t>(rank_) * compliance().stride(), matrix_);
  CutBase& made = other_base();
  const CutTissue& tissue = compliance().tissue();
  made.count = numbers_.columns + parts_.response->new_nodes();
  for (std::int32_t n = 0; n < tissue.nodes(); ++n) made.share[n] = tissue.loads(n);
  for (std::int32_t m = 0; m < parts_.response->loads(); ++m) {
    parts_.response->find_moved_by(parts_.offset->rows(), m, scratch_.moved);
    for (std::int32_t k = 0; k < made.count; ++k)
      std::copy_n(scratch_.moved + 3 * static_cast<std::size_t>(numbers_.node[k]), 3,
                  made.moved + static_cast<std::size_t>(m) * made.stride + 3 * static_cast<std::size_t>(k));
  }
  next_.begin_from(compliance(), pairs_[&made - bases_]);
  next_fields_.begin_from(parts_.response->fields(), made);
}

// weighed_: Z M of the rows of a block.
void CutRebase::weigh_block() {
  const PatternFields& fields = parts_.response->fields();
  const std::int32_t first = kBlock * state_.block, nodes = std::min(kBlock, other_base().count - first);
  const std::size_t stride = fields.stride();
  std::fill_n(scratch_.z, 3 * kBlock * stride, 0.0);
  for (std::int32_t k = 0; k < nodes; ++k)
    for (std::size_t i = 0; i < 3; ++i)
      std::copy_n(fields.row(numbers_.node[first + k]) + i * stride, rank_,
                  scratch_.z + (3 * static_cast<std::size_t>(k) + i) * stride);
  row_products(matrix_, rank_, scratch_.z, 3 * kBlock, stride, padded_row(rank_), scratch_.product, 3 * kBlock);
  std::fill_n(weighed_, 3 * kBlock * stride, 0.0);
  for (std::int32_t p = 0; p < rank_; ++p)
    for (std::size_t r = 0; r < 3 * kBlock; ++r)
      weighed_[r * stride + static_cast<std::size_t>(p)] =
          scratch_.product[static_cast<std::size_t>(p) * 3 * kBlock + r];
}

// Rows of a block, columns of a run of nodes up to the diagonal, and the same across it.
double CutRebase::fill_tile() {
  const PatternFields& fields = parts_.response->fields();
  CutBase& made = other_base();
  const std::int32_t first = kBlock * state_.block, end = std::min(first + kBlock, made.count),
                     begin = kRun * state_.run, last = std::min(begin + kRun, end);
  const bool is_first = state_.run == 0;
  if (is_first) weigh_block();
  for (std::int32_t l = begin; l < last; ++l) {
    const std::int32_t node = numbers_.node[l];
    row_products(fields.row(node), 3, weighed_, 3 * kBlock, fields.stride(), padded_row(rank_), scratch_.tile,
                 3 * kBlock);
    for (std::int32_t k = std::max(first, l); k < end; ++k) {
      const Mat3 before = fields.added(numbers_.node[k], node);
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
          const double a = before.m[i][j] + scratch_.tile[3 * kBlock * j + 3 * (k - first) + i];
          made.added[(3 * static_cast<std::size_t>(k) + static_cast<std::size_t>(i)) * made.stride +
                     static_cast<std::size_t>(3 * l + j)] = a;
          made.added[(3 * static_cast<std::size_t>(l) + static_cast<std::size_t>(j)) * made.stride +
                     static_cast<std::size_t>(3 * k + i)] = a;
        }
    }
  }
  if (last < end)
    ++state_.run;
  else
    ++state_.block, state_.run = 0;
  if (kBlock * state_.block >= made.count) state_.stage = kFollow;
  return cost_of_tile(last - begin, rank_, is_first);
}

double CutRebase::cost_of_tile(std::int32_t nodes, std::int32_t rank, bool is_first) {
  const double of_rows = 3.0 * kBlock * rank / kDense;
  return of_rows * (3 * nodes + (is_first ? rank : 0));
}

void CutRebase::finish(bool replayed) {
  begun_[state_.count++] = state_.begun;
  state_.stage = kIdle, state_.is_asked = 0;
  std::swap(*parts_.compliance, next_);
  parts_.response->fields().exchange(next_fields_);
  parts_.response->note_exchange(replayed);
  if (!replayed) parts_.field->note_change();
}

}  // namespace palpate
