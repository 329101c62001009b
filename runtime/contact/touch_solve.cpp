#include "runtime/contact/touch_solve.h"

#include <algorithm>

#include "runtime/contact/tool_forces.h"
#include "runtime/contact/touch_step.h"

namespace palpate {
namespace {

static_assert(Motions::kMostSolves <= kMostSlipSolves, "the last solve has the pressures that follow_volumes() left");

class Solve {
 public:
  explicit Solve(TouchStep& step) : step_(step), context_(*step.context), state_(*step.state) {}

  // The constraints once more as long as sources ask for it, and where a held volume is missed.
  ContactSolver::Outcome solve_again(const ContactConstraints& set) {
    ContactSolver::Outcome outcome = ContactSolver::Outcome::solved;
    const bool moves = has_motions(context_.def);
    for (int solve = 0; solve < kMostSlipSolves; ++solve) {
      step_.acting = moves ? &state_.motions.acting(set) : &set;
      outcome =
          state_.solver.solve(context_.tensors, *step_.acting, state_.force, state_.modified, &state_.work, solve > 0);
      if (outcome == ContactSolver::Outcome::unsolved) break;
      // Without room, what sources and held volumes miss is that of this solve.
      const bool has_room = state_.work.left() >= state_.solver.operations_to_solve({}),
                 last = solve + 1 == kMostSlipSolves;
      const bool missed =
          moves && (has_room || last ? state_.motions.follow_volumes(set, state_.force, solve, &step_.flags)
                                     : state_.motions.holds_volumes());
      if (last) break;
      const bool gives_way =
          watches_slide_energy(context_.def) && has_room && is_trusted(outcome) &&
          note_sliding(*step_.acting, state_.slide_energy.sliding()) &&
          state_.slide_energy.give_way(state_.solver, *step_.acting, state_.slide_energy.sliding(), state_.rows);
      if (!sources_ask_again(step_) && !missed && !gives_way) break;
      if (has_room) continue;
      step_.flags |= PALPATE_STEP_SOLVE_INEXACT;
      break;
    }
    return outcome;
  }
  // What the accounts of energy are to know about the constraints. False where none slides.
  bool note_sliding(const ContactConstraints& set, SlideEnergy::Sliding* of) {
    bool any = false;
    for (std::int32_t p = 0; p < set.constraint_count; ++p) {
      const ContactConstraint& constraint = set.constraints[p];
      SlideEnergy::Sliding& sliding = of[p];
      sliding = {};
      for (std::int32_t i = 0; i < state_.source_count; ++i)
        any = state_.sources[i]->note_sliding(step_, set, constraint, &sliding) || any;
    }
    return any;
  }
  // Of each tool whose contact slides.
  void raise_where_slides(const ContactConstraints& set, const SlideEnergy::Sliding* of, std::uint32_t flag) {
    for (std::int32_t p = 0; p < set.constraint_count; ++p)
      if (of[p].slides()) step_.raise(tool_of(set.constraints[p].id.contact), flag);
  }
  // Whether all constraints meet their targets and laws.
  bool is_trusted(ContactSolver::Outcome outcome) const {
    bool trusted = outcome == ContactSolver::Outcome::solved;
    for (std::int32_t p = 0; p < step_.acting->constraint_count; ++p) {
      const ContactSolver::Doubt doubt = state_.solver.doubt_of(p);
      trusted = trusted && !doubt.inexact && !doubt.conflict;
    }
    return trusted;
  }
  void end_slide_energy(ContactSolver::Outcome outcome) {
    SlideEnergy& energy = state_.slide_energy;
    note_sliding(*step_.acting, energy.sliding());
    const Operations rows = state_.solver.matrix().rows().rows_end,
                     cost = is_trusted(outcome) ? 0 : rows * rows / kDense;
    const bool met = cost == 0 || cost > state_.work.left();
    if (!met) state_.work.add(cost);
    if (energy.end(state_.solver, *step_.acting, energy.sliding(), met)) return;
    raise_where_slides(*step_.acting, energy.sliding(), PALPATE_STEP_SOLVE_INEXACT);
  }
  // The same as solve(), of the hyperelastic body.
  void deform() {
    const ContactConstraints& set = state_.rows.set();
    DeformingBody& body = state_.body;
    for (int solve = 0;; ++solve) {
      const DeformingBody::Outcome last = step_.deformed;
      step_.deformed = body.solve(set, &state_.work, state_.force);
      step_.deformed.steps += last.steps, step_.deformed.evaluations += last.evaluations;
      if (!watches_body_energy(context_.def)) break;
      note_body_energy(set, [&](std::int32_t p) { return transposed_times(body.frame(p), body.reaction(p)); });
      const double energy = body.energy(), noise = body.solver().energy_noise(energy);
      const bool has_room = state_.work.left() >= body.fewest_operations();
      if (lags() || !has_room || solve + 1 == kMostSlipSolves ||
          !state_.body_energy.give_way(energy, noise, state_.rows))
        break;
    }
    if (watches_body_energy(context_.def)) {
      raise_where_shortened(set, lags());
      if (!lags()) state_.body_energy.judge(body.energy(), body.solver().energy_noise(body.energy()), set);
      end_body_energy(set, !lags());
    }
    std::uint32_t flags = 0;
    if (step_.deformed.failed) flags |= PALPATE_STEP_UNSOLVED;
    if (step_.deformed.cut || step_.deformed.given_up || step_.deformed.unfinished)
      flags |= PALPATE_STEP_DEFORMATION_BEHIND;
    if (step_.deformed.inexact) flags |= PALPATE_STEP_SOLVE_INEXACT;
    step_.flags |= flags;
    std::fill(state_.modified, state_.modified + set.node_count, Vec3{});
    add_forces(step_);
    for (std::int32_t t = 0; t < state_.input.count(); ++t)
      if (step_.result[t].sum.contacts > 0) state_.input.tool(t).flags |= flags;
    if (uses_body_field(context_.def)) {
      Operations work = 0;
      state_.body_field.set(set, state_.force, !step_.deformed.failed, &work);
      state_.work.owe(work);
    }
    step_.is_solved = !step_.deformed.failed;
    step_.follows = !step_.deformed.failed && !step_.deformed.cut && !step_.deformed.given_up;
  }
  // The body is not where its contacts hold it.
  bool lags() const {
    return step_.deformed.failed || step_.deformed.cut || step_.deformed.given_up || step_.deformed.unfinished;
  }

  // force_on(p): N, of constraint p on the body, in the organ's frame.
  template <class Force>
  void note_body_energy(const ContactConstraints& set, Force force_on) {
    BodyEnergy& energy = state_.body_energy;
    note_sliding(set, energy.sliding());
    for (std::int32_t p = 0; p < set.constraint_count; ++p) energy.force()[p] = force_on(p);
  }
  // Contacts felt too little while the body was behind, and what it has beyond that has shortened them since.
  void raise_where_shortened(const ContactConstraints& set, bool behind) {
    BodyEnergy& energy = state_.body_energy;
    if (behind) energy.lag();
    if (energy.lag_shortens(set, BodyBeside::kBehind))
      raise_where_slides(set, energy.sliding(), PALPATE_STEP_DEFORMATION_BEHIND);
  }
  void end_body_energy(const ContactConstraints& set, bool followed) {
    BodyEnergy& energy = state_.body_energy;
    if (energy.gives_much()) raise_where_slides(set, energy.sliding(), PALPATE_STEP_SOLVE_INEXACT);
    energy.end(set, followed);
  }

  // Large deformation beside the touch: the constraints as the linear organ is to hold them.
  const ContactConstraints& take_solution() {
    bool fresh = false;
    const ContactConstraints& rows = state_.rows.set();
    const ContactConstraints& set = state_.beside.take(rows, &fresh);
    const BodyBeside::Told& told = state_.beside.told();
    // What contacts felt before is no work that was done on the body.
    if (watches_body_energy(context_.def) && fresh && state_.beside.is_first()) state_.body_energy.adopt();
    std::uint32_t flags = 0;
    if (told.failed) flags |= PALPATE_STEP_UNSOLVED;
    if (told.cut || told.unfinished || state_.beside.behind()) flags |= PALPATE_STEP_DEFORMATION_BEHIND;
    step_.flags |= flags;
    for (std::int32_t t = 0; t < state_.input.count(); ++t)
      if (step_.result[t].sum.contacts > 0) state_.input.tool(t).flags |= flags;
    step_.deformed.steps = told.steps, step_.deformed.residual = told.residual,
    step_.deformed.least_volume = told.least_volume;
    return set;
  }

  // The body's energy, of a solution that goes on by the linear response.
  void judge_beside(ContactSolver::Outcome outcome) {
    const ContactConstraints& set = state_.rows.set();
    BodyEnergy& account = state_.body_energy;
    note_body_energy(set, [&](std::int32_t p) {
      const ContactConstraint& constraint = step_.acting->constraints[p];
      const Vec3 reaction = state_.solver.reaction(p);
      return constraint.framed ? transposed_times(constraint.frame, reaction) : reaction;
    });
    const double energy = state_.beside.energy(account.force()), residual = state_.beside.told().residual;
    raise_where_shortened(set, (step_.flags & PALPATE_STEP_DEFORMATION_BEHIND) != 0);
    account.judge(energy, state_.body.solver().energy_noise(energy) + residual * residual * energy, set);
    end_body_energy(set, is_trusted(outcome));
  }

  void solve(const ContactSolver::Outcome* joint) {
    const ContactConstraints& set = deforms_beside(context_.def) ? take_solution() : state_.rows.set();
    step_.acting = joint && has_motions(context_.def) ? &state_.motions.acting(set) : &set;
    const ContactSolver::Outcome outcome = joint ? *joint : solve_again(set);
    if (watches_slide_energy(context_.def)) end_slide_energy(outcome);
    if (deforms_beside(context_.def) && watches_body_energy(context_.def)) judge_beside(outcome);
    if (has_motions(context_.def)) state_.motions.end(set, state_.force);
    step_.is_solved = step_.follows = outcome != ContactSolver::Outcome::unsolved;
    context_.watch.ended(Pass::contact);
    for (std::int32_t i = 0; i < state_.source_count; ++i) {
      state_.sources[i]->take_reactions(step_, step_.is_solved);
      context_.watch.ended(state_.sources[i]->pass());
    }
    std::uint32_t flag = 0;
    if (outcome == ContactSolver::Outcome::regularised) flag = PALPATE_STEP_REGULARISED;
    if (outcome == ContactSolver::Outcome::unsolved) flag = PALPATE_STEP_UNSOLVED;
    for (std::int32_t e = 0; flag && e < set.node_count; ++e) step_.raise(tool_of(set.nodes[e].contact), flag);
    add_forces(step_);
    for (std::int32_t p = 0; p < set.constraint_count; ++p) {
      const ContactSolver::Doubt doubt = state_.solver.doubt_of(p);
      if (doubt.inexact) step_.raise(tool_of(set.constraints[p].id.contact), PALPATE_STEP_SOLVE_INEXACT);
      if (doubt.conflict) step_.raise(tool_of(set.constraints[p].id.contact), PALPATE_STEP_REGULARISED);
    }
    if (state_.displacement.exists()) state_.displacement.set(context_.tensors, set, state_.modified, step_.is_solved);
    if (!follows_deformed_surface(context_.def)) return;
    Operations work = 0;
    if (step_.is_solved)
      state_.field.set(context_.tensors, set, state_.force, &state_.solver, state_.work.debts_left(), &work);
    else
      state_.field.set_rest();
    state_.work.owe(work);
  }

 private:
  TouchStep& step_;
  const StepContext& context_;
  TouchState& state_;
};

}  // namespace

bool sources_ask_again(TouchStep& step) {
  bool again = false;
  for (std::int32_t s = 0; s < step.state->source_count; ++s) again = step.state->sources[s]->asks_again(step) || again;
  return again;
}

void solve_contacts(TouchStep& step, const ContactSolver::Outcome* joint) {
  Solve solve(step);
  if (deforms_largely(step.context->def))
    solve.deform();
  else
    solve.solve(joint);
  for (std::int32_t s = 0; s < step.state->source_count; ++s) {
    step.state->sources[s]->end(step);
    step.context->watch.ended(step.state->sources[s]->pass());
  }
}

}  // namespace palpate
