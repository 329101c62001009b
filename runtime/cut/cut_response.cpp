#include "runtime/cut/cut_response.h"

#include <algorithm>

#include "runtime/contact/node_compliance.h"
#include "runtime/contact/offset.h"
#include "runtime/cut/dense_loops.h"
#include "runtime/dense/superposition.h"
#include "runtime/large/block_rows.h"

namespace palpate {
namespace {

constexpr std::int32_t kPatternsAtOnce = 16;
// Forces of a pattern at most: nodes of one change.
constexpr std::int32_t kMostEntries = kPatternsAtOnce * 1024;

}  // namespace

bool CutResponse::create(SceneMemory& memory, const Source& source) {
  source_ = source, stride_ = source.compliance->stride();
  const auto nodes = static_cast<std::size_t>(source.surface_nodes), numbers = 3 * nodes,
             responses = static_cast<std::size_t>(source.responses),
             slots = static_cast<std::size_t>(source.compliance->most_slots());
  z_ = memory.array<double>(numbers * stride_);
  origin_ = memory.array<std::int32_t>(nodes), others_ = memory.array<std::int32_t>(nodes);
  column_ = memory.array<std::int32_t>(nodes);
  response_ = memory.array<double>(3 * responses * stride_), response_of_ = memory.array<std::int32_t>(responses);
  amount_ = memory.array<double>(kMostOffsetRows);
  scratch_.column = memory.array<double>(3 * numbers);
  scratch_.pair_row = memory.array<double>(9 * static_cast<std::size_t>(source.pair_count));
  scratch_.pattern = memory.array<double>(static_cast<std::size_t>(kPatternsAtOnce) * numbers);
  scratch_.x = memory.array<double>(stride_), scratch_.y = memory.array<double>(stride_),
  scratch_.alone = memory.array<double>(stride_);
  scratch_.spread = memory.array<double>(numbers * kMostRows);
  scratch_.moved = memory.array<float>(numbers), scratch_.moved_by = memory.array<float>(numbers);
  scratch_.row = memory.array<const void*>(3 * slots), scratch_.coefficient = memory.array<float>(3 * slots);
  scratch_.slot_moved = memory.array<Vec3>(slots);
  scratch_.entry = memory.array<Entry>(kMostEntries);
  scratch_.first = memory.array<std::int32_t>(slots), scratch_.slot = memory.array<std::int32_t>(slots);
  if (!moved_.create(memory, source.surface_nodes, source.surface_nodes)) return false;
  for (std::int32_t n = 0; n < source.surface_nodes; ++n) origin_[n] = n, column_[n] = -1;
  for (std::int32_t k = 0; k < source.tensors->columns; ++k) column_[source.touchable[k]] = k;
  std::int32_t* const listed = others_;  // 1 where a node is, first
  for (std::int32_t k = 0; k < source.pair_count; ++k) listed[source.pair_nodes[k]] = 1;
  for (std::int32_t n = 0; n < source.first_reserve; ++n)
    if (!listed[n]) others_[other_count_++] = n;
  std::fill_n(response_of_, source.responses, -1);
  return true;
}

void CutResponse::keep(SceneMemory& memory) {
  memory.keep(changed_);
  memory.keep_array(amount_, kMostOffsetRows);
}

void CutResponse::forget(bool replayed) {
  for (std::int32_t n = source_.first_reserve; n < nodes(); ++n) origin_[n] = n;
  new_count_ = filled_ = 0;
  ++version_;
  std::fill_n(scratch_.moved, 3 * static_cast<std::size_t>(source_.surface_nodes), 0.0f);
  std::fill_n(response_of_, source_.responses, -1);
  if (replayed) return;
  moved_.forget(), changed_ = 0;
  std::fill_n(amount_, kMostOffsetRows, 0.0);
}

// ---- Z ---------------------------------------------------------------------------------------------------------------

bool CutResponse::take_change(bool replayed) {
  const CutTissue& tissue = source_.compliance->tissue();
  const std::int32_t before = new_count_;
  for (std::int32_t node = source_.rest_nodes + new_count_; node < tissue.nodes(); ++node, ++new_count_) {
    const std::int32_t own = surface_node(node), parent = surface_node(tissue.parent(node));
    origin_[own] = origin_[parent];
    for (int i = 0; i < 3; ++i)
      std::copy_n(row(parent) + static_cast<std::size_t>(i) * stride_, filled_,
                  row(own) + static_cast<std::size_t>(i) * stride_);
    if (!replayed) moved_.copy_node(parent, own);
  }
  bool known = true;
  const std::int32_t rank = source_.compliance->rank(), first = filled_;
  for (; filled_ < rank && known; filled_ = std::min(rank, filled_ + kPatternsAtOnce))
    known = fill(filled_, std::min(rank, filled_ + kPatternsAtOnce));
  const bool changed = new_count_ > before || rank > first || compliance_version_ != source_.compliance->version();
  compliance_version_ = source_.compliance->version();
  if (!changed) return known;
  ++version_;
  if (!replayed) changed_ = 1;
  std::fill_n(response_of_, source_.responses, -1);
  return known;
}

// scratch_.column: C of the surface nodes at rest for unit forces on a node at rest.
bool CutResponse::read_column(std::int32_t node) {
  const auto numbers = 3 * static_cast<std::size_t>(source_.surface_nodes);
  const std::int32_t column = node < source_.surface_nodes ? column_[node] : -1;
  double* const c = scratch_.column;
  Mat3 self;
  const Tensors& tensors = *source_.tensors;
  if (column >= 0 && !self_compliance(tensors.stiffness + 9 * static_cast<std::size_t>(column), &self)) return false;
  for (std::int32_t k = 0; k < other_count_; ++k) {
    const std::int32_t n = others_[k];
    Mat3 of;
    if (column >= 0) of = tensors.displacement(n, column) * self;
    for (std::size_t j = 0; j < 3; ++j)
      for (std::size_t i = 0; i < 3; ++i) c[j * numbers + 3 * static_cast<std::size_t>(n) + i] = of.m[i][j];
  }
  if (source_.pair_count == 0) return true;
  const auto stride = 3 * static_cast<std::size_t>(source_.pair_count);
  if (!source_.pairs->read(node, source_.pair_nodes, source_.pair_count, scratch_.pair_row, stride)) return false;
  for (std::size_t j = 0; j < 3; ++j)
    for (std::int32_t k = 0; k < source_.pair_count; ++k)
      for (std::size_t i = 0; i < 3; ++i)
        c[j * numbers + 3 * static_cast<std::size_t>(source_.pair_nodes[k]) + i] =
            scratch_.pair_row[j * stride + 3 * static_cast<std::size_t>(k) + i];
  return true;
}

// A pattern's field as a sum of stored rows, as the shape of any forces is.
bool CutResponse::superpose_pattern(std::int32_t pattern) {
  const CutCompliance& compliance = *source_.compliance;
  const Tensors& tensors = *source_.tensors;
  int rows = 0;
  bool known = true;
  compliance.basis().for_each_force(pattern, [&](std::int32_t slot, Vec3 force) {
    const std::int32_t node = compliance.node_of_slot(slot), column = node < source_.surface_nodes ? column_[node] : -1;
    Mat3 self;
    if (column < 0) return;
    known = known && self_compliance(tensors.stiffness + 9 * static_cast<std::size_t>(column), &self);
    const Vec3 modified = self * force;
    for (int j = 0; j < 3; ++j) {
      scratch_.row[rows] = tensors.surface.row(column, j);
      scratch_.coefficient[rows++] = static_cast<float>(modified[j]) * tensors.surface.row_scale(column, j);
    }
  });
  const auto numbers = 3 * static_cast<std::size_t>(source_.first_reserve);
  superpose(tensors.surface.type, scratch_.row, scratch_.coefficient, rows, 0, numbers, scratch_.moved_by);
  for (std::int32_t n = 0; n < nodes(); ++n)
    for (std::size_t i = 0; i < 3; ++i)
      row(n)[i * stride_ + static_cast<std::size_t>(pattern)] =
          static_cast<double>(scratch_.moved_by[3 * static_cast<std::size_t>(origin_[n]) + i]);
  return known;
}

// Patterns first .. end - 1.
bool CutResponse::fill(std::int32_t first, std::int32_t end) {
  bool known = true;
  if (source_.pair_count > 0 || source_.tensors->compliance)
    known = fill_by_columns(first, end);
  else
    for (std::int32_t p = first; p < end; ++p) known = superpose_pattern(p) && known;
  if (!known) return false;
  // The jump of a new node moves it and those that come from it.
  const CutBasis& basis = source_.compliance->basis();
  const CutTissue& tissue = source_.compliance->tissue();
  for (std::int32_t own = source_.rest_nodes; own < tissue.nodes(); ++own)
    for (std::int32_t node = own; tissue.is_new(node); node = tissue.parent(node))
      for (std::int32_t p = first; p < end; ++p)
        if (const std::int32_t jump = basis.jump(p); jump >= 0 && jump / 3 == node - source_.rest_nodes)
          row(surface_node(own))[static_cast<std::size_t>(jump % 3) * stride_ + static_cast<std::size_t>(p)] += 1;
  return true;
}

// Slot by slot, in double precision where the pairs are.
bool CutResponse::fill_by_columns(std::int32_t first, std::int32_t end) {
  const CutCompliance& compliance = *source_.compliance;
  const CutBasis& basis = compliance.basis();
  const auto numbers = 3 * static_cast<std::size_t>(source_.surface_nodes);
  std::int32_t entries = 0, slots = 0;
  for (std::int32_t p = first; p < end; ++p)
    basis.for_each_force(p, [&](std::int32_t slot, Vec3 force) {
      if (entries == kMostEntries) return;
      if (scratch_.first[slot] == 0) scratch_.slot[slots++] = slot;
      scratch_.entry[entries] = {p, scratch_.first[slot], force};
      scratch_.first[slot] = ++entries;
    });
  std::fill_n(scratch_.pattern, static_cast<std::size_t>(end - first) * numbers, 0.0);
  bool known = entries < kMostEntries;
  for (std::int32_t s = 0; s < slots; ++s) {
    const std::int32_t slot = scratch_.slot[s];
    known = known && read_column(compliance.node_of_slot(slot));
    for (std::int32_t at = scratch_.first[slot]; at > 0 && known; at = scratch_.entry[at - 1].next) {
      const Entry& entry = scratch_.entry[at - 1];
      double* const to = scratch_.pattern + static_cast<std::size_t>(entry.pattern - first) * numbers;
      for (int j = 0; j < 3; ++j) {
        const double force = entry.force[j], *const from = scratch_.column + static_cast<std::size_t>(j) * numbers;
        if (force == 0) continue;
        for (std::size_t i = 0; i < numbers; ++i) to[i] += force * from[i];
      }
    }
    scratch_.first[slot] = 0;
  }
  if (!known) return false;
  for (std::int32_t n = 0; n < nodes(); ++n) {
    const std::size_t from = 3 * static_cast<std::size_t>(origin_[n]);
    for (std::size_t i = 0; i < 3; ++i) {
      double* const z = row(n) + i * stride_;
      for (std::int32_t p = first; p < end; ++p)
        z[p] = scratch_.pattern[static_cast<std::size_t>(p - first) * numbers + from + i];
    }
  }
  return true;
}

// ---- what it answers -------------------------------------------------------------------------------------------------

void CutResponse::find_response(std::int32_t node) {
  const std::int32_t* const known = std::find(response_of_, response_of_ + source_.responses, node);
  response_at_ = static_cast<std::int32_t>(known - response_of_);
  if (response_at_ < source_.responses || filled_ == 0) return;
  response_at_ = next_response_, next_response_ = (next_response_ + 1) % source_.responses;
  response_of_[response_at_] = node;
  multiply(row(node), 3, response_ + 3 * static_cast<std::size_t>(response_at_) * stride_);
}

Mat3 CutResponse::between(std::int32_t other) const {
  Mat3 c;
  if (filled_ == 0) return c;
  const double* const response = response_ + 3 * static_cast<std::size_t>(response_at_) * stride_;
  row_products(row(other), 3, response, 3, stride_, padded_row(filled_), &c.m[0][0], 3);
  return c;
}

void CutResponse::add_force(std::int32_t node, Vec3 force, double* x) const {
  for (int i = 0; i < 3; ++i) {
    const double* const z = row(node) + static_cast<std::size_t>(i) * stride_;
    for (std::int32_t p = 0; p < filled_; ++p) x[p] += force[i] * z[p];
  }
}

void CutResponse::spread(const double* y, int count, double* out) const {
  row_products(z_, 3 * nodes(), y, count, stride_, padded_row(filled_), out, kMostRows);
}

// o at the slots' nodes, what the patterns make of it, and what that moves.
void CutResponse::begin_step(const Offset& offset) {
  const bool same = std::equal(offset.amounts(), offset.amounts() + offset.count(), amount_);
  if (same && changed_ == 0) return moved_.keep();
  std::copy_n(offset.amounts(), offset.count(), amount_), changed_ = 0;
  if (filled_ == 0 || !source_.moves || (!source_.preload && offset.count() == 0)) return moved_.keep();
  const CutCompliance& compliance = *source_.compliance;
  const OffsetRows& rows = offset.rows();
  std::fill_n(scratch_.x, stride_, 0.0);
  for (std::int32_t s = 0; s < compliance.slots(); ++s) {
    const std::int32_t node = compliance.node_of_slot(s);
    Vec3& u = scratch_.slot_moved[s] = {};
    if (node < rows.nodes || rows.inside) u = rows.sum_at(amount_, node);
    if (source_.preload) u += load3(source_.preload + 3 * static_cast<std::size_t>(node));
  }
  for (std::int32_t p = 0; p < filled_; ++p)
    compliance.basis().for_each_force(
        p, [&](std::int32_t slot, Vec3 force) { scratch_.x[p] += dot(force, scratch_.slot_moved[slot]); });
  std::fill_n(scratch_.alone, stride_, 0.0);
  if (load_) add_divided_loads(rows);
  multiply(scratch_.x, 1, scratch_.y);
  for (std::int32_t p = 0; p < filled_; ++p) scratch_.y[p] += scratch_.alone[p];
  spread(scratch_.y, 1, scratch_.spread);
  for (std::size_t i = 0; i < 3 * static_cast<std::size_t>(nodes()); ++i)
    scratch_.moved[i] = static_cast<float>(scratch_.spread[i * kMostRows]);
  moved_.set(scratch_.moved, scratch_.moved, 0, true);
}

// ---- loads -----------------------------------------------------------------------------------------------------------

// A load is K times the displacement by it, but for a row of a force, whose weights are there without rounding.
bool CutResponse::take_loads(SceneMemory& memory, const HyperelasticBody& body, const std::uint8_t* may_divide,
                             const OffsetRows& rows) {
  load_rows_ = rows.count;
  if (loads() == 0 || !source_.moves) return true;
  const auto nodes = static_cast<std::size_t>(source_.rest_nodes);
  float* const loads_of = memory.array<float>(static_cast<std::size_t>(loads()) * 3 * nodes);
  SceneMemory scratch = memory.of_same_host();
  std::int32_t* const place = scratch.array<std::int32_t>(nodes);
  double* const moved = scratch.array<double>(3 * nodes);
  HyperelasticBody bare = body;
  bare.fixed = scratch.array<std::uint8_t>(3 * nodes);
  BlockRows stiffness;
  for (std::int32_t n = 0; n < source_.rest_nodes && place; ++n) place[n] = n;
  const bool made =
      loads_of && !scratch.failed() && assemble_stiffness(scratch, bare, place, source_.rest_nodes, &stiffness);
  for (std::int32_t m = 0; m < loads() && made; ++m) {
    float* const load = loads_of + static_cast<std::size_t>(m) * 3 * nodes;
    for (std::int32_t n = 0; n < source_.rest_nodes; ++n) {
      const bool known = m == load_rows_ || n < rows.nodes || rows.inside;
      const Vec3 u = !known           ? Vec3{}
                     : m < load_rows_ ? rows.at(m, n)
                                      : load3(source_.preload + 3 * static_cast<std::size_t>(n));
      store3(u, moved + 3 * static_cast<std::size_t>(n));
    }
    palpate::multiply(stiffness, moved, source_.rest_nodes, load);
    if (m < load_rows_ && rows.is_of_force(m)) {
      std::fill_n(load, 3 * nodes, 0.0f);
      const RowForce& force = rows.force[m];
      for (std::int32_t k = 0; k < force.count; ++k)
        load[3 * force.node[k] + force.axis] = static_cast<float>(force.weight[k]);
    }
    for (std::size_t d = 0; d < 3 * nodes; ++d)
      if (body.fixed[d] || !may_divide[d / 3]) load[d] = 0;
  }
  scratch.release_all();
  if (made) load_ = loads_of;
  return made;
}

// Of df, the loads of the nodes less those of the uncut body: x += Z^T df; alone: C df, by patterns. Where nodes only divide, df sums to zero at
// one place, and C df is zero; where tetrahedra are removed, there are patterns of unit forces.
void CutResponse::add_divided_loads(const OffsetRows& rows) {
  const CutTissue& tissue = source_.compliance->tissue();
  for (std::int32_t n = 0; n < source_.rest_nodes; ++n)
    if (const LoadShare& share = tissue.loads(n); share.in_volume != 1 || share.on_surface != 1)
      add_load(rows, n, n, 1);
  for (std::int32_t n = source_.rest_nodes; n < tissue.nodes(); ++n) add_load(rows, n, tissue.origin(n), 0);
}

// less: the share that o has at this node already: 1 at a node at rest, 0 at a new one.
void CutResponse::add_load(const OffsetRows& rows, std::int32_t node, std::int32_t at_rest, double less) {
  const LoadShare& share = source_.compliance->tissue().loads(node);
  Vec3 force;
  for (std::int32_t m = 0; m < loads(); ++m) {
    const bool in_volume = m == load_rows_ || rows.is_in_volume(m);
    const double amount = m == load_rows_ ? 1 : amount_[m];
    const float* const load = load_ + 3 * (static_cast<std::size_t>(m) * static_cast<std::size_t>(source_.rest_nodes) +
                                           static_cast<std::size_t>(at_rest));
    const double part = amount * ((in_volume ? share.in_volume : share.on_surface) - less);
    for (int i = 0; i < 3 && part != 0; ++i) force[i] += part * static_cast<double>(load[i]);
  }
  add_force(surface_node(node), force, scratch_.x);
  const std::int32_t pattern = source_.compliance->nodal_pattern(at_rest);
  for (int i = 0; i < 3 && pattern >= 0; ++i) scratch_.alone[pattern + i] += force[i];
}

}  // namespace palpate
