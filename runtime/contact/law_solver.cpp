#include "runtime/contact/law_solver.h"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

constexpr std::int32_t kFirstSweeps = 3;  // before the first Newton step
// Newton's method goes on while one of its next so many steps brings what the laws miss below this share of what they missed before. Where no step
// does, the method wanders among states of sticking and slipping, which a few sweeps find sooner.
constexpr int kPatience = 4;
constexpr double kHelps = 0.5;
constexpr std::int32_t kMostSweepsAtOnce = 1 << 20;
constexpr std::int32_t kSweepsAgain = 10;  // where Newton's direction does not help; half as many more each time

// Two sweeps that change the reactions alike, up to this share, are a drift: one contact hands its force to another that holds
// the same place a little deeper, by the same amount in each sweep.
constexpr double kDrift = 0.02;

// After the last sweep or step of Newton's method the reactions are made to obey the laws, and then measured.
constexpr std::int64_t kLooksAtTheEnd = 3;

// Rounding of sums of work.
constexpr double kNoise = 1e-9;

// Makes the reactions obey the laws exactly: Newton's method ends within rounding of them.
void obey(const ContactSystem& system, const double* ahead, double* reaction) {
  for (std::int32_t p = 0; p < system.constraint_count; ++p) {
    const ContactConstraint& constraint = system.constraints[p];
    const Mat3 own = own_compliance(system, p);
    const Vec3 r = gather(system, reaction, p), w = gather(system, ahead, p), limits = most_of(system, p);
    Vec3 now;
    if (constraint.law == ContactLaw::sticking || constraint.law == ContactLaw::sliding) {
      now = r;
    } else if (r.x > 0 && r.x * own.m[0][0] > w.x) {
      const double compliance = std::max(own.m[1][1], own.m[2][2]), most = constraint.friction * r.x;
      const Vec3 to = {0, r.y - w.y / compliance, r.z - w.z / compliance};
      const double size = length(to), held = length({0, r.y, r.z});
      now = r;
      if (size > most)
        now = (most / size) * to, now.x = r.x;
      else if (held > most)
        now.y *= most / held, now.z *= most / held;
    }
    now = within_limits(constraint, now, limits);
    for (int i = 0; i < 3; ++i)
      if (const std::int32_t row = system.rows[p].at[i]; row >= 0) reaction[row] = now[i];
  }
}

// Forces that obey the laws do no more work on the tissue than their targets allow: r^T (A r - d) <= 0 with A the matrix and its
// soft part, because a contact does no work where it is released or held and loses work where it slips. Forces that break this
// are made smaller, all by one factor; they then still obey friction and never pull. So no force exceeds the bound of
// ContactSolver, however far from the laws the reactions may be. Returns the factor.
double limit_work(const ContactSystem& system, const double* ahead, double* reaction) {
  double excess = 0, offered = 0;
  for (std::int32_t p = 0; p < system.constraint_count; ++p)
    for (const std::int32_t row : system.rows[p].at)
      if (row >= 0) excess += reaction[row] * ahead[row], offered += reaction[row] * system.target[row];
  if (!(excess > kNoise * std::fabs(offered))) return 1;
  const double factor = std::max(0.0, offered / (offered + excess));
  for (std::int32_t row = 0; row < system.rows_end; ++row) reaction[row] *= factor;
  return factor;
}

}  // namespace

bool LawSolver::create(SceneMemory& memory, std::int32_t rows, std::int32_t contact_nodes) {
  const std::size_t all = static_cast<std::size_t>(rows);
  own_ = memory.array<Mat3>(all);
  ahead_ = memory.array<double>(all);
  best_ = memory.array<double>(all);
  before_ = memory.array<double>(all);
  change_ = memory.array<double>(2 * all);
  shifted_ = memory.array<double>(all);
  earlier_ = memory.array<double>(all);
  return newton_.create(memory, rows, contact_nodes) && !memory.failed();
}

ContactSystem LawSolver::with_own_compliances(const ContactSystem& system) {
  find_own_compliances(system, own_);
  ContactSystem with = system;
  with.own = own_;
  return with;
}

// A drift goes on until a contact has given its whole force away: goes there at once. False where there is no drift.
bool LawSolver::extrapolate(const ContactSystem& system, double* reaction) const {
  const double *const now = change_, *const earlier = change_ + system.rows_end;
  double most = 0, differs = 0;
  for (std::int32_t p = 0; p < system.constraint_count; ++p) {
    const Mat3 own = own_compliance(system, p);
    for (int i = 0; i < 3; ++i) {
      const std::int32_t row = system.rows[p].at[i];
      if (row < 0) continue;
      most = std::max(most, std::fabs(now[row]) * own.m[i][i]);
      differs = std::max(differs, std::fabs(now[row] - earlier[row]) * own.m[i][i]);
    }
  }
  if (!(differs <= kDrift * most)) return false;
  double sweeps = INFINITY;
  for (std::int32_t p = 0; p < system.constraint_count; ++p) {
    const ContactLaw law = system.constraints[p].law;
    const std::int32_t row = system.rows[p].at[0];
    if (row < 0 || law == ContactLaw::sticking || law == ContactLaw::sliding) continue;
    const double own = system.matrix[static_cast<std::size_t>(row) * system.stride + row] + system.soft[row];
    if (now[row] * own < -1e-3 * most) sweeps = std::min(sweeps, reaction[row] / -now[row]);
  }
  if (!(sweeps > 1 && std::isfinite(sweeps))) return false;
  for (std::int32_t i = 0; i < system.rows_end; ++i) reaction[i] += sweeps * now[i];
  return true;
}

void LawSolver::sweep_for_a_while(const ContactSystem& system, std::int32_t sweeps, double tolerance,
                                  double* reaction) {
  const std::int32_t rows = system.rows_end;
  const std::int64_t cost = operations_of_sweep(system);
  bool has_earlier = false;
  for (std::int32_t sweep = 0; sweep < sweeps && (may_sweep(system) || effort_.sweeps == 0); ++sweep) {
    std::copy(reaction, reaction + rows, before_);
    std::copy(change_, change_ + rows, change_ + rows);
    const double change = sweep_contacts(system, reaction);
    left_ -= cost;
    ++effort_.sweeps;
    if (change <= tolerance) return;
    for (std::int32_t i = 0; i < rows; ++i) change_[i] = reaction[i] - before_[i];
    // The last sweep stands, so that the reactions obey the laws.
    has_earlier = has_earlier && sweep + 1 < sweeps && may_sweep(system) ? !extrapolate(system, reaction) : true;
  }
}

// `ahead` for all rows, and the residual.
std::int64_t LawSolver::operations_to_look(const ContactSystem& system) {
  return operations_of_product(system) + 200 * std::int64_t{system.constraint_count};
}

std::int64_t LawSolver::fewest_operations(const ContactSystem& system) {
  return operations_of_sweep(system) + (2 + kLooksAtTheEnd) * operations_to_look(system);
}

// A sweep, and the look that follows it.
bool LawSolver::may_sweep(const ContactSystem& system) const {
  return left_ >= operations_of_sweep(system) + operations_to_look(system);
}

void LawSolver::keep_best(const ContactSystem& system, double residual, const double* reaction) {
  if (!(residual < best_residual_)) return;
  best_residual_ = residual;
  std::copy(reaction, reaction + system.rows_end, best_);
}

// Newton's method alone, as long as it helps. True where the laws are met.
bool LawSolver::improve(const ContactSystem& system, double tolerance, double* reaction) {
  find_ahead(system, reaction, ahead_);
  left_ -= operations_to_look(system);
  newton_.begin();
  double reached = INFINITY;
  for (int since = 0;; ++since) {
    const double residual = law_residual(system, reaction, ahead_).displacement;
    keep_best(system, residual, reaction);
    if (residual <= tolerance) return true;
    if (residual < kHelps * reached) reached = residual, since = 0;
    if (since == kPatience) return false;
    if (!newton_.step(system, reaction, ahead_, &left_)) return false;
    ++effort_.newton_steps;
  }
}

double LawSolver::solve(const ContactSystem& from, double tolerance, std::int64_t most_operations, double* reaction,
                        double most_energy) {
  const ContactSystem system = with_own_compliances(from);
  effort_ = {};
  if (most_operations < fewest_operations(system)) return hold(system, most_energy, reaction);
  most_operations = std::min(most_operations, kMostOperations);
  left_ = most_operations - kLooksAtTheEnd * operations_to_look(system) - operations_to_look(system);
  newton_.forget();
  find_ahead(system, reaction, ahead_);
  limit_work(system, ahead_, reaction);
  sweep_for_a_while(system, kFirstSweeps, tolerance, reaction);
  return finish(system, tolerance, most_operations, reaction);
}

double LawSolver::solve_without_shift(const ContactSystem& system, double tolerance, double met, int most_solves,
                                      std::int64_t most_operations, double* reaction, double* coarse,
                                      double most_energy) {
  const std::int32_t rows = system.rows_end;
  std::fill(coarse, coarse + rows, 0.0);
  const double first = solve(system, tolerance, most_operations, reaction, most_energy);
  LawEffort effort = effort_;
  double missed = first;
  ContactSystem shifted = system;
  shifted.target = shifted_;
  for (int solved = 1; solved < most_solves && missed <= met; ++solved) {
    double moved = 0;
    for (std::int32_t i = 0; i < rows; ++i)
      moved = std::max(moved, system.soft[i] * std::fabs(reaction[i] - coarse[i]));
    const std::int64_t left = most_operations - effort.operations;
    if (moved <= tolerance || left < fewest_operations(system)) break;
    for (std::int32_t i = 0; i < rows; ++i) {
      shifted_[i] = system.target[i] + system.soft[i] * reaction[i];
      earlier_[i] = coarse[i], coarse[i] = reaction[i];
    }
    missed = solve_again(shifted, tolerance, left, reaction);
    effort.sweeps += effort_.sweeps, effort.newton_steps += effort_.newton_steps;
    effort.operations += effort_.operations;
    if (missed <= met) continue;
    // Not solved within the limit: the coarser solution stands.
    std::copy(coarse, coarse + rows, reaction);
    std::copy(earlier_, earlier_ + rows, coarse);
  }
  effort_ = effort;
  return first;
}

// For targets that differ little from those of the last solve(), from whose reactions it goes on.
double LawSolver::solve_again(const ContactSystem& from, double tolerance, std::int64_t most_operations,
                              double* reaction) {
  const ContactSystem system = with_own_compliances(from);
  effort_ = {};
  most_operations = std::min(most_operations, kMostOperations);
  left_ = most_operations - kLooksAtTheEnd * operations_to_look(system);
  return finish(system, tolerance, most_operations, reaction);
}

// Makes the reactions push, stay within friction and limits, and do no more work than they may. The limit of the energy is for contacts
// that contradict and cancel one another: where one of them has gone, nothing balances the others, which would throw the surface.
double LawSolver::hold(const ContactSystem& system, double most_energy, double* reaction) {
  for (std::int32_t p = 0; p < system.constraint_count; ++p) {
    const ContactConstraint& constraint = system.constraints[p];
    if (!may_give_way(constraint)) continue;
    Vec3 r = gather(system, reaction, p);
    if (constraint.law != ContactLaw::sticking) r.x = std::max(0.0, r.x);
    if (constraint.law == ContactLaw::unilateral) r.y = r.z = 0;
    const double held = length({0, r.y, r.z}), most = constraint.friction * r.x;
    if (constraint.law == ContactLaw::coulomb && held > most) r.y *= most / held, r.z *= most / held;
    r = within_limits(constraint, r, most_of(system, p));
    for (int i = 0; i < 3; ++i)
      if (const std::int32_t row = system.rows[p].at[i]; row >= 0) reaction[row] = r[i];
  }
  find_ahead(system, reaction, ahead_);
  double factor = limit_work(system, ahead_, reaction), energy = 0;
  for (std::int32_t row = 0; row < system.rows_end; ++row)
    energy += factor * reaction[row] * (ahead_[row] + system.target[row]);
  if (energy > most_energy) {
    const double within = std::sqrt(std::max(0.0, most_energy) / energy);
    for (std::int32_t row = 0; row < system.rows_end; ++row) reaction[row] *= within;
    factor *= within;
  }
  for (std::int32_t row = 0; row < system.rows_end && factor < 1; ++row)
    ahead_[row] = factor * (ahead_[row] + system.target[row]) - system.target[row];
  effort_.operations = operations_to_look(system);
  return law_residual(system, reaction, ahead_).displacement;
}

double LawSolver::finish(const ContactSystem& system, double tolerance, std::int64_t most_operations,
                         double* reaction) {
  best_residual_ = INFINITY;
  std::copy(reaction, reaction + system.rows_end, best_);
  std::int32_t sweeps = kSweepsAgain;
  while (!improve(system, tolerance, reaction) && may_sweep(system)) {
    sweep_for_a_while(system, sweeps, tolerance, reaction);
    sweeps = std::min(sweeps + sweeps / 2, kMostSweepsAtOnce);
  }
  std::copy(best_, best_ + system.rows_end, reaction);
  find_ahead(system, reaction, ahead_);
  obey(system, ahead_, reaction);
  find_ahead(system, reaction, ahead_);
  if (limit_work(system, ahead_, reaction) < 1) find_ahead(system, reaction, ahead_);
  effort_.operations = most_operations - left_;
  return law_residual(system, reaction, ahead_).displacement;
}

double LawSolver::sweep(const ContactSystem& from, double tolerance, std::int64_t most_operations, double* reaction) {
  const ContactSystem system = with_own_compliances(from);
  effort_ = {};
  left_ = most_operations;
  double change = INFINITY;
  while (change > tolerance && (may_sweep(system) || effort_.sweeps == 0)) {
    change = sweep_contacts(system, reaction);
    left_ -= operations_of_sweep(system);
    ++effort_.sweeps;
  }
  find_ahead(system, reaction, ahead_);
  effort_.operations = most_operations - left_ + operations_to_look(system);
  return law_residual(system, reaction, ahead_).displacement;
}

}  // namespace palpate
