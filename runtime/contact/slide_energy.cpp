#include "runtime/contact/slide_energy.h"

#include <algorithm>
#include <array>
#include <cstdlib>

namespace palpate {
namespace {

// Of the stored energy. What is given beyond it is taken back down to half of it. Below it contacts keep their bits.
constexpr double kTolerance = 0.01;
// Of the stored energy. A step that leaves more given than this is told.
constexpr double kTold = 0.02;

double energy_of(const ContactConstraint& constraint, Vec3 reaction, Vec3 target) {
  double sum = 0;
  for (int i = 0; i < 3; ++i)
    if (constraint.axes >> i & 1u) sum += 0.5 * reaction[i] * target[i];
  return sum;
}

Vec3 force_of(const ContactConstraint& constraint, Vec3 reaction) {
  return constraint.framed ? transposed_times(constraint.frame, reaction) : reaction;
}

// Ascends through the constraints of a step.
template <class Constraint>
std::array<std::int32_t, 3> number_of(const Constraint& of) {
  return {of.tool, of.point, of.part};
}

bool is_of_one_contact(const ContactConstraint& a, const ContactConstraint& b) {
  return a.tool == b.tool && a.point == b.point;
}

}  // namespace

bool SlideEnergy::create(SceneMemory& memory, std::int32_t constraint_capacity) {
  held_ = memory.array<Held>(static_cast<std::size_t>(constraint_capacity));
  sliding_ = memory.array<Sliding>(static_cast<std::size_t>(constraint_capacity));
  memory.keep(count_);
  memory.keep(lost_);
  memory.keep_array(held_, static_cast<std::size_t>(constraint_capacity), count_);
  return !memory.failed();
}

void SlideEnergy::forget() {
  count_ = 0, lost_ = 0;
}

// With A the system of the step, the energy is r . A r / 2 = r . d / 2. Constraints that keep their rows do the work (r + r') . (d' - d) / 2
// by Betti's theorem exactly; tools do (f + f') . (p' - p) / 2. A contact that begins or ends bears next to nothing then: it counts for nothing.
SlideEnergy::Sum SlideEnergy::sum_up(const ContactSolver& solver, const ContactConstraints& acting,
                                     const Sliding* sliding) const {
  Sum sum;
  sum.known = true;
  const Held *before = held_, *const end = held_ + count_;
  for (std::int32_t p = 0; p < acting.constraint_count; ++p) {
    const ContactConstraint& constraint = acting.constraints[p];
    const Vec3 reaction = solver.reaction(p), target = acting.target[p];
    const double energy = energy_of(constraint, reaction, target);
    if (sliding[p].slack) {
      sum.stored += energy;
      if (!solver.stayed(p)) sum.moved += energy;
    }
    while (before != end && number_of(*before) < number_of(constraint)) sum.known = sum.known && (before++)->slides;
    const bool had = before != end && number_of(*before) == number_of(constraint);
    if (!had) {
      sum.known = sum.known && sliding[p].slack;
      continue;
    }
    if (sliding[p].slack)
      sum.created += energy - energy_of(constraint, before->reaction, before->target) -
                     0.5 * dot(force_of(constraint, reaction) + before->force, sliding[p].at - before->at);
    else
      sum.created += energy_of(constraint, reaction, before->target) - energy_of(constraint, before->reaction, target);
    sum.known = sum.known && (sliding[p].slack || solver.stayed(p));
    ++before;
  }
  for (; before != end; ++before) sum.known = sum.known && before->slides;
  return sum;
}

bool SlideEnergy::give_way(const ContactSolver& solver, const ContactConstraints& acting, const Sliding* sliding,
                           ContactRows& rows) {
  const Sum sum = sum_up(solver, acting, sliding);
  if (!sum.known || !(sum.stored > 0)) return false;
  const double excess = sum.created - lost_;
  if (getenv("NOGUARD")) return false;
  if (!(excess > kTolerance * sum.stored)) return false;
  shorten(solver, acting, sliding, excess - 0.5 * kTolerance * sum.stored, sum, rows);
  return true;
}

// The energy goes with the square of the targets. Contacts that have moved bear it, if they hold as much.
void SlideEnergy::shorten(const ContactSolver& solver, const ContactConstraints& acting, const Sliding* sliding,
                          double excess, const Sum& sum, ContactRows& rows) const {
  const bool moved_bear = sum.moved > excess;
  const double kept = std::sqrt(std::max(0.0, 1 - excess / (moved_bear ? sum.moved : sum.stored)));
  for (std::int32_t p = 0; p < acting.constraint_count; ++p) {
    if (!sliding[p].slack || (moved_bear && solver.stayed(p))) continue;
    const double shorter = (1 - kept) * acting.target[p].x;
    Vec3 target = rows.set().target[p];
    target.x -= shorter;
    rows.set_target(p, target);
    *sliding[p].slack += acting.constraints[p].share * shorter;
  }
}

// The energy that was lost pays for longer targets in the next step. Where a contact bears no force, or one against its slack, its target
// becomes zero or what is left of it.
void SlideEnergy::lengthen(const ContactConstraints& acting, const Sliding* sliding, double stored) const {
  const double more = stored > 0 && lost_ > 0 ? std::sqrt(1 + lost_ / stored) - 1 : 0;
  for (std::int32_t p = 0, end = 0; p < acting.constraint_count; p = end) {
    double depth = 0, force = 0;
    for (; end < acting.constraint_count && is_of_one_contact(acting.constraints[p], acting.constraints[end]); ++end)
      depth += acting.constraints[end].share * acting.target[end].x, force += held_[end].reaction.x;
    if (!sliding[p].slack || *sliding[p].slack == 0) continue;
    double& slack = *sliding[p].slack;
    if (slack * force > 0)
      slack -= (slack > 0 ? 1 : -1) * std::min(std::fabs(slack), more * std::fabs(depth));
    else if (slack > 0)
      slack = std::clamp(depth + slack, 0.0, slack);
  }
}

bool SlideEnergy::end(const ContactSolver& solver, const ContactConstraints& acting, const Sliding* sliding,
                      bool trusted) {
  const Sum sum = sum_up(solver, acting, sliding);
  lost_ = !(sum.stored > 0) ? 0 : trusted && sum.known ? std::min(lost_ - sum.created, sum.stored) : lost_;
  count_ = acting.constraint_count;
  for (std::int32_t p = 0; p < count_; ++p) {
    const ContactConstraint& constraint = acting.constraints[p];
    const Vec3 reaction = solver.reaction(p);
    held_[p] = {constraint.tool,
                constraint.point,
                constraint.part,
                sliding[p].slack != nullptr,
                acting.target[p],
                reaction,
                force_of(constraint, reaction),
                sliding[p].at};
  }
  lengthen(acting, sliding, sum.stored);
  return lost_ >= -kTold * sum.stored;
}

}  // namespace palpate
