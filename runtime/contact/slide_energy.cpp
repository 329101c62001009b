#include "runtime/contact/slide_energy.h"

#include <algorithm>

#include "runtime/dense/dense_rows.h"

namespace palpate {
namespace {

// Of the stored energy. What is given beyond it is taken back down to half of it. Below it contacts keep their bits.
constexpr double kTolerance = 0.01;
// Of the stored energy. A step that leaves more given than this is told.
constexpr double kTold = 0.02;

// J, along the rows that a constraint has.
double product_of(const ContactConstraint& constraint, Vec3 force, Vec3 way) {
  double sum = 0;
  for (int i = 0; i < 3; ++i)
    if (constraint.axes >> i & 1u) sum += force[i] * way[i];
  return sum;
}

Vec3 in_organ(const ContactConstraint& constraint, Vec3 along_rows) {
  return constraint.framed ? transposed_times(constraint.frame, along_rows) : along_rows;
}

// m. Where the targets are not met, or a limit lets a row give way, it costs a row of multiply-adds for each row.
Vec3 reached_by(const ContactSolver& solver, const ContactConstraints& acting, std::int32_t p, bool met) {
  const bool exact = met && !(acting.constraints[p].limit > 0);
  return exact ? acting.target[p] : acting.target[p] + solver.missed(acting, p);
}

// J.
double energy_of(const ContactSolver& solver, const ContactConstraints& acting, std::int32_t p, bool met) {
  return product_of(acting.constraints[p], 0.5 * solver.reaction(p), reached_by(solver, acting, p, met));
}

}  // namespace

bool SlideEnergy::create(SceneMemory& memory, std::int32_t constraint_capacity) {
  held_ = memory.array<Held>(static_cast<std::size_t>(constraint_capacity));
  sliding_ = memory.array<Sliding>(static_cast<std::size_t>(constraint_capacity));
  own_ = memory.array<double>(3 * static_cast<std::size_t>(constraint_capacity));
  memory.keep(count_);
  memory.keep(lost_);
  memory.keep_array(held_, static_cast<std::size_t>(constraint_capacity), count_);
  return !memory.failed();
}

void SlideEnergy::forget() {
  count_ = 0, lost_ = 0;
}

bool SlideEnergy::is_shared(const ContactSolver& solver, const ContactConstraints& acting, const Sliding* sliding) {
  for (std::int32_t p = 0; p < acting.constraint_count; ++p)
    if (const Vec3 r = solver.reaction(p); !sliding[p].slides() && dot(r, r) > 0) return true;
  return false;
}

// Where something else bears a force, the surface is not at rest without the contacts that slide: what lifts it towards a tool gives the tool a target
// against its push, though the tool stores energy. Their ways by themselves are A r of their reactions alone.
void SlideEnergy::find_ways(const ContactSolver& solver, const ContactConstraints& acting, Sliding* sliding, bool met,
                            bool apart) const {
  const ContactMatrix& matrix = solver.matrix();
  double stored = 0, own = 0, push = 0;
  if (apart) std::fill(own_, own_ + matrix.rows().rows_end, 0.0);
  for (std::int32_t p = 0; p < acting.constraint_count; ++p) {
    if (!sliding[p].slides()) continue;
    sliding[p].way = reached_by(solver, acting, p, met);
    const Vec3 reaction = solver.reaction(p);
    stored += product_of(acting.constraints[p], reaction, sliding[p].way);
    if (sliding[p].slack) push += reaction.x;
    for (int i = 0; i < 3 && apart; ++i)
      if (const std::int32_t row = matrix.rows_of(p).at[i]; row >= 0) own_[row] = reaction[i];
  }
  if (!apart || !(push > 0)) return;
  for (std::int32_t row = 0; row < matrix.rows().rows_end; ++row)
    if (own_[row] != 0) own += own_[row] * dot_rows(matrix.rows().rows_end, matrix.rows().row(row), own_);
  if (!(own > stored)) return;
  for (std::int32_t p = 0, end = 0; p < acting.constraint_count; p = end) {
    end = end_of_joined(acting.constraints, acting.constraint_count, p);
    if (!sliding[p].slides()) continue;
    sliding[p].way = matrix.reached(own_, p);
    // Targets of one row add up.
    sliding[p].way.x /= end - p;
    for (std::int32_t q = p + 1; q < end; ++q) sliding[q].way = {sliding[p].way.x, 0, 0};
  }
}

// With A the system of the step and w = A r what is reached, the energy is r . w / 2. Constraints that do not slide take the work
// (r + r') . (d' - d) / 2, tools (f + f') . (p' - p) / 2.
SlideEnergy::Sum SlideEnergy::sum_up(const ContactSolver& solver, const ContactConstraints& acting,
                                     const Sliding* sliding, bool met) const {
  Sum sum;
  sum.known = !solver.matrix().is_renewed();
  const Held *before = held_, *const end = held_ + count_;
  const auto leave = [&] {
    sum.created -= before->energy;
    sum.known = sum.known && before->slides;
    ++before;
  };
  for (std::int32_t p = 0; p < acting.constraint_count; ++p) {
    const ContactConstraint& constraint = acting.constraints[p];
    const Vec3 reaction = solver.reaction(p), target = acting.target[p], force = in_organ(constraint, reaction);
    const double energy = energy_of(solver, acting, p, met);
    while (before != end && before->id < constraint.id) leave();
    const bool had = before != end && before->id == constraint.id;
    sum.created += energy - (had ? before->energy : 0);
    if (sliding[p].slides()) {
      const Sliding& now = sliding[p];
      const double own = product_of(constraint, 0.5 * reaction, now.way);
      sum.stored += own, sum.begins = sum.begins || !had;
      if (!solver.matrix().stayed(p)) sum.moved += own;
      sum.created -= had ? 0.5 * dot(force + before->force, now.at - before->at + now.reach * (now.axis - before->axis))
                         : 0.5 * dot(force, now.at - now.from);
    } else if (had && solver.matrix().stayed(p)) {
      sum.created -= product_of(constraint, 0.5 * (reaction + before->reaction), target - before->target);
    } else {
      sum.known = false;
    }
    before += had;
  }
  while (before != end) leave();
  return sum;
}

bool SlideEnergy::give_way(const ContactSolver& solver, const ContactConstraints& acting, Sliding* sliding, bool apart,
                           ContactRows& rows) {
  find_ways(solver, acting, sliding, true, apart);
  const Sum sum = sum_up(solver, acting, sliding, true);
  if (!sum.known || !(sum.stored > 0)) return false;
  const double excess = sum.created - lost_;
  if (!(excess > kTolerance * sum.stored)) return false;
  shorten(solver, acting, sliding, excess - 0.5 * kTolerance * sum.stored, sum, &rows);
  return true;
}

// The energy goes with the square of the ways. Contacts that have moved bear it, if they hold as much.
void SlideEnergy::shorten(const ContactSolver& solver, const ContactConstraints& acting, const Sliding* sliding,
                          double excess, const Sum& sum, ContactRows* rows) const {
  const bool moved_bear = sum.moved > excess;
  const double kept = std::sqrt(std::max(0.0, 1 - excess / (moved_bear ? sum.moved : sum.stored)));
  for (std::int32_t p = 0; p < acting.constraint_count; ++p) {
    if (!sliding[p].slides() || (moved_bear && solver.matrix().stayed(p))) continue;
    const ContactConstraint& constraint = acting.constraints[p];
    Vec3 shorter = (1 - kept) * sliding[p].way;
    if (sliding[p].aside) {
      if (!(constraint.axes & 6u)) continue;
      shorter.x = 0;
      *sliding[p].aside += in_organ(constraint, shorter);
    } else {
      shorter.y = shorter.z = 0;
      *sliding[p].slack += constraint.share * shorter.x;
    }
    if (rows) rows->set_target(p, rows->set().target[p] - shorter);
  }
}

void SlideEnergy::Sliding::lengthen(double depth, double push, double more) const {
  if (!slack) return;
  if (*slack * push > 0)
    *slack -= (*slack > 0 ? 1 : -1) * std::min(std::fabs(*slack), more * std::fabs(depth));
  else if (*slack > 0)
    *slack = std::clamp(depth + *slack, 0.0, *slack);
  else if (push > 0)
    *slack = std::clamp(depth + *slack, *slack, 0.0);
}

// The energy that was lost pays for longer targets in the next step. Where a contact bears no force, or one against its slack, its target
// becomes zero or what is left of it.
void SlideEnergy::lengthen(const ContactConstraints& acting, const Sliding* sliding, double stored) const {
  const double more = stored > 0 && lost_ > 0 ? std::sqrt(1 + lost_ / stored) - 1 : 0;
  for (std::int32_t p = 0, end = 0; p < acting.constraint_count; p = end) {
    double depth = 0, force = 0;
    for (; end < acting.constraint_count && acting.constraints[p].id.contact == acting.constraints[end].id.contact;
         ++end) {
      const double push = held_[end].reaction.x;
      depth += acting.constraints[end].share * (push != 0 ? sliding[end].way.x : acting.target[end].x), force += push;
    }
    sliding[p].lengthen(depth, force, more);
  }
}

bool SlideEnergy::end(const ContactSolver& solver, const ContactConstraints& acting, Sliding* sliding, bool met,
                      bool apart) {
  find_ways(solver, acting, sliding, met, apart);
  const Sum sum = sum_up(solver, acting, sliding, met);
  if (sum.known) lost_ = std::min(lost_ - sum.created, sum.stored);
  if (!(sum.stored > 0)) lost_ = 0;
  count_ = acting.constraint_count;
  for (std::int32_t p = 0; p < count_; ++p) {
    const ContactConstraint& constraint = acting.constraints[p];
    const Vec3 reaction = solver.reaction(p), target = acting.target[p];
    Held& held = held_[p];
    held.id = constraint.id, held.slides = sliding[p].slides();
    held.target = target, held.reaction = reaction;
    held.energy = energy_of(solver, acting, p, met);
    held.force = in_organ(constraint, reaction), held.at = sliding[p].at, held.axis = sliding[p].axis;
  }
  lengthen(acting, sliding, sum.stored);
  if (met && -lost_ > kTolerance * sum.stored)
    shorten(solver, acting, sliding, -lost_ - 0.5 * kTolerance * sum.stored, sum, nullptr);
  return sum.begins || lost_ >= -kTold * sum.stored;
}

}  // namespace palpate
