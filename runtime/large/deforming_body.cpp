#include "runtime/large/deforming_body.h"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

// Of an evaluation, for each tetrahedron; and of a solve, numbers of the factor for one operation.
constexpr Operations kOfATetrahedron = 12, kOfAnAveragedTetrahedron = 17, kFactorNumbers = 6;
// Of a row's own compliance, what others leave of it where they determine the row.
constexpr double kShift = 1e-6;
// Of what a contact's frame is off the surface's normal, the share that it follows in a step.
constexpr double kFollows = 0.25;
// Off by less, rad, it stays: targets that stand still then are the same ones.
constexpr double kTurned = 1e-3;

// How far the reactions move a node is not known before the body has moved.
class UnknownNodes final : public NodesOfRows {};

bool may_release(const ContactConstraint& constraint) {
  return constraint.law == ContactLaw::unilateral || constraint.law == ContactLaw::coulomb;
}

}  // namespace

LargeSolver::Created DeformingBody::create(SceneMemory& memory, const HyperelasticBody& body, const std::int32_t* order,
                                           std::int32_t order_count, const Limits& limits, const double* preload) {
  constraint_capacity_ = limits.constraints, of_laws_ = limits.of_laws;
  const auto constraints = static_cast<std::size_t>(limits.constraints), rows = 3 * constraints,
             nodes = static_cast<std::size_t>(limits.nodes);
  rows_.list = memory.array<LargeRow>(rows), rows_of_ = memory.array<RowsOfConstraint>(constraints);
  lead_ = memory.array<std::int32_t>(constraints), rows_.joins = memory.array<LargeJoin>(constraints);
  frames_ = memory.array<Mat3>(constraints), reaction_ = memory.array<Vec3>(constraints);
  kept_ = memory.array<Kept>(constraints), now_ = memory.array<Kept>(constraints);
  rows_.nodes = memory.array<std::int32_t>(nodes), rows_.weights = memory.array<double>(nodes);
  force_ = memory.array<double>(rows), start_ = memory.array<double>(rows);
  rows_.beside = memory.array<double>(rows * rows);
  if (limits.gives_way) {
    for (double** array : {&place_, &free_, &ahead_}) *array = memory.array<double>(rows);
    holds_ = memory.array<std::uint8_t>(rows), slips_ = memory.array<std::uint8_t>(rows);
  }
  if (memory.failed()) return LargeSolver::Created::no_memory;
  memory.keep(kept_count_);
  memory.keep_array(kept_, constraints, kept_count_);
  const LargeSolver::Created created =
      solver_.create(memory, body, order, order_count, 3 * limits.constraints, limits.nodes, preload,
                     limits.renews_metric, BlockFactor::kFewestForRough, limits.new_nodes);
  if (created == LargeSolver::Created::made && limits.gives_way &&
      !laws_.create(memory, &solver_.compliance(), {0, kUnlimitedOperations, false}))
    return LargeSolver::Created::no_memory;
  solve_operations_ = solver_.factor().numbers() / kFactorNumbers;
  if (limits.new_nodes.count > 0) solve_operations_ = 2 * solve_operations_ + limits.of_cut;
  operations_ = (body.averaged_shear > 0 ? kOfAnAveragedTetrahedron : kOfATetrahedron) * body.tetrahedron_count +
                solve_operations_;
  return created;
}

void DeformingBody::forget() {
  solver_.forget();
  kept_count_ = 0;
}

// What the last step knew about the constraints of this one. Both lists ascend by tool, point and part.
void DeformingBody::find_known(const ContactConstraints& set) {
  std::int32_t k = 0;
  for (std::int32_t p = 0; p < set.constraint_count; ++p) {
    const ContactConstraint& now = set.constraints[p];
    while (k < kept_count_ && kept_[k].id < now.id) ++k;
    const bool known = k < kept_count_ && kept_[k].id == now.id;
    now_[p] = known ? kept_[k] : Kept{now.id, 0, 0, {0, 0, 0}, {}};
    now_[p].known = known;
  }
}

// The frame of a constraint, turned as the surface has. It follows the surface by kFollows of what is left in each step: the surface
// turns with the frame's forces, by more than the frame where a rim rolls up below a tool, and a frame that followed at once would swing.
Mat3 DeformingBody::present_frame(const ContactConstraints& set, std::int32_t p) {
  const ContactConstraint& constraint = set.constraints[p];
  if (!constraint.framed) {
    Mat3 axes;
    for (int i = 0; i < 3; ++i) axes.m[i][i] = 1;
    return axes;
  }
  if (!constraint.turns || !turned_.made()) return constraint.frame;
  const TurnedSurface::Normals normal = turned_.normals(set.nodes + constraint.first_node, constraint.node_count,
                                                        [&](std::int32_t n) { return displacement(n); });
  Vec3& turned = now_[p].turned;
  const Vec3 off = normal.now - normal.rest - turned;
  if (!now_[p].known)
    turned += off;
  else if (length(off) > kTurned)
    turned += kFollows * off;
  return times_transposed(constraint.frame, TurnedSurface::rotation(normal.rest, unit_or_zero(normal.rest + turned)));
}

// How far the surface has turned beyond the frames, at the state now.
double DeformingBody::off(const ContactConstraints& set) const {
  double most = 0;
  for (std::int32_t p = 0; turned_.made() && p < set.constraint_count; ++p) {
    const ContactConstraint& constraint = set.constraints[p];
    if (!constraint.turns) continue;
    const TurnedSurface::Normals normal = turned_.normals(set.nodes + constraint.first_node, constraint.node_count,
                                                          [&](std::int32_t n) { return displacement(n); });
    most = std::max(most, length(normal.now - unit_or_zero(normal.rest + kept_[p].turned)));
  }
  return most;
}

std::int32_t DeformingBody::add_rows(const ContactConstraints& set, std::int32_t p, std::int32_t count) {
  const ContactConstraint& constraint = set.constraints[p];
  const Mat3 frame = frames_[p] = present_frame(set, p);
  lead_[p] = constraint.joined ? lead_[p - 1] : p;
  if (constraint.joined) return join_row(set, p), count;
  const std::int32_t group = count;
  int axis_of[3] = {}, imposed = 0;
  for (int axis = 0; axis < 3; ++axis) {
    rows_of_[p].at[axis] = -1;
    if (constraint.axes >> axis & 1u) axis_of[imposed++] = axis;
  }
  for (int i = 0; i < imposed; ++i, ++count) {
    LargeRow& row = rows_.list[count];
    row = LargeRow{};
    row.first = constraint.first_node, row.count = constraint.node_count;
    row.group = group;
    for (int d = 0; d < 3; ++d) row.direction[d] = frame.m[axis_of[i]][d];
    for (int k = 0; k < imposed; ++k) row.compliance[k] = constraint.local.m[axis_of[i]][axis_of[k]];
    rows_of_[p].at[axis_of[i]] = count;
  }
  return count;
}

// What constraint p adds to the row of the constraint before it.
void DeformingBody::join_row(const ContactConstraints& set, std::int32_t p) {
  const ContactConstraint& constraint = set.constraints[p];
  const std::int32_t row = rows_of_[lead_[p]].at[0];
  rows_of_[p] = {{-1, -1, -1}};
  const double* const d = frames_[p].m[0];
  rows_.joins[rows_.join_count++] = {row, constraint.first_node, constraint.node_count, 0, {d[0], d[1], d[2]}};
  rows_.list[row].compliance[0] += constraint.local.m[0][0];
}

// m, along the turned frames.
void DeformingBody::take_targets(const ContactConstraints& set) {
  for (std::int32_t p = 0; p < set.constraint_count; ++p) {
    const ContactConstraint& constraint = set.constraints[p];
    if (constraint.joined) {
      if (const std::int32_t row = rows_of_[lead_[p]].at[0]; row >= 0) rows_.list[row].target += set.target[p].x;
      continue;
    }
    const Vec3 target =
        constraint.framed ? frames_[p] * transposed_times(constraint.frame, set.target[p]) : set.target[p];
    for (int i = 0; i < 3; ++i)
      if (const std::int32_t row = rows_of_[p].at[i]; row >= 0) rows_.list[row].target = target[i];
  }
}

// What the mesh does not resolve between discs (disc_compliance.h), in the frames of their constraints, which turn with the surface.
// False where there are no two discs.
bool DeformingBody::fill_beside(const ContactConstraints& set, StepWork* work) {
  const std::int64_t discs = std::count_if(set.constraints, set.constraints + set.constraint_count, has_disc);
  if (discs < 2) return false;
  work->add(kOfTwoDiscs * discs * (discs - 1) / 2);
  const auto stride = 3 * static_cast<std::size_t>(constraint_capacity_);
  for (std::int32_t r = 0; r < rows_.count; ++r)
    std::fill_n(rows_.beside + static_cast<std::size_t>(r) * stride, rows_.count, 0.0);
  for (std::int32_t p = 0; p < set.constraint_count; ++p)
    for (std::int32_t q = 0; q < p; ++q) {
      const Mat3 between = palpate::compliance_between(set.constraints[p], set.constraints[q]);
      const std::int32_t *const rows = rows_of_[lead_[p]].at, *const columns = rows_of_[lead_[q]].at;
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
          if (rows[i] < 0 || columns[j] < 0) continue;
          const auto row = static_cast<std::size_t>(rows[i]), column = static_cast<std::size_t>(columns[j]);
          rows_.beside[row * stride + column] += between.m[i][j];
          rows_.beside[column * stride + row] += between.m[i][j];
        }
    }
  return true;
}

// The forces of the last step.
void DeformingBody::take_start(const ContactConstraints& set) {
  for (std::int32_t p = 0; p < set.constraint_count; ++p)
    for (int i = 0; i < 3; ++i)
      if (const std::int32_t row = rows_of_[p].at[i]; row >= 0) start_[row] = now_[p].force[i];
}

void DeformingBody::keep(const ContactConstraints& set) {
  kept_count_ = set.constraint_count;
  for (std::int32_t p = 0; p < set.constraint_count; ++p)
    for (int i = 0; i < 3; ++i) {
      const std::int32_t row = rows_of_[p].at[i];
      now_[p].force[i] = row >= 0 ? force_[row] : 0;
    }
  std::swap(kept_, now_);
}

// Which rows hold, and where, by the reactions that the laws ask for. A contact that slips with friction is held, too: where these
// reactions bring it in the linear response. Its friction is then found as a force that holds. Were it applied as a load, a part of the body
// that has become softer than at rest would go too far under it, and back again by more in the next step. Held, it goes too little, and
// the next step brings the rest.
void DeformingBody::decide(const ContactConstraints& set, const double* reaction) {
  std::fill(holds_, holds_ + rows_.count, std::uint8_t{1});
  std::fill(slips_, slips_ + rows_.count, std::uint8_t{0});
  for (std::int32_t r = 0; r < rows_.count; ++r) place_[r] = rows_.list[r].target;
  for (std::int32_t p = 0; p < set.constraint_count; ++p) {
    const ContactConstraint& constraint = set.constraints[p];
    if (!may_give_way(constraint)) continue;
    const std::int32_t* const row = rows_of_[p].at;
    const auto of = [&](int i) { return row[i] >= 0 ? reaction[row[i]] : 0.0; };
    const GivesWay gone = gives_way(constraint, {of(0), of(1), of(2)});
    if (gone.released && row[0] >= 0) holds_[row[0]] = 0;
    if (gone.at_limit && row[0] >= 0) slips_[row[0]] = 1, place_[row[0]] = reached(row[0], reaction);
    for (int i = 1; i < 3; ++i) {
      const std::int32_t r = row[i];
      if (r < 0 || !(gone.released || gone.slips)) continue;
      slips_[r] = 1;
      holds_[r] = !gone.released && constraint.friction > 0;
      if (!holds_[r]) continue;
      place_[r] = reached(r, reaction);
    }
  }
}

// m, in the linear response.
double DeformingBody::reached(std::int32_t r, const double* reaction) const {
  const double* const c = solver_.compliance().row(r);
  double place = free_[r];
  for (std::int32_t k = 0; k < rows_.count; ++k) place += c[k] * reaction[k];
  return place;
}

// What the state leaves of the targets for the reactions.
void DeformingBody::find_left() {
  solver_.find_free(free_);
  for (std::int32_t r = 0; r < rows_.count; ++r) laws_.targets()[r] = rows_.list[r].target - free_[r];
}

// Begins a solution of the laws at the state now, from the forces `carried`. Returns by how much these miss the laws, m.
double DeformingBody::begin_laws(const ContactConstraints& set, const double* carried) {
  find_left();
  std::copy(carried, carried + rows_.count, laws_.reactions());
  const ConstraintRows rows = {set.constraints, rows_of_, set.constraint_count};
  laws_.begin(rows);
  const ContactSystem system = laws_.system(rows);
  find_ahead(system, laws_.reactions(), ahead_);
  return law_residual(system, laws_.reactions(), ahead_).displacement;
}

// A row without a scale has its nodes held along it.
void DeformingBody::drop_held_rows(const ContactConstraints& set) {
  for (std::int32_t p = 0; p < set.constraint_count; ++p)
    for (std::int32_t& at : rows_of_[p].at)
      if (at >= 0 && solver_.compliance().scale[at] == 0) at = -1;
}

// m
double DeformingBody::largest_target(const ContactConstraints& set) const {
  double largest = 0;
  for (std::int32_t p = 0; p < set.constraint_count; ++p)
    for (const std::int32_t r : rows_of_[p].at)
      if (r >= 0) largest = std::max(largest, metres_of(set.constraints[p]) * std::fabs(rows_.list[r].target));
  return largest;
}

// m. Rows between two nodes of the body have targets of zero: what rounding leaves of these counts as met.
bool DeformingBody::is_met(double missed, double most) {
  constexpr double kRounding = 1e-9;
  return missed <= most + kRounding;
}

// False where a number is not finite.
bool DeformingBody::solve_laws(const ContactConstraints& set, StepWork* work, Outcome* outcome) {
  const double largest = largest_target(set);
  drop_held_rows(set);
  UnknownNodes nodes;
  // Contacts that move in every step may have taken all of `work`. Without operations of their own the laws would never give such a contact a force.
  StepWork of_laws;
  of_laws.create(of_laws_);
  of_laws.begin();
  const double* carried = start_;
  for (int round = 0;; ++round) {
    outcome->missed = begin_laws(set, carried);
    const bool met = is_met(outcome->missed, kLawMet * largest);
    if (round > 0 && (met || outcome->steps >= most_steps_ || round >= kMostRounds)) break;
    laws_.solve(nodes, &of_laws);
    effort_.sweeps += laws_.effort().sweeps, effort_.newton_steps += laws_.effort().newton_steps;
    decide(set, laws_.reactions());
    if (!solver_.hold(holds_, place_, carried, outcome)) return false;
    solver_.improve(std::max(1, most_steps_ - outcome->steps), outcome);
    carried = solver_.carried();
  }
  work->add(of_laws.done());
  outcome->inexact = !is_met(outcome->missed, kInexact * largest);
  return true;
}

// Makes the reaction of a constraint obey its law: a step ends near its solution, not on it.
void DeformingBody::obey(const ContactConstraint& constraint, std::int32_t p) {
  Vec3& r = reaction_[p];
  const auto is_at_limit = [&](std::int32_t at) { return at >= 0 && slips_[at]; };
  if (constraint.limit > 0 && (is_at_limit(rows_of_[p].at[0]) || std::fabs(r.x) > constraint.limit))
    r.x = std::copysign(constraint.limit, r.x);
  if (!may_release(constraint)) return;
  if (!(r.x > 0)) {
    r = Vec3{};
    return;
  }
  const std::int32_t row = std::max(rows_of_[p].at[1], rows_of_[p].at[2]);
  const bool slips = is_at_limit(row);
  const double across = length({0, r.y, r.z}), most = constraint.friction * r.x;
  if (across > 0 && (slips || across > most)) r.y *= most / across, r.z *= most / across;
}

// The rows of a step, with their targets, and how many steps of the method it may take.
LargeContacts DeformingBody::take_rows(const ContactConstraints& set, StepWork* work) {
  for (std::int32_t e = 0; e < set.node_count; ++e)
    rows_.nodes[e] = set.nodes[e].node, rows_.weights[e] = set.nodes[e].weight;
  rows_.count = rows_.join_count = 0, effort_ = {};
  find_known(set);
  for (std::int32_t p = 0; p < set.constraint_count; ++p) rows_.count = add_rows(set, p, rows_.count);
  take_targets(set);
  take_start(set);
  rows_.has_beside = fill_beside(set, work);
  const Operations fit = work->left() / std::max<Operations>(operations_, 1);
  most_steps_ =
      static_cast<std::int32_t>(std::clamp<Operations>(fit, LargeSolver::kFewestSteps, LargeSolver::kMostSteps));
  LargeContacts contacts = last_rows();
  contacts.start = start_;
  return contacts;
}

DeformingBody::Outcome DeformingBody::solve(const ContactConstraints& set, StepWork* work, Vec3* force) {
  const LargeContacts contacts = take_rows(set, work);
  Outcome outcome;
  laws_decided_ = std::any_of(set.constraints, set.constraints + set.constraint_count,
                              [](const ContactConstraint& constraint) { return palpate::may_give_way(constraint); });
  if (laws_decided_) {
    const bool sound = solver_.take(contacts) && solve_laws(set, work, &outcome);
    solver_.forces(sound, force_, &outcome);
  } else {
    static_cast<LargeOutcome&>(outcome) = solver_.step(contacts, most_steps_, force_);
  }
  write_forces(set, outcome, work, force);
  return outcome;
}

// What the step leaves, and the forces at the contact nodes.
void DeformingBody::write_forces(const ContactConstraints& set, const Outcome& outcome, StepWork* work, Vec3* force) {
  // The forces of a state that is far from its solution say little: no row gets more than it had.
  for (std::int32_t r = 0; outcome.lost && r < rows_.count; ++r)
    force_[r] = std::clamp(force_[r], -std::fabs(start_[r]), std::fabs(start_[r]));
  work->add(operations_ * outcome.evaluations + solve_operations_ * solver_.take_response_solves());
  if (outcome.failed)
    kept_count_ = 0;
  else
    keep(set);
  std::fill(force, force + set.node_count, Vec3{});
  for (std::int32_t p = 0; p < set.constraint_count; ++p) {
    const ContactConstraint& constraint = set.constraints[p];
    reaction_[p] = constraint.joined ? reaction_[lead_[p]] : Vec3{};
    for (int i = 0; i < 3; ++i)
      if (const std::int32_t row = rows_of_[p].at[i]; row >= 0) reaction_[p][i] = force_[row];
    if (!constraint.joined) obey(constraint, p);
    const Vec3 sum = transposed_times(frames_[p], reaction_[p]);
    for (std::int32_t e = constraint.first_node; e < constraint.first_node + constraint.node_count; ++e)
      force[e] += rows_.weights[e] * sum;
  }
}

// ---- several bodies as one -------------------------------------------------------------------------------------------

bool DeformingBody::begin(const ContactConstraints& set, StepWork* work) {
  joint_ = {};
  laws_decided_ = true;
  if (!solver_.take(take_rows(set, work))) return false;
  drop_held_rows(set);
  std::copy(start_, start_ + rows_.count, laws_.reactions());
  joint_.carried = start_;
  return true;
}

void DeformingBody::aim(const ContactConstraints& set) {
  take_targets(set);
  find_left();
}

Vec3 DeformingBody::reached(std::int32_t p) const {
  Vec3 place;
  for (int i = 0; i < 3; ++i)
    if (const std::int32_t row = rows_of_[p].at[i]; row >= 0) place[i] = reached(row, laws_.reactions());
  return place;
}

// A round: the body goes where the reactions bring its rows in the linear response, and on to its balance. It has gone far enough where the
// next reactions would hardly move it.
bool DeformingBody::follow(const ContactConstraints& set, bool* went) {
  *went = false;
  take_targets(set);
  Outcome& outcome = joint_.outcome;
  const double* const reaction = laws_.reactions();
  for (std::int32_t p = 0; p < set.constraint_count; ++p)
    for (int i = 0; i < 3; ++i)
      if (const std::int32_t row = rows_of_[p].at[i]; row >= 0) reaction_[p][i] = reaction[row];
  double missed = 0;
  for (std::int32_t r = 0; r < rows_.count; ++r)
    missed = std::max(missed, std::fabs(reached(r, reaction) - reached(r, joint_.carried)));
  const double largest = largest_target(set);
  outcome.missed = missed, outcome.inexact = !is_met(missed, kInexact * largest);
  if (joint_.rounds > 0 &&
      (is_met(missed, kLawMet * largest) || outcome.steps >= most_steps_ || joint_.rounds >= kMostRounds))
    return true;
  decide(set, reaction);
  if (!solver_.hold(holds_, place_, joint_.carried, &outcome)) return false;
  solver_.improve(std::max(1, most_steps_ - outcome.steps), &outcome);
  joint_.carried = solver_.carried(), ++joint_.rounds;
  *went = true;
  return true;
}

// The reactions act on all bodies alike. Where this body was put back to where the step began, it has the forces that it had there.
DeformingBody::Outcome DeformingBody::end(const ContactConstraints& set, bool sound, StepWork* work, Vec3* force) {
  Outcome& outcome = joint_.outcome;
  solver_.forces(sound, force_, &outcome);
  if (!outcome.failed && !outcome.given_up) std::copy(laws_.reactions(), laws_.reactions() + rows_.count, force_);
  write_forces(set, outcome, work, force);
  return outcome;
}

// ---- what it answers -------------------------------------------------------------------------------------------------

// The rows of the constraint one after the other: S <- S + v v^T / pivot, v the row that is left of the axis by those before.
Mat3 DeformingBody::own_stiffness(std::int32_t p) const {
  Mat3 left, back;  // of C in the frame, and of the identity, as the rows are eliminated
  Mat3 stiffness;
  const auto c = [&](int i, int k) { return solver_.compliance().entry(rows_of_[p].at[i], rows_of_[p].at[k]); };
  const auto held = [&](int i) { return rows_of_[p].at[i] >= 0 && solver_.holds(rows_of_[p].at[i]); };
  for (int i = 0; i < 3; ++i) {
    if (!held(i)) continue;
    back.m[i][i] = 1;
    for (int k = 0; k < 3; ++k) left.m[i][k] = held(k) ? c(i, k) : 0;
    for (int j = 0; j < i; ++j) {
      if (!held(j) || !(left.m[j][j] > 0)) continue;
      const double factor = left.m[i][j] / left.m[j][j];
      for (int k = 0; k < 3; ++k) left.m[i][k] -= factor * left.m[j][k], back.m[i][k] -= factor * back.m[j][k];
    }
    if (!(left.m[i][i] > kShift * c(i, i))) {
      left.m[i][i] = 0;
      continue;
    }
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) stiffness.m[a][b] += back.m[i][a] * back.m[i][b] / left.m[i][i];
  }
  Mat3 axes;
  for (int i = 0; i < 3; ++i) axes.m[i][i] = 1;
  return times_transposed(axes, frames_[p]) * (stiffness * frames_[p]);
}

Mat3 DeformingBody::own_compliance(std::int32_t p) const {
  Mat3 compliance;
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k)
      if (const std::int32_t r = rows_of_[p].at[i], c = rows_of_[p].at[k]; r >= 0 && c >= 0)
        compliance.m[i][k] = solver_.compliance().entry(r, c);
  Mat3 axes;
  for (int i = 0; i < 3; ++i) axes.m[i][i] = 1;
  return times_transposed(axes, frames_[p]) * (compliance * frames_[p]);
}

Mat3 DeformingBody::compliance_between(std::int32_t p, std::int32_t q) const {
  Mat3 between;
  const auto row_of = [&](std::int32_t of) {
    const std::int32_t* const at = rows_of_[lead_[of]].at;
    return at[0] >= 0 ? at[0] : std::max(at[1], at[2]);
  };
  if (row_of(p) < 0 || row_of(q) < 0) return between;
  double numbers[9];
  solver_.response_between(row_of(p), p - lead_[p], row_of(q), q - lead_[q], numbers);
  std::copy(numbers, numbers + 9, between.m[0]);
  return between;
}

void DeformingBody::measure_stiffness(const SystemSolver::MovedAlike* groups, int count, double* stiffness) {
  const int size = 3 * count;
  double* const unit = start_;  // the next solve writes it anew
  const auto axes = [&](std::int32_t p) -> const Mat3& { return frames_[p]; };
  const auto each_row = [&](int c, auto visit) { groups[c / 3].for_each_row(rows_of_, c % 3, axes, visit); };
  for (int c = 0; c < size; ++c) {
    std::fill(unit, unit + rows_.count, 0.0);
    each_row(c, [&](std::int32_t row, double share, double way) { unit[row] = way * share; });
    solver_.solve_held(unit);
    for (int r = 0; r < size; ++r) {
      stiffness[r * size + c] = 0;
      each_row(r, [&](std::int32_t row, double share, double) { stiffness[r * size + c] += share * unit[row]; });
    }
  }
}

Vec3 DeformingBody::missed(std::int32_t p) const {
  Vec3 missed;
  for (int i = 0; i < 3; ++i) {
    const std::int32_t r = rows_of_[p].at[i];
    if (r < 0) continue;
    missed[i] = solver_.on_row(r) - rows_.list[r].target;
    for (std::int32_t k = 0; k < 3 && rows_.list[r].group + k < rows_.count; ++k)
      missed[i] += rows_.list[r].compliance[k] * force_[rows_.list[r].group + k];
    const double* const beside =
        rows_.beside + static_cast<std::size_t>(r) * 3 * static_cast<std::size_t>(constraint_capacity_);
    for (std::int32_t k = 0; rows_.has_beside && k < rows_.count; ++k) missed[i] += beside[k] * force_[k];
  }
  return missed;
}

}  // namespace palpate
