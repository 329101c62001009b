// The solution of a step, and what the linear organ (body.h) answers to it.
#include "runtime/contact/touch_solve.h"

#include <algorithm>

#include "runtime/contact/tool_forces.h"
#include "runtime/contact/touch_step.h"

namespace palpate {

bool sources_ask_again(TouchStep& step) {
  bool again = false;
  for (RowSource* source : step.state->parts.sources()) again = source->asks_again(step) || again;
  return again;
}

bool note_sliding(TouchStep& step, const ContactConstraints& set, SlideEnergy::Sliding* of) {
  bool any = false;
  for (std::int32_t p = 0; p < set.constraint_count; ++p) {
    of[p] = {};
    for (RowSource* source : step.state->parts.sources())
      any = source->note_sliding(step, set, set.constraints[p], &of[p]) || any;
  }
  return any;
}

void raise_where_slides(TouchStep& step, const ContactConstraints& set, const SlideEnergy::Sliding* of,
                        std::uint32_t flag) {
  for (std::int32_t p = 0; p < set.constraint_count; ++p)
    if (of[p].slides()) step.raise(tool_of(set.constraints[p].id.contact), flag);
}

bool is_trusted(const TouchStep& step, ContactSolver::Outcome outcome) {
  bool trusted = outcome == ContactSolver::Outcome::solved;
  for (std::int32_t p = 0; p < step.acting->constraint_count; ++p) {
    const ContactSolver::Doubt doubt = step.state->solver.doubt_of(p);
    trusted = trusted && !doubt.inexact && !doubt.conflict;
  }
  return trusted;
}

// ---- the linear organ ------------------------------------------------------------------------------------------------

const ContactConstraints& Body::take(TouchStep& step) {
  return step.state->rows.set();
}

ContactSolver::Outcome Body::solve(TouchStep& step, bool again) {
  TouchState& state = *step.state;
  return state.solver.solve(step.context->tensors, *step.acting, state.force, state.modified, &state.work, again);
}

bool Body::prepare(TouchStep& step) {
  TouchState& state = *step.state;
  step.taken = &take(step), step.acting = &state.offset.acting(*step.taken);
  if (!state.solver.prepare(step.context->tensors, *step.acting, &state.work)) return false;
  state.solver.take_targets(*step.acting);
  return true;
}

void Body::aim(TouchStep& step) {
  take_targets(step);
  step.acting = &step.state->offset.acting(*step.taken);
  step.state->solver.take_targets(*step.acting);
}

BodySystem Body::system(TouchState& state) {
  ContactSolver& solver = state.solver;
  return {&solver.matrix().rows(), solver.matrix().rows_of_constraints(), &solver.system(), &solver.matrix()};
}

ContactSolver::Outcome Body::take_reactions(TouchStep& step, const LawEffort& effort) {
  aim(step);
  return step.state->solver.take_reactions(*step.acting, effort, step.state->force, step.state->modified);
}

ContactSolver::Outcome Body::fail(TouchStep& step) {
  TouchState& state = *step.state;
  return state.solver.fail(*step.acting, state.force, state.modified);
}

Vec3 Body::reached(const TouchState& state, std::int32_t p) const {
  return state.solver.reached(p);
}

Operations Body::operations_to_solve(const TouchStep& step) const {
  return step.state->solver.operations_to_solve({});
}

namespace {

// A row of multiply-adds for each row.
Operations squared_rows(const TouchState& state) {
  const Operations rows = state.solver.matrix().rows().rows_end;
  return rows * rows / kDense;
}

// Whether the account of energy tells the ways of contacts that slide from what else moves the surface: where it does, and there is room.
bool tells_apart(TouchStep& step, Operations kept) {
  TouchState& state = *step.state;
  const Operations cost = 2 * squared_rows(state);
  if (cost + kept > state.work.left() ||
      !SlideEnergy::is_shared(state.solver, *step.acting, state.slide_energy.sliding()))
    return false;
  state.work.add(cost);
  return true;
}

}  // namespace

bool Body::gives_way(TouchStep& step, ContactSolver::Outcome outcome) {
  TouchState& state = *step.state;
  SlideEnergy& energy = state.slide_energy;
  if (!energy.exists() || !is_trusted(step, outcome) || !note_sliding(step, *step.acting, energy.sliding()))
    return false;
  const bool apart = tells_apart(step, operations_to_solve(step));
  return energy.give_way(state.solver, *step.acting, energy.sliding(), apart, state.rows);
}

void Body::judge(TouchStep& step, ContactSolver::Outcome outcome) {
  TouchState& state = *step.state;
  SlideEnergy& energy = state.slide_energy;
  if (!energy.exists()) return;
  note_sliding(step, *step.acting, energy.sliding());
  const Operations cost = is_trusted(step, outcome) ? 0 : squared_rows(state);
  const bool met = cost == 0 || cost > state.work.left();
  if (!met) state.work.add(cost);
  const bool apart = tells_apart(step, 0);
  if (energy.end(state.solver, *step.acting, energy.sliding(), met, apart)) return;
  raise_where_slides(step, *step.acting, energy.sliding(), PALPATE_STEP_SOLVE_INEXACT);
}

void Body::move_surface(TouchStep& step, const ContactConstraints& set) {
  const StepContext& context = *step.context;
  TouchState& state = *step.state;
  if (state.displacement.exists()) state.displacement.set(context.tensors, set, state.modified, step.is_solved);
  ContactField& field = state.linear_field;
  if (!field.exists()) return;
  Operations work = 0;
  if (step.is_solved)
    field.set(context.tensors, set, state.force, &state.solver, state.work.debts_left(), &work);
  else
    field.set_rest();
  state.work.owe(work);
}

Vec3 Body::reaction(const TouchState& state, std::int32_t p) const {
  return state.solver.reaction(p);
}

Vec3 Body::missed(const TouchStep& step, std::int32_t p) const {
  return step.state->solver.missed(*step.acting, p);
}

Mat3 Body::axes(const TouchStep& step, std::int32_t p) const {
  const ContactConstraint& constraint = step.taken->constraints[p];
  if (constraint.framed) return constraint.frame;
  Mat3 axes;
  for (int i = 0; i < 3; ++i) axes.m[i][i] = 1;
  return axes;
}

Vec3 Body::moved_node(const TouchState& state, std::int32_t e) const {
  return state.solver.matrix().displacement(state.rows.set(), state.force, e);
}

Mat3 Body::compliance_between(const TouchState& state, std::int32_t p, std::int32_t q) const {
  return state.solver.matrix().compliance_between_nodes(state.rows.set(), p, q);
}

void Body::measure_stiffness(TouchState& state, const SystemSolver::MovedAlike* groups, int count, double* stiffness) {
  state.solver.system().measure_stiffness(groups, count, state.solver.operations_to_solve({}), &state.work, stiffness);
}

void Body::write(const TouchStep& step) const {
  const ContactSolver& solver = step.state->solver;
  step.out->sweeps = solver.effort().sweeps, step.out->newton_steps = solver.effort().newton_steps;
  step.out->residual_displacement = solver.residual().displacement;
}

// ---- of any body -----------------------------------------------------------------------------------------------------

namespace {

// As long as sources or the body ask for it.
ContactSolver::Outcome solve_again(TouchStep& step, const ContactConstraints& set) {
  TouchState& state = *step.state;
  for (int solve = 0;; ++solve) {
    step.acting = &state.offset.acting(set);
    const ContactSolver::Outcome outcome = state.body->solve(step, solve > 0);
    if (outcome == ContactSolver::Outcome::unsolved || solve + 1 == kMostSlipSolves) return outcome;
    // Without room, what sources miss is that of this solve.
    const bool has_room = state.work.left() >= state.body->operations_to_solve(step);
    const bool gives_way = has_room && state.body->gives_way(step, outcome);
    if (!sources_ask_again(step) && !gives_way) return outcome;
    if (!has_room) {
      step.flags |= PALPATE_STEP_SOLVE_INEXACT;
      return outcome;
    }
    state.body->take_targets(step);
  }
}

}  // namespace

void solve_contacts(TouchStep& step, const ContactSolver::Outcome* joint) {
  TouchState& state = *step.state;
  Body& body = *state.body;
  if (!joint) step.taken = step.acting = &body.take(step);
  const ContactConstraints& set = *step.taken;
  const ContactSolver::Outcome outcome = joint ? *joint : solve_again(step, set);
  body.judge(step, outcome);
  step.is_solved = outcome != ContactSolver::Outcome::unsolved;
  step.follows = step.is_solved && !step.deformed.lags;
  step.context->watch.ended(Pass::contact);
  for (StepPart* part : state.parts.all()) {
    part->take_reactions(step, step.is_solved);
    step.context->watch.ended(part->pass());
  }
  std::uint32_t flag = 0;
  if (outcome == ContactSolver::Outcome::regularised) flag = PALPATE_STEP_REGULARISED;
  if (outcome == ContactSolver::Outcome::unsolved) flag = PALPATE_STEP_UNSOLVED;
  for (std::int32_t e = 0; flag && e < set.node_count; ++e) step.raise(tool_of(set.nodes[e].contact), flag);
  add_forces(step);
  for (std::int32_t p = 0; p < set.constraint_count; ++p) {
    const ContactSolver::Doubt doubt = state.solver.doubt_of(p);
    if (doubt.inexact) step.raise(tool_of(set.constraints[p].id.contact), PALPATE_STEP_SOLVE_INEXACT);
    if (doubt.conflict) step.raise(tool_of(set.constraints[p].id.contact), PALPATE_STEP_REGULARISED);
  }
  body.move_surface(step, set);
  for (RowSource* source : state.parts.sources()) {
    source->end(step);
    step.context->watch.ended(source->pass());
  }
}

}  // namespace palpate
