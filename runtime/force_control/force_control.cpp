#include "runtime/force_control/force_control.h"

#include <algorithm>
#include <cmath>

#include "runtime/contact/contact_laws.h"
#include "runtime/contact/touch_step.h"

namespace palpate {
namespace {

// A force is met within this share of it; that of a body that takes steps of its own, which end some 1e-3 from their solution.
constexpr double kMet = 1e-6, kMetByBody = 5e-4;
constexpr double kLeastForce = 1e-9;  // N, less is none
// From this share on the state says that a force is not carried, and a step whose corrections have left so much that it is inexact.
constexpr double kTold = 1e-2;
// In directions of less than this share of the stiffness nothing holds a tool.
constexpr double kLeastStiffness = 1e-4;
constexpr double kMostLearnt = 1.5, kLeastShare = 0.25, kMostShare = 4;

// (K^T K + d^2)^-1 K^T: K^-1 where K holds, and nothing where it does not.
Mat3 inverse_where_held(const Mat3& k) {
  double size = 0;
  for (int i = 0; i < 3; ++i) size = std::max(size, std::fabs(k.m[i][i]));
  Mat3 inverse, square;
  if (!(size > 0)) return inverse;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int c = 0; c < 3; ++c) square.m[i][j] += k.m[c][i] * k.m[c][j];
  for (int i = 0; i < 3; ++i) square.m[i][i] += kLeastStiffness * kLeastStiffness * size * size;
  for (int j = 0; j < 3; ++j) {
    const Vec3 column = solve3(square, load3(k.m[j]));
    for (int i = 0; i < 3; ++i) inverse.m[i][j] = column[i];
  }
  return inverse;
}

bool is_of(const ContactConstraint& constraint, std::int32_t t) {
  return is_of_tool(constraint.id.contact) && constraint.id.contact.index == t;
}

// Of the target of constraint p, where its tool moves by 1: as the contact model has it (contact_rows.cpp).
double way_of(const ContactConstraints& set, std::int32_t p) {
  double way = 1 + set.constraints[p].share;
  const ContactId& contact = set.constraints[p].id.contact;
  std::int32_t first = p - set.constraints[p].id.part;
  for (; first < set.constraint_count && set.constraints[first].id.contact == contact; ++first)
    way -= set.constraints[first].share * set.constraints[first].share;
  return way;
}

}  // namespace

bool ForceControl::create(SceneMemory& memory, TouchState* touch, std::int32_t max_tools, std::int32_t constraints,
                          Pass pass) {
  touch_ = touch, pass_ = pass;
  driven_ = memory.array<Driven>(static_cast<std::size_t>(max_tools));
  constraints_ = memory.array<std::int32_t>(static_cast<std::size_t>(constraints));
  way_ = memory.array<double>(static_cast<std::size_t>(constraints));
  memory.keep_array(driven_, static_cast<std::size_t>(max_tools));
  for (std::int32_t t = 0; !memory.failed() && t < max_tools; ++t) forget_tool(t);
  return !memory.failed();
}

void ForceControl::forget_tool(std::int32_t t) {
  driven_[t] = Driven{};
}

// N, in the organ's frame.
Vec3 ForceControl::given(const TouchStep& step, std::int32_t t) const {
  return touch_->organ.vector_to_organ(load3(force_of(step.state->input.tool(t)).force));
}

// m, in this step.
double ForceControl::farthest(const TouchStep& step, std::int32_t t) const {
  const ToolInput& input = step.state->input;
  constexpr double within = 1 - 1e-9;  // of the motion beyond which a point is lost
  return within * std::min(force_of(input.tool(t)).speed, step.context->def.max_tool_speed) * input.dt();
}

// The nearest way that a tool may have in this step.
Vec3 ForceControl::within(const TouchStep& step, std::int32_t t, Vec3 way, bool* limited) const {
  const Vec3 moved = way - asked_[t].start;
  const double size = length(moved), most = farthest(step, t);
  *limited = size > most;
  return *limited ? asked_[t].start + (most / size) * moved : way;
}

void ForceControl::begin_step(TouchStep& step) {
  ToolInput& input = step.state->input;
  for (std::int32_t t = 0; t < input.count(); ++t) {
    Tool& tool = input.tool(t);
    Driven& driven = driven_[t];
    tool.held_back = {};
    if (tool.index < 0 || !has_force(tool)) {
      if (driven.active) forget_tool(t);
      continue;
    }
    asked_[t] = Asked{driven.way, {}, {}, false};
    const Vec3 force = load3(force_of(tool).force);
    Vec3 by;
    if (driven.active && driven.state.condition == PALPATE_GIVEN_FORCE_FREE)
      by = farthest(step, t) * unit_or_zero(force);
    else if (driven.active && driven.state.condition == PALPATE_GIVEN_FORCE_CARRIED)
      by = touch_->organ.vector_to_world(driven.share *
                                         (driven.gives * touch_->organ.vector_to_organ(force - driven.last)));
    // What presses stays in contact where others move the surface away: the force brings the tool after it.
    if (driven.active && dot(force, load3(driven.state.force)) > 0) tool.hold = true;
    driven.active = 1, driven.last = force;
    bool limited = false;
    driven.way = within(step, t, driven.way + by, &limited);
    tool.held_back = -1 * driven.way;
  }
}

ForceControl::Pressing ForceControl::pressing(const TouchStep& step, std::int32_t t) const {
  const ContactConstraints& set = touch_->rows.set();
  Pressing of;
  of.tool = t;
  bool sticks = false, holds = false;
  Vec3 across, normals;
  for (std::int32_t p = 0; p < set.constraint_count; ++p) {
    const ContactConstraint& constraint = set.constraints[p];
    if (!is_of(constraint, t)) continue;
    of.touches = true;
    const Mat3 axes = touch_->body->axes(step, p);
    const Vec3 r = step.reaction(p);
    of.force += transposed_times(axes, r);
    const GivesWay gone = gives_way(constraint, r);
    holds = holds || constraint.law == ContactLaw::sticking;
    normals += load3(axes.m[0]);
    if (gone.released) continue;
    if (constraint.law == ContactLaw::coulomb) of.friction = constraint.friction;
    sticks = sticks || (constraint.law == ContactLaw::coulomb && !gone.slips);
    across += r.x * load3(axes.m[0]), of.pressed += r.x;
  }
  of.across = length(across), of.normal = unit_or_zero(of.across > 0 ? across : normals);
  of.may_slip = of.touches && !holds, of.slips = of.may_slip && !sticks;
  if (!is_finite(of.force)) of.force = {};  // the step has no solution
  of.missed = given(step, t) - of.force;
  return of;
}

// N: of what is missed, the part that friction does not refuse: the sum stays in the cone of what presses.
Vec3 ForceControl::allowed(const Pressing& of) const {
  if (!of.may_slip) return of.missed;
  const double more = dot(of.missed, of.normal),
               most = of.across > 0 ? of.friction * of.pressed * std::max(0.0, 1 + more / of.across) : 0;
  const Vec3 now = of.force - dot(of.force, of.normal) * of.normal;
  if (of.friction == 0) return more * of.normal;
  Vec3 along = now + of.missed - more * of.normal;
  if (length(along) > most) along = (most / length(along)) * along;
  return more * of.normal + along - now;
}

double ForceControl::tolerance(const TouchStep& step, std::int32_t t) const {
  return (touch_->body->responds_linearly() ? kMet : kMetByBody) * length(given(step, t)) + kLeastForce;
}

// N/m, [3 count][3 count]: of the sums of these tools.
void ForceControl::measure(const Pressing* pressing, int count, double* stiffness) {
  const ContactConstraints& set = touch_->rows.set();
  SystemSolver::MovedAlike group[PALPATE_MAX_TOOLS];
  std::int32_t found = 0;
  for (int i = 0; i < count; ++i) {
    const std::int32_t first = found;
    for (std::int32_t p = 0; p < set.constraint_count; ++p)
      if (is_of(set.constraints[p], pressing[i].tool)) way_[found] = way_of(set, p), constraints_[found++] = p;
    group[i].constraint = constraints_ + first, group[i].way = way_ + first, group[i].count = found - first;
  }
  touch_->body->measure_stiffness(*touch_, group, count, stiffness);
}

bool ForceControl::asks_again(TouchStep& step) {
  Pressing all[PALPATE_MAX_TOOLS];
  int count = 0;
  bool any = false;
  for (std::int32_t t = 0; t < touch_->input.count(); ++t) {
    if (!driven_[t].active) continue;
    all[count] = pressing(step, t);
    if (!all[count].touches) continue;
    all[count].missed = allowed(all[count]);
    any = any || length(all[count].missed) > tolerance(step, t);
    ++count;
  }
  if (!any) return false;
  constexpr int most = 3 * PALPATE_MAX_TOOLS;
  double stiffness[most * most];
  measure(all, count, stiffness);
  Vec3 by[PALPATE_MAX_TOOLS] = {};
  const auto between = [&](int i, int j) {
    Mat3 k;
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) k.m[a][b] = stiffness[(3 * i + a) * 3 * count + 3 * j + b];
    return k;
  };
  for (int i = 0; i < count; ++i) learn(all[i], between(i, i));
  // Gauss and Seidel: tools are coupled through the tissue between them, which is softer than that below each.
  constexpr int kSweeps = 4;
  for (int sweep = 0; sweep < kSweeps; ++sweep)
    for (int i = 0; i < count; ++i) {
      Vec3 left = all[i].missed;
      for (int j = 0; j < count; ++j)
        if (j != i) left = left - between(i, j) * by[j];
      by[i] = driven_[all[i].tool].gives * left;
    }
  bool moved = false;
  for (int i = 0; i < count; ++i) moved = move(step, all[i], by[i]) || moved;
  return moved;
}

// Takes over the stiffness of a tool, and what its last correction in this step has shown: organs that are pressed against one another, and contacts that
// give way, are softer than their rows.
void ForceControl::learn(const Pressing& of, Mat3 stiffness) {
  Driven& driven = driven_[of.tool];
  Asked& asked = asked_[of.tool];
  if (of.slips) {
    // The rows along the surface do not hold. Where friction gets less they would; about as those across it. Without friction the tool stands there.
    const double across = dot(of.normal, stiffness * of.normal), along = of.friction > 0 ? across : 0;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        const double normal = of.normal[i] * of.normal[j];
        if (of.friction == 0) stiffness.m[i][j] = across * normal;
        stiffness.m[i][j] += along * ((i == j ? 1 : 0) - normal);
      }
  }
  driven.gives = inverse_where_held(stiffness), driven.carries = stiffness * driven.gives;
  if (!is_finite(driven.gives * of.missed)) driven.gives = driven.carries = Mat3{};
  if (const double expected = dot(asked.wanted, asked.wanted); expected > 0) {
    const double taken = dot(of.force - asked.force, asked.wanted) / expected;
    if (taken > 0)
      driven.share =
          std::clamp(driven.share * std::clamp(1 / taken, 1 / kMostLearnt, kMostLearnt), kLeastShare, kMostShare);
  }
  asked.force = of.force, asked.wanted = driven.carries * of.missed;
}

// Returns whether the targets of the tool have moved. by: m, in the organ's frame.
bool ForceControl::move(TouchStep& step, const Pressing& of, Vec3 by) {
  Driven& driven = driven_[of.tool];
  const bool is_held = !is_zero(driven.gives * of.missed) || is_zero(of.missed);
  Vec3 to = driven.way + driven.share * touch_->organ.vector_to_world(by);
  if (!is_held && is_zero(of.force))
    to = driven.way + farthest(step, of.tool) * unit_or_zero(load3(force_of(touch_->input.tool(of.tool)).force));
  if (!is_finite(to)) return false;
  to = within(step, of.tool, to, &asked_[of.tool].limited);
  const Vec3 moved = touch_->organ.vector_to_organ(to - driven.way);
  if (is_zero(moved)) return false;
  driven.way = to, touch_->input.tool(of.tool).held_back = -1 * to;
  const ContactConstraints& set = touch_->rows.set();
  for (std::int32_t p = 0; p < set.constraint_count; ++p) {
    const ContactConstraint& constraint = set.constraints[p];
    if (!is_of(constraint, of.tool)) continue;
    Vec3 target = set.target[p];
    const Vec3 along = way_of(set, p) * (constraint.framed ? constraint.frame * moved : moved);
    for (int i = 0; i < 3; ++i)
      if (constraint.framed || constraint.axes >> i & 1u) target[i] += along[i];
    touch_->rows.set_target(p, target);
  }
  return true;
}

void ForceControl::take_reactions(TouchStep& step, bool) {
  for (std::int32_t t = 0; t < touch_->input.count(); ++t) {
    Driven& driven = driven_[t];
    if (!driven.active) continue;
    const Pressing of = pressing(step, t);
    palpate_given_force_state& state = driven.state;
    const double least = kTold * length(given(step, t)) + kLeastForce;
    state.condition = PALPATE_GIVEN_FORCE_CARRIED;
    if (!of.touches) {
      state.condition = PALPATE_GIVEN_FORCE_FREE;
    } else if (length(of.missed) > least) {
      const bool moves = length(driven.carries * allowed(of)) > least;
      state.condition = moves ? PALPATE_GIVEN_FORCE_MOVES : PALPATE_GIVEN_FORCE_PART;
      if (moves) step.raise(t, asked_[t].limited ? PALPATE_STEP_MOTION_LIMITED : PALPATE_STEP_SOLVE_INEXACT);
    }
    store3(driven.way, state.displacement);
    store3(touch_->organ.vector_to_world(of.force), state.force);
    store3(touch_->organ.vector_to_world(of.missed), state.missed);
  }
}

}  // namespace palpate
