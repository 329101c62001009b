#include "runtime/large/large_body.h"

#include <algorithm>

#include "runtime/base/contact_nodes.h"
#include "runtime/contact/touch_solve.h"
#include "runtime/contact/touch_step.h"

namespace palpate {

template <class Force>
void LargeBody::note_energy(TouchStep& step, const ContactConstraints& set, Force force_on) {
  const bool counts = note_sliding(step, set, energy_.sliding()) || energy_.is_begun();
  for (std::int32_t p = 0; p < set.constraint_count; ++p) {
    const ContactConstraint& constraint = set.constraints[p];
    energy_.force()[p] = force_on(p);
    BodyEnergy::Along& along = energy_.along()[p] = {};
    if (!counts || !constraint.framed || constraint.turns) continue;
    along.line = load3(constraint.frame.m[0]);
    for (std::int32_t e = constraint.first_node; e < constraint.first_node + constraint.node_count; ++e)
      along.moved += set.nodes[e].weight * moved_node(*step.state, e);
  }
}

void LargeBody::raise_where_shortened(TouchStep& step, const ContactConstraints& set, bool behind) {
  if (behind) energy_.lag();
  if (energy_.lag_shortens(set, BodyBeside::kBehind))
    raise_where_slides(step, set, energy_.sliding(), PALPATE_STEP_DEFORMATION_BEHIND);
}

void LargeBody::end_energy(TouchStep& step, const ContactConstraints& set, bool followed) {
  if (energy_.gives_much()) raise_where_slides(step, set, energy_.sliding(), PALPATE_STEP_SOLVE_INEXACT);
  energy_.end(set, followed);
}

void LargeBody::raise(TouchStep& step, std::uint32_t flags) {
  step.flags |= flags;
  for (std::int32_t t = 0; t < step.state->input.count(); ++t)
    if (step.result[t].sum.contacts > 0) step.state->input.tool(t).flags |= flags;
}

// ---- in the touch ----------------------------------------------------------------------------------------------------

namespace {

// The body is not where its contacts hold it.
bool lags(const DeformingBody::Outcome& outcome) {
  return outcome.failed || outcome.lags();
}

}  // namespace

ContactSolver::Outcome BodyInTouch::solve(TouchStep& step, bool again) {
  TouchState& state = *step.state;
  const ContactConstraints& set = *step.acting;
  const DeformingBody::Outcome last = again ? outcome_ : DeformingBody::Outcome{};
  if (!again) take_offset(step);
  outcome_ = deforming_.solve(set, &state.work, state.force);
  outcome_.steps += last.steps, outcome_.evaluations += last.evaluations;
  return tell(step);
}

void BodyInTouch::take_offset(TouchStep& step) {
  const Offset& offset = step.state->offset;
  if (offset.exists()) deforming_.move_by(offset.amounts(), offset.volumes());
  if (offset.exists() || new_nodes_.count > 0) energy_.pay(deforming_.take_given());
}

ContactSolver::Outcome BodyInTouch::tell(TouchStep& step) {
  std::fill(step.state->modified, step.state->modified + step.acting->node_count, Vec3{});
  if (RowVolume* const volumes = step.state->offset.volumes()) deforming_.tell_volumes(volumes);
  step.deformed = {outcome_.steps, outcome_.residual, outcome_.least_volume, outcome_.cut || outcome_.given_up};
  return outcome_.failed ? ContactSolver::Outcome::unsolved : ContactSolver::Outcome::solved;
}

bool BodyInTouch::prepare(TouchStep& step) {
  TouchState& state = *step.state;
  step.taken = &take(step), step.acting = &state.offset.acting(*step.taken);
  take_offset(step);
  sound_ = deforming_.begin(*step.acting, &state.work);
  if (sound_) deforming_.aim(*step.acting);
  return sound_;
}

void BodyInTouch::aim(TouchStep& step) {
  step.acting = &step.state->offset.acting(*step.taken);
  deforming_.aim(*step.acting);
}

bool BodyInTouch::follow(TouchStep& step) {
  step.acting = &step.state->offset.acting(*step.taken);
  bool went = false;
  sound_ = sound_ && deforming_.follow(*step.acting, &went);
  return went;
}

ContactSolver::Outcome BodyInTouch::take_reactions(TouchStep& step, const LawEffort&) {
  step.acting = &step.state->offset.acting(*step.taken);
  outcome_ = deforming_.end(*step.acting, sound_, &step.state->work, step.state->force);
  return tell(step);
}

ContactSolver::Outcome BodyInTouch::fail(TouchStep& step) {
  sound_ = false;
  return take_reactions(step, {});
}

void BodyInTouch::note_energy(TouchStep& step) {
  LargeBody::note_energy(step, *step.acting,
                         [&](std::int32_t p) { return transposed_times(deforming_.frame(p), deforming_.reaction(p)); });
}

bool BodyInTouch::gives_way(TouchStep& step, ContactSolver::Outcome) {
  if (!watches_ || lags(outcome_)) return false;
  note_energy(step);
  const double energy = deforming_.energy();
  return energy_.give_way(energy, deforming_.solver().energy_noise(energy), *step.acting, step.state->rows);
}

void BodyInTouch::judge(TouchStep& step, ContactSolver::Outcome) {
  const ContactConstraints& set = *step.acting;
  const bool behind = lags(outcome_);
  if (watches_) {
    note_energy(step);
    raise_where_shortened(step, set, behind);
    const double energy = deforming_.energy();
    if (!behind) energy_.judge(energy, deforming_.solver().energy_noise(energy), set);
    end_energy(step, set, !behind);
  }
  std::uint32_t flags = 0;
  if (outcome_.failed) flags |= PALPATE_STEP_UNSOLVED;
  if (outcome_.lags() || outcome_.unheld) flags |= PALPATE_STEP_DEFORMATION_BEHIND;
  if (outcome_.inexact) flags |= PALPATE_STEP_SOLVE_INEXACT;
  raise(step, flags);
}

Vec3 BodyInTouch::moved_node(const TouchState& state, std::int32_t e) const {
  return deforming_.moved_by_contacts(state.rows.set().nodes[e].node);
}

void BodyInTouch::move_surface(TouchStep& step, const ContactConstraints& set) {
  if (!has_field_) return;
  Operations work = 0;
  field_.set(set, step.state->force, step.is_solved, &work);
  step.state->work.owe(work);
}

void BodyInTouch::write(const TouchStep& step) const {
  palpate_contacts& out = *step.out;
  const Offset& offset = step.state->offset;
  float* const field = field_behind(out);
  deforming_.write_field(step.state->held.nodes, field);
  for (std::int32_t n = 0; n < step.state->held.nodes && offset.exists(); ++n)
    for (int i = 0; i < 3; ++i)
      field[3 * static_cast<std::size_t>(n) + static_cast<std::size_t>(i)] += static_cast<float>(offset.now(n)[i]);
  // New nodes; those that still wait stay where they are.
  for (std::int32_t k = 0; k < new_nodes_.count && new_nodes_.first + k < step.state->held.nodes; ++k)
    for (int i = 0; i < 3; ++i) {
      float& u = field[3 * static_cast<std::size_t>(new_nodes_.first + k) + static_cast<std::size_t>(i)];
      u = k < made_ ? u + static_cast<float>(on_[k][i]) : 0.0f;
    }
  out.sweeps = deforming_.effort().sweeps, out.newton_steps = deforming_.effort().newton_steps;
  out.residual_displacement = outcome_.missed;
}

void BodyInTouch::forget() {
  if (watches_) energy_.forget();
  deforming_.forget();
  if (has_field_) field_.forget();
}

void BodyInTouch::split(const Split& split, bool replayed) {
  deforming_.split(split, replayed);
  made_ = split.node - new_nodes_.first + 1;
  if (has_field_ && !replayed) field_.copy_node(split.from, split.node);
}

void BodyInTouch::forget_changes() {
  deforming_.forget_changes();
  std::fill_n(on_, new_nodes_.count, Vec3{});
  made_ = 0;
}

// ---- beside it -------------------------------------------------------------------------------------------------------

// The constraints as the linear organ is to hold them.
const ContactConstraints& BodyInThread::take(TouchStep& step) {
  bool fresh = false;
  const double given_before = beside_.told().given;
  const ContactConstraints& set = beside_.take(step.state->rows.set(), !is_joint_, &fresh);
  // What contacts felt before is no work that was done on the body.
  energy_.pay(beside_.told().given - given_before);
  if (watches_ && fresh && beside_.is_first()) energy_.adopt();
  if (!is_joint_) give(step);
  return set;
}

// Hands the constraints over to the thread.
void BodyInThread::give(TouchStep& step) {
  beside_.give();
  const BodyBeside::Told& told = beside_.told();
  std::uint32_t flags = 0;
  if (told.failed) flags |= PALPATE_STEP_UNSOLVED;
  if (told.cut || told.unfinished || beside_.behind()) flags |= PALPATE_STEP_DEFORMATION_BEHIND;
  raise(step, flags);
  step.deformed = {told.steps, told.residual, told.least_volume, false};
}

// The constraints between bodies are handed over when it is known where these bring them.
bool BodyInThread::prepare(TouchStep& step) {
  is_joint_ = true;
  const bool prepared = Body::prepare(step);
  is_joint_ = false;
  return prepared;
}

// What the thread's solution adds has become less, because the forces that belong to it have ended.
bool BodyInThread::follow(TouchStep& step) {
  const bool is_less = beside_.lose(step.state->solver);
  if (is_less) raise(step, PALPATE_STEP_DEFORMATION_BEHIND);
  return is_less;
}

ContactSolver::Outcome BodyInThread::take_reactions(TouchStep& step, const LawEffort& effort) {
  const ContactSolver::Outcome outcome = Body::take_reactions(step, effort);
  give(step);
  return outcome;
}

Vec3 BodyInThread::moved_node(const TouchState& state, std::int32_t e) const {
  return Body::moved_node(state, e) + beside_.added().now(state.rows.set().nodes[e].node);
}

// The body's energy, of a solution that goes on by the linear response.
void BodyInThread::judge(TouchStep& step, ContactSolver::Outcome outcome) {
  if (!watches_) return;
  const ContactConstraints& set = beside_.left();
  note_energy(step, set, [&](std::int32_t p) {
    const ContactConstraint& constraint = step.acting->constraints[p];
    const Vec3 reaction = step.state->solver.reaction(p);
    return constraint.framed ? transposed_times(constraint.frame, reaction) : reaction;
  });
  const double energy = beside_.energy(energy_.force()), residual = beside_.told().residual;
  raise_where_shortened(step, set, (step.flags & PALPATE_STEP_DEFORMATION_BEHIND) != 0);
  energy_.judge(energy, deforming_.solver().energy_noise(energy) + residual * residual * energy, set);
  end_energy(step, set, is_trusted(step, outcome));
}

void BodyInThread::write(const TouchStep& step) const {
  const std::size_t numbers = 3 * static_cast<std::size_t>(step.state->held.nodes);
  const float* const added = beside_.added().all();
  float* const field = field_behind(*step.out);
  if (!linear_) {
    Body::write(step);
    std::copy_n(added, numbers, field);
    return;
  }
  linear_->write(step);
  for (std::size_t i = 0; i < numbers; ++i) field[i] += added[i];
}

void BodyInThread::forget() {
  if (linear_) linear_->forget();
  if (watches_) energy_.forget();
  beside_.forget();
}

}  // namespace palpate
