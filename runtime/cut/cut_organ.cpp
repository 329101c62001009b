#include "runtime/cut/cut_organ.h"

#include <algorithm>

#include "runtime/base/contact_nodes.h"
#include "runtime/contact/touch_step.h"

namespace palpate {

bool CutOrgan::create(SceneMemory& memory, const Parts& parts, TouchState& touch) {
  touch_ = &touch, beside_ = parts.beside, stream_ = parts.stream, first_new_ = parts.first_reserve;
  CutResponse::Source source;
  PatternFields::Source& of = source.of;
  of.compliance = source.compliance = &compliance_, of.tensors = parts.tensors, of.touchable = parts.touchable;
  of.pairs = parts.pairs, of.pair_nodes = parts.pair_nodes, of.pair_count = parts.pair_count;
  of.rest_nodes = parts.body->node_count, of.surface_nodes = parts.surface_nodes;
  of.first_reserve = parts.first_reserve, source.preload = parts.preload;
  source.responses = parts.contact_nodes, source.moves = !beside_;
  const std::int32_t reserve = parts.surface_nodes - parts.first_reserve;
  CutCapacity capacity = parts.capacity;
  capacity.new_nodes = std::min(capacity.new_nodes, reserve);
  brought_ = memory.array<Vec3>(static_cast<std::size_t>(reserve));
  if (!compliance_.create(memory, *parts.body, *parts.pairs, capacity, parts.supports) ||
      !response_.create(memory, source) ||
      !field_.create(memory, parts.tensors, &response_, &touch.offset, &touch.solver,
                     {parts.contact_nodes, parts.constraints}))
    return false;
  response_.keep(memory);
  if (beside_)
    field_.add(touch.body->added());
  else
    touch.body = this;
  touch.offset.change_body(&response_);
  rebases_ = parts.rebase_at > 0;
  CutRebase::Parts of_rebase;
  of_rebase.body = parts.body, of_rebase.supports = parts.supports, of_rebase.pairs = parts.pairs;
  of_rebase.capacity = capacity, of_rebase.at = parts.rebase_at;
  of_rebase.most_slots = parts.most_slots;
  of_rebase.compliance = &compliance_, of_rebase.response = &response_, of_rebase.field = &field_;
  of_rebase.offset = &touch.offset;
  return !memory.failed() && (!rebases_ || rebase_.create(memory, of_rebase));
}

CutResult CutOrgan::take_change(const CutChange& change, bool replayed) {
  if (stream_ && !replayed && !stream_->has_room(change)) return {CutOutcome::full, 0, 0, 1};
  const CutResult result = compliance_.apply(change);
  if (stream_ && !replayed) stream_->add(change, result);
  follow_changes(replayed);
  return result;
}

CutOutcome CutOrgan::ground(std::int32_t node, double stiffness, bool replayed) {
  if (stream_ && !replayed && !stream_->has_room({})) return CutOutcome::full;
  const CutOutcome outcome = compliance_.ground(node, stiffness);
  if (stream_ && !replayed && outcome == CutOutcome::made) stream_->add_hold(node, stiffness);
  follow_changes(replayed);
  return outcome;
}

// The compliance has read all pairs that Z asks for.
void CutOrgan::follow_changes(bool replayed) {
  const std::int32_t before = response_.nodes();
  response_.take_change(replayed);
  if (!replayed) field_.note_change();
  std::int32_t* const column = touch_->surface.column_of_node;
  for (std::int32_t own = before; own < response_.nodes(); ++own) {
    column[own] = column[response_.at_rest(own)];
    if (replayed) continue;
    field_.copy_node(response_.parent(own), own);
    if (beside_) beside_->copy_node(response_.parent(own), own);
  }
}

void CutOrgan::end_changes(bool replayed) {
  if (replayed || !beside_ || !field_.is_changed() || !beside_->holds_back()) return;
  double energy = 0;
  const float* const released = field_.follow_change(&energy);
  beside_->hold_back(released, energy);
}

void CutOrgan::forget_changes(bool replayed) {
  std::int32_t* const column = touch_->surface.column_of_node;
  for (std::int32_t own = response_.first_new(); own < response_.nodes(); ++own) column[own] = -1;
  std::fill_n(brought_, response_.surface_nodes() - response_.first_new(), Vec3{});
  compliance_.forget();
  response_.forget(replayed);
  if (rebases_ && !replayed) rebase_.forget();
  if (replayed) return;
  field_.note_change();
  if (stream_) stream_->clear();
}

void CutOrgan::show(const CutTriangles& triangles) {
  if (stream_) stream_->add(triangles);
}

void CutOrgan::forget() {
  forget_changes(false);
  field_.forget();
}

void CutOrgan::move_surface(TouchStep& step, const ContactConstraints& set) {
  Operations work = 0;
  field_.set(set, step.state->force, step.is_solved, &work);
  step.state->work.owe(work);
}

void CutOrgan::write(const TouchStep& step) const {
  Body::write(step);
  const Offset& offset = step.state->offset;
  float* const field = field_behind(*step.out);
  const std::int32_t nodes = std::min(step.state->held.nodes, response_.nodes());
  for (std::int32_t n = 0; n < nodes; ++n) {
    Vec3 u = field_.by_contacts(n) + offset.now(n);
    if (n >= response_.first_new()) u += brought_[n - response_.first_new()];
    for (int i = 0; i < 3; ++i) field[3 * n + i] = static_cast<float>(u[i]);
  }
  std::fill(field + 3 * static_cast<std::size_t>(nodes), field + 3 * static_cast<std::size_t>(step.state->held.nodes),
            0.0f);
}

}  // namespace palpate
