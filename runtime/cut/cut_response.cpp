#include "runtime/cut/cut_response.h"

#include <algorithm>

#include "runtime/contact/offset.h"
#include "runtime/cut/dense_loops.h"
#include "runtime/large/block_rows.h"

namespace palpate {

bool CutResponse::create(SceneMemory& memory, const Source& source) {
  source_ = source;
  if (!fields_.create(memory, source.of)) return false;
  stride_ = fields_.stride();
  const std::int32_t nodes = source.of.surface_nodes;
  const auto numbers = 3 * static_cast<std::size_t>(nodes), responses = static_cast<std::size_t>(source.responses);
  response_ = memory.array<double>(3 * responses * stride_), response_of_ = memory.array<std::int32_t>(responses);
  amount_ = memory.array<double>(kMostOffsetRows);
  scratch_.x = memory.array<double>(stride_), scratch_.y = memory.array<double>(stride_),
  scratch_.alone = memory.array<double>(stride_);
  scratch_.spread = memory.array<double>(numbers * kMostRows);
  scratch_.moved = memory.array<float>(numbers);
  scratch_.slot_moved = memory.array<Vec3>(static_cast<std::size_t>(source.compliance->most_slots()));
  if (!moved_.create(memory, nodes, nodes)) return false;
  std::fill_n(response_of_, source.responses, -1);
  return true;
}

void CutResponse::keep(SceneMemory& memory) {
  memory.keep(changed_);
  memory.keep_array(amount_, kMostOffsetRows);
}

void CutResponse::forget(bool replayed) {
  fields_.forget();
  ++version_;
  std::fill_n(scratch_.moved, 3 * static_cast<std::size_t>(surface_nodes()), 0.0f);
  std::fill_n(response_of_, source_.responses, -1);
  if (replayed) return;
  moved_.forget(), changed_ = 0;
  std::fill_n(amount_, kMostOffsetRows, 0.0);
}

bool CutResponse::take_change(bool replayed) {
  const std::int32_t before = new_nodes(), first = rank();
  fields_.add_nodes([&](std::int32_t own, std::int32_t from) {
    if (!replayed) moved_.copy_node(from, own);
  });
  const bool known = fields_.add_patterns();
  if (new_nodes() > before || rank() > first || compliance_version_ != source_.compliance->version())
    note_exchange(replayed);
  return known;
}

void CutResponse::note_exchange(bool replayed) {
  compliance_version_ = source_.compliance->version();
  ++version_;
  if (!replayed) changed_ = 1;
  std::fill_n(response_of_, source_.responses, -1);
}

// ---- what it answers -------------------------------------------------------------------------------------------------

void CutResponse::find_response(std::int32_t node) {
  asked_ = node;
  const std::int32_t* const known = std::find(response_of_, response_of_ + source_.responses, node);
  response_at_ = static_cast<std::int32_t>(known - response_of_);
  if (response_at_ < source_.responses || rank() == 0) return;
  response_at_ = next_response_, next_response_ = (next_response_ + 1) % source_.responses;
  response_of_[response_at_] = node;
  multiply(row(node), 3, response_ + 3 * static_cast<std::size_t>(response_at_) * stride_);
}

Mat3 CutResponse::between(std::int32_t other) const {
  Mat3 c;
  if (rank() > 0) {
    const double* const response = response_ + 3 * static_cast<std::size_t>(response_at_) * stride_;
    row_products(row(other), 3, response, 3, stride_, padded_row(rank()), &c.m[0][0], 3);
  }
  if (fields_.base()) add_scaled(c, 1, fields_.added(other, asked_));
  return c;
}

void CutResponse::add_force(std::int32_t node, Vec3 force, double* x) const {
  for (int i = 0; i < 3; ++i) {
    const double* const z = row(node) + static_cast<std::size_t>(i) * stride_;
    for (std::int32_t p = 0; p < rank(); ++p) x[p] += force[i] * z[p];
  }
}

void CutResponse::spread(const double* y, int count, double* out) const {
  row_products(row(0), 3 * nodes(), y, count, stride_, padded_row(rank()), out, kMostRows);
}

void CutResponse::begin_step(const Offset& offset) {
  const bool same = std::equal(offset.amounts(), offset.amounts() + offset.count(), amount_);
  if (same && changed_ == 0) return moved_.keep();
  std::copy_n(offset.amounts(), offset.count(), amount_), changed_ = 0;
  const bool is_whole = rank() == 0 && !fields_.base();
  if (is_whole || !source_.moves || (!source_.preload && offset.count() == 0)) return moved_.keep();
  find_moved(offset.rows(), {amount_, 1}, scratch_.moved);
  moved_.set(scratch_.moved, scratch_.moved, 0, true);
}

void CutResponse::find_moved_by(const OffsetRows& rows, std::int32_t load, float* moved) {
  double amount[kMostOffsetRows] = {};
  if (load < load_rows_) amount[load] = 1;
  find_moved(rows, {amount, load == load_rows_ ? 1.0 : 0.0}, moved);
}

// What the base makes of it; o at the slots' nodes, what the patterns make of it, and what that moves.
void CutResponse::find_moved(const OffsetRows& rows, const Amounts& amounts, float* moved) {
  const CutCompliance& compliance = *source_.compliance;
  const CutBase* const base = fields_.base();
  const auto amount_of = [&](std::int32_t load) { return load < load_rows_ ? amounts.row[load] : amounts.preload; };
  const auto by_base = [&](std::int32_t number) {
    Vec3 u;
    for (std::int32_t m = 0; m < all_loads() && number >= 0; ++m) u += amount_of(m) * base->moved_by(m, number);
    return u;
  };
  std::fill_n(scratch_.x, stride_, 0.0);
  for (std::int32_t s = 0; s < compliance.slots(); ++s) {
    const std::int32_t node = compliance.node_of_slot(s), at_rest = compliance.tissue().origin(node);
    Vec3& u = scratch_.slot_moved[s] = {};
    if (at_rest < rows.nodes || rows.inside) u = rows.sum_at(amounts.row, at_rest);
    if (source_.preload) u += amounts.preload * load3(source_.preload + 3 * static_cast<std::size_t>(at_rest));
    if (base) u += by_base(fields_.number_in_base(fields_.surface_node(node)));
  }
  for (std::int32_t p = 0; p < rank(); ++p)
    compliance.basis().for_each_force(
        p, [&](std::int32_t slot, Vec3 force) { scratch_.x[p] += dot(force, scratch_.slot_moved[slot]); });
  std::fill_n(scratch_.alone, stride_, 0.0);
  if (load_) add_divided_loads(rows, amounts);
  multiply(scratch_.x, 1, scratch_.y);
  for (std::int32_t p = 0; p < rank(); ++p) scratch_.y[p] += scratch_.alone[p];
  spread(scratch_.y, 1, scratch_.spread);
  for (std::int32_t n = 0; n < nodes(); ++n) {
    const Vec3 of_base = base ? by_base(fields_.number_in_base(n)) : Vec3{};
    for (int i = 0; i < 3; ++i)
      moved[3 * n + i] =
          static_cast<float>(scratch_.spread[(3 * static_cast<std::size_t>(n) + i) * kMostRows] + of_base[i]);
  }
}

// ---- loads -----------------------------------------------------------------------------------------------------------

// A load is K times the displacement by it, but for a row of a force, whose weights are there without rounding.
bool CutResponse::take_loads(SceneMemory& memory, const HyperelasticBody& body, const std::uint8_t* may_divide,
                             const OffsetRows& rows) {
  load_rows_ = rows.count;
  if (loads() == 0) return true;
  const std::int32_t rest_nodes = source_.of.rest_nodes;
  const auto nodes = static_cast<std::size_t>(rest_nodes);
  float* const loads_of = memory.array<float>(static_cast<std::size_t>(loads()) * 3 * nodes);
  SceneMemory scratch = memory.of_same_host();
  std::int32_t* const place = scratch.array<std::int32_t>(nodes);
  double* const moved = scratch.array<double>(3 * nodes);
  HyperelasticBody bare = body;
  bare.fixed = scratch.array<std::uint8_t>(3 * nodes);
  BlockRows stiffness;
  for (std::int32_t n = 0; n < rest_nodes && place; ++n) place[n] = n;
  const bool made = loads_of && !scratch.failed() && assemble_stiffness(scratch, bare, place, rest_nodes, &stiffness);
  for (std::int32_t m = 0; m < loads() && made; ++m) {
    float* const load = loads_of + static_cast<std::size_t>(m) * 3 * nodes;
    for (std::int32_t n = 0; n < rest_nodes; ++n) {
      const bool known = m == load_rows_ || n < rows.nodes || rows.inside;
      const Vec3 u = !known           ? Vec3{}
                     : m < load_rows_ ? rows.at(m, n)
                                      : load3(source_.preload + 3 * static_cast<std::size_t>(n));
      store3(u, moved + 3 * static_cast<std::size_t>(n));
    }
    palpate::multiply(stiffness, moved, rest_nodes, load);
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

// Of df, the loads of the nodes less those that they have in the base: x += Z^T df; alone: C df, by patterns. Where nodes only divide, df sums to zero at
// one place, and C df is zero; where tetrahedra are removed, there are patterns of unit forces.
void CutResponse::add_divided_loads(const OffsetRows& rows, const Amounts& amounts) {
  const CutTissue& tissue = source_.compliance->tissue();
  const CutBase* const base = fields_.base();
  for (std::int32_t n = 0; n < tissue.nodes(); ++n) {
    const bool is_new = n >= tissue.base_nodes();
    const LoadShare has = is_new ? LoadShare{0, 0} : base ? base->share[n] : LoadShare{};
    const LoadShare& share = tissue.loads(n);
    if (is_new || share.in_volume != has.in_volume || share.on_surface != has.on_surface)
      add_load(rows, amounts, n, has);
  }
}

// has: the share that o has at this node already.
void CutResponse::add_load(const OffsetRows& rows, const Amounts& amounts, std::int32_t node, const LoadShare& has) {
  const CutTissue& tissue = source_.compliance->tissue();
  const LoadShare& share = tissue.loads(node);
  const std::int32_t at_rest = tissue.origin(node);
  Vec3 force;
  for (std::int32_t m = 0; m < all_loads(); ++m) {
    const bool in_volume = m == load_rows_ || rows.is_in_volume(m);
    const double amount = m == load_rows_ ? amounts.preload : amounts.row[m];
    const float* const load =
        load_ + 3 * (static_cast<std::size_t>(m) * static_cast<std::size_t>(source_.of.rest_nodes) +
                     static_cast<std::size_t>(at_rest));
    const double part = amount * (in_volume ? share.in_volume - has.in_volume : share.on_surface - has.on_surface);
    for (int i = 0; i < 3 && part != 0; ++i) force[i] += part * static_cast<double>(load[i]);
  }
  add_force(fields_.surface_node(node), force, scratch_.x);
  const std::int32_t pattern = source_.compliance->nodal_pattern(tissue.base(node));
  for (int i = 0; i < 3 && pattern >= 0; ++i) scratch_.alone[pattern + i] += force[i];
}

}  // namespace palpate
