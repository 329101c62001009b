#include "runtime/large/body_energy.h"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

// As in slide_energy.cpp, of what is stored in the contacts that slide: what is given beyond the first is taken back down to half of it; beyond
// the second it is told.
constexpr double kTolerance = 0.01, kTold = 0.02;

}  // namespace

bool BodyEnergy::create(SceneMemory& memory, std::int32_t constraint_capacity) {
  const auto capacity = static_cast<std::size_t>(constraint_capacity);
  held_ = memory.array<Held>(capacity), sliding_ = memory.array<Sliding>(capacity);
  force_ = memory.array<Vec3>(capacity), along_ = memory.array<Along>(capacity);
  for (double* const number : {&work_, &adopted_, &lost_, &energy_}) memory.keep(*number);
  for (std::int32_t* const number : {&count_, &adopts_, &gives_much_, &settled_, &lagged_}) memory.keep(*number);
  memory.keep_array(held_, capacity, count_);
  return !memory.failed();
}

void BodyEnergy::forget() {
  energy_ = 0;
  end_touch();
}

// The next one begins with the energy that the body has.
void BodyEnergy::end_touch() {
  count_ = 0, work_ = lost_ = 0, adopted_ = energy_, adopts_ = gives_much_ = settled_ = lagged_ = 0;
}

// Where its tool holds a constraint. Of one that does not slide, its displacement, which moves alike. One that holds nothing, as organs that touch
// leave it where they part, is at its target.
Vec3 BodyEnergy::place_of(const ContactConstraints& set, std::int32_t p) const {
  if (sliding_[p].slides()) return sliding_[p].at;
  const ContactConstraint& constraint = set.constraints[p];
  Vec3 along_rows;
  for (int i = 0; i < 3; ++i)
    if (held_axes(constraint) == 0 || (held_axes(constraint) >> i & 1u) != 0) along_rows[i] = set.target[p][i];
  return constraint.framed ? transposed_times(constraint.frame, along_rows) : along_rows;
}

// The constraint in the last step; nullptr where it was not there.
const BodyEnergy::Held* BodyEnergy::held(const ContactConstraint& constraint) const {
  const Held *const end = held_ + count_, *const at = std::partition_point(
                                              held_, held_ + count_,
                                              [&](const Held&before) { return before.id < constraint.id; });
  return at != end && at->id == constraint.id ? at : nullptr;
}

// Between two steps a tool does the work (f + f') . (p' - p) / 2. A link holds along a line t. Its target changes where its nodes move along the
// line, and where the line turns by t' - t; the turn does no work, so turned() is taken off.
double BodyEnergy::turned(const Held& before, std::int32_t p) const {
  const Along &now = along_[p], &was = before.along;
  return 0.25 * (dot(force_[p], now.line) + dot(before.force, was.line)) *
         dot(now.line - was.line, now.moved + was.moved);
}

BodyEnergy::Work BodyEnergy::work_of(const ContactConstraints& set) const {
  Work work;
  for (std::int32_t p = 0; p < set.constraint_count; ++p) {
    const Held* const before = held(set.constraints[p]);
    const bool slides = sliding_[p].slides();
    if (before)
      work.sum += 0.5 * dot(force_[p] + before->force, place_of(set, p) - before->at) - turned(*before, p);
    else if (slides)
      work.sum += 0.5 * dot(force_[p], sliding_[p].at - sliding_[p].from);
    const ContactNode& first = set.nodes[set.constraints[p].first_node];
    // Where organs touch, places move from step to step.
    const bool may_move = set.constraints[p].id.contact.source == ContactSource{PALPATE_SOURCE_ORGAN};
    const bool same = before && before->node == first.node && (!may_move || before->weight == first.weight);
    work.known = work.known && (slides || same);
  }
  return work;
}

// J, in contacts that slide, as if the body were linear.
double BodyEnergy::stored_in(const ContactConstraints& set) const {
  double sum = 0;
  for (std::int32_t p = 0; p < set.constraint_count; ++p)
    if (sliding_[p].slides()) sum += std::max(0.0, 0.5 * push_on(set, p) * set.target[p].x);
  return sum;
}

// N, along the inward normal at rest.
double BodyEnergy::push_on(const ContactConstraints& set, std::int32_t p) const {
  return dot(force_[p], load3(set.constraints[p].frame.m[0]));
}

// The energy goes with the square of the targets.
void BodyEnergy::shorten(const ContactConstraints& set, double excess, double stored, ContactRows* rows) const {
  const double kept = std::sqrt(std::max(0.0, 1 - (excess - 0.5 * kTolerance * stored) / stored));
  for (std::int32_t p = 0; p < set.constraint_count; ++p) {
    if (!sliding_[p].slides()) continue;
    const Vec3 shorter = {(1 - kept) * set.target[p].x, 0, 0};
    *sliding_[p].slack += set.constraints[p].share * shorter.x;
    if (rows) rows->set_target(p, rows->set().target[p] - shorter);
  }
}

// The energy that was lost pays for longer targets in the next step. Where a contact bears no force, its target becomes zero or what is left of
// the slack.
void BodyEnergy::lengthen(const ContactConstraints& set, double stored) const {
  const double more = stored > 0 && lost_ > 0 ? std::sqrt(1 + lost_ / stored) - 1 : 0;
  for (std::int32_t p = 0, end = 0; p < set.constraint_count; p = end) {
    double depth = 0, push = 0;
    for (; end < set.constraint_count && set.constraints[p].id.contact == set.constraints[end].id.contact; ++end)
      depth += set.constraints[end].share * set.target[end].x, push += push_on(set, end);
    sliding_[p].lengthen(depth, push, more);
  }
}

bool BodyEnergy::give_way(double energy, double noise, const ContactConstraints& set, ContactRows& rows) const {
  const Work work = work_of(set);
  const double stored = stored_in(set), excess = energy - work_ - work.sum - adopted_;
  if (adopts_ || !work.known || !(stored > 0 && excess > kTolerance * stored + noise)) return false;
  shorten(set, excess, stored, &rows);
  return true;
}

bool BodyEnergy::lag_shortens(const ContactConstraints& set, double share) const {
  for (std::int32_t p = 0, end = 0; lagged_ && p < set.constraint_count; p = end) {
    double depth = 0;
    for (; end < set.constraint_count && set.constraints[p].id.contact == set.constraints[end].id.contact; ++end)
      depth += set.constraints[end].share * set.target[end].x;
    if (sliding_[p].slack && *sliding_[p].slack > share * std::max(0.0, depth + *sliding_[p].slack)) return true;
  }
  return false;
}

void BodyEnergy::judge(double energy, double noise, const ContactConstraints& set) {
  const Work of_step = work_of(set);
  const double work = work_ + of_step.sum, stored = stored_in(set);
  // What a constraint does that has just come is not known, as that of each one in the first step of a touch.
  if (adopts_ || !of_step.known) adopted_ = energy + lost_ - work;
  adopts_ = 0, energy_ = energy;
  lost_ = work + adopted_ - energy;
  if (lost_ > stored) adopted_ -= lost_ - stored, lost_ = stored;
  gives_much_ = -lost_ > kTold * stored + noise;
  if (-lost_ > kTolerance * stored + noise && stored > 0)
    shorten(set, -lost_, stored, nullptr);
  else
    lengthen(set, stored);
}

void BodyEnergy::end(const ContactConstraints& set, bool followed) {
  const Work work = work_of(set);
  work_ += work.sum;
  bool slides = false;
  count_ = set.constraint_count;
  for (std::int32_t p = 0; p < count_; ++p) {
    const ContactConstraint& constraint = set.constraints[p];
    const ContactNode& first = set.nodes[constraint.first_node];
    held_[p] = {constraint.id, first.node, 0, first.weight, place_of(set, p), force_[p], along_[p]};
    slides = slides || sliding_[p].slides();
  }
  if (!slides) return end_touch();
  settled_ = settled_ || followed;
  if (!settled_ || !work.known) adopts_ = 1;
}

}  // namespace palpate
