#include "runtime/contact/motions.h"

#include <algorithm>
#include <cmath>

#include "runtime/base/error_text.h"

namespace palpate {
namespace {

// A held volume counts as met where its pressure would change by what moves no node farther than this, or by this share.
constexpr double kLeastMove = 1e-9, kMet = 1e-7;  // m; 1
// After the last solve the step is not trusted where the pressure would still move a node farther than this and this share.
constexpr double kFarOff = 1e-5, kOff = 1e-4;  // m; 1
// Farther no node may be moved.
constexpr double kFarthest = 1e6;  // m

}  // namespace

bool Motions::create(SceneMemory& memory, const Source& source, std::int32_t constraint_capacity) {
  source_ = source;
  acting_.target = memory.array<Vec3>(static_cast<std::size_t>(constraint_capacity));
  const auto motions = static_cast<std::size_t>(count());
  for (double** const array : {&longest_, &step_, &last_now_, &last_by_}) *array = memory.array<double>(motions);
  for (double** const array : {&wanted_, &now_, &begun_, &before_, &held_}) {
    *array = memory.array<double>(motions);
    memory.keep_array(*array, motions);
  }
  holds_ = memory.array<std::int32_t>(motions), state_ = memory.array<palpate_motion_state>(motions);
  memory.keep_array(holds_, motions), memory.keep_array(state_, motions);
  memory.keep(first_), memory.keep(pumps_);
  if (memory.failed()) return false;
  for (std::int32_t m = 0; m < count(); ++m) {
    double most = 0;
    for (std::int32_t n = 0; n < rows().nodes; ++n) most = std::max(most, dot(rows().at(m, n), rows().at(m, n)));
    longest_[m] = std::sqrt(most) * (1 + 1e-12);
  }
  source_.surface.longest = longest_;
  return true;
}

void Motions::forget() {
  for (double* const array : {now_, begun_, before_}) std::fill_n(array, count(), 0.0);
  std::fill_n(state_, count(), palpate_motion_state{});
  first_ = 1;
}

// ---- what the host gives ---------------------------------------------------------------------------------------------

palpate_status Motions::set(const double* amounts, std::int32_t given, palpate_error* error) {
  if (given != count() || !amounts)
    return fail(error, PALPATE_ERROR_ARGUMENT, 0,
                "palpate_scene_set_motions: expected an amount for each of the %d motions, found %d amounts",
                static_cast<int>(count()), amounts ? static_cast<int>(given) : 0);
  double farthest = 0;
  for (std::int32_t m = 0; m < count(); ++m) farthest += std::fabs(amounts[m]) * longest_[m];
  const bool finite = std::all_of(amounts, amounts + count(), [](double q) { return std::isfinite(q); });
  if (!finite || !(farthest <= kFarthest))
    return fail(
        error, PALPATE_ERROR_ARGUMENT, 0,
        "palpate_scene_set_motions: expected finite amounts that move no node by more than 1e6 m, found others; "
        "the scene keeps its amounts");
  std::copy_n(amounts, count(), wanted_);
  return succeed(error);
}

palpate_status Motions::hold_volume(std::int32_t motion, bool holds, double volume, palpate_error* error) {
  const auto bad = [&](const char* expected) {
    return fail(error, PALPATE_ERROR_ARGUMENT, 0, "palpate_scene_hold_volume: expected %s; motion %d was asked for",
                expected, static_cast<int>(motion));
  };
  if (motion < 0 || motion >= count()) return bad("one of the bundle's motions");
  if (static_cast<formats::MotionKind>(source_.kind[motion]) != formats::MotionKind::pressure)
    return bad("a motion of kind PRESSURE, whose surface sweeps a volume");
  const double own = source_.volume[static_cast<std::size_t>(motion) * static_cast<std::size_t>(count()) +
                                    static_cast<std::size_t>(motion)];
  if (holds && !(own > 0 && std::fabs(volume) / own * longest_[motion] <= kFarthest))
    return bad("a finite volume whose pressure moves no node by more than 1e6 m");
  // The pressure goes on from where it is.
  if (!holds && holds_[motion]) wanted_[motion] = now_[motion];
  pumps_ += (holds ? 1 : 0) - holds_[motion];
  holds_[motion] = holds, held_[motion] = holds ? volume : 0;
  return succeed(error);
}

// ---- a step ----------------------------------------------------------------------------------------------------------

// from: nullptr for zeros.
double Motions::length_of(const double* amounts, const double* from) const {
  double sum = 0;
  for (std::int32_t m = 0; m < count(); ++m) sum += std::fabs(amounts[m] - (from ? from[m] : 0)) * longest_[m];
  return sum;
}

void Motions::take_all() {
  for (std::int32_t m = 0; m < count(); ++m)
    if (!holds_[m]) now_[m] = wanted_[m];
  double by[kMost];
  for (std::int32_t m = 0; m < count(); ++m) by[m] = volume_of(m, {}, nullptr);
  if (pumps_ > 0 && solve_pumps(by))
    for (std::int32_t m = 0; m < count(); ++m)
      if (holds_[m]) now_[m] += by[m];
}

std::uint32_t Motions::begin(double most) {
  std::copy_n(begun_, count(), before_);
  std::copy_n(now_, count(), begun_);  // to measure the way
  double moved = 0;
  for (std::int32_t m = 0; m < count(); ++m)
    if (!holds_[m]) moved += std::fabs(wanted_[m] - now_[m]) * longest_[m];
  const double share = moved > most && !first_ ? most / moved : 1;
  if (first_) take_all();
  for (std::int32_t m = 0; m < count(); ++m)
    if (!holds_[m]) now_[m] = share == 1 ? wanted_[m] : now_[m] + share * (wanted_[m] - now_[m]);
  stepped_ = length_of(now_, begun_);
  for (std::int32_t m = 0; m < count(); ++m) step_[m] = now_[m] - begun_[m];
  std::copy_n(now_, count(), begun_);
  // No place was before the first step.
  if (first_) std::copy_n(now_, count(), before_);
  most_ = first_ ? INFINITY : share == 1 ? most - moved : 0;
  first_ = 0;
  return share == 1 ? 0 : PALPATE_STEP_MOTION_LIMITED;
}

const ContactConstraints& Motions::acting(const ContactConstraints& set) {
  Vec3* const target = acting_.target;
  acting_ = set;
  acting_.target = target;
  for (std::int32_t p = 0; p < set.constraint_count; ++p) {
    const ContactConstraint& constraint = set.constraints[p];
    Vec3 moved;
    for (std::int32_t e = constraint.first_node; e < constraint.first_node + constraint.node_count; ++e)
      moved += set.nodes[e].weight * now(set.nodes[e].node);
    target[p] = set.target[p] - (constraint.framed ? constraint.frame * moved : moved);
  }
  return acting_;
}

// m^3, what the surface of a pressure has swept.
double Motions::volume_of(std::int32_t motion, const ContactConstraints& set, const Vec3* force) const {
  if (static_cast<formats::MotionKind>(source_.kind[motion]) != formats::MotionKind::pressure) return 0;
  double sum = 0;
  for (std::int32_t m = 0; m < count(); ++m)
    sum += source_.volume[static_cast<std::size_t>(motion) * static_cast<std::size_t>(count()) +
                          static_cast<std::size_t>(m)] *
           now_[m];
  for (std::int32_t e = 0; e < set.node_count; ++e) sum += dot(rows().at(motion, set.nodes[e].node), force[e]);
  return sum;
}

// by: [count] m^3 that are swept; in their places comes by how much the held pressures are to change, Pa. The part of V that belongs to
// them is symmetric and positive definite. False where the bundle's numbers do not make it so.
bool Motions::solve_pumps(double* by) const {
  double factor[kMost][kMost];
  std::int32_t at[kMost], held = 0;
  for (std::int32_t m = 0; m < count(); ++m)
    if (holds_[m]) at[held++] = m;
  const auto entry = [&](std::int32_t i, std::int32_t j) {
    return source_
        .volume[static_cast<std::size_t>(at[i]) * static_cast<std::size_t>(count()) + static_cast<std::size_t>(at[j])];
  };
  for (std::int32_t i = 0; i < held; ++i)
    for (std::int32_t j = 0; j <= i; ++j) {
      double sum = 0.5 * (entry(i, j) + entry(j, i));
      for (std::int32_t k = 0; k < j; ++k) sum -= factor[i][k] * factor[j][k];
      if (i == j && !(sum > 0)) return false;
      factor[i][j] = i == j ? std::sqrt(sum) : sum / factor[j][j];
    }
  double x[kMost];
  for (std::int32_t i = 0; i < held; ++i) {
    x[i] = held_[at[i]] - by[at[i]];
    for (std::int32_t k = 0; k < i; ++k) x[i] -= factor[i][k] * x[k];
    x[i] /= factor[i][i];
  }
  for (std::int32_t i = held; i-- > 0;) {
    for (std::int32_t k = i + 1; k < held; ++k) x[i] -= factor[k][i] * x[k];
    x[i] /= factor[i][i];
  }
  std::fill_n(by, count(), 0.0);
  for (std::int32_t i = 0; i < held; ++i) by[at[i]] = x[i];
  return true;
}

// q <- q + V^-1 (v - V q - B^T f), which alone converges slowly where contacts hold the surface; so from the second solve on it goes
// along the line between the last two (Anderson's method of depth one, for a single volume the secant): contacts that stick then are
// met in the third solve.
bool Motions::follow_volumes(const ContactConstraints& set, const Vec3* force, int solve, std::uint32_t* flags) {
  if (pumps_ == 0) return false;
  double by[kMost];
  for (std::int32_t m = 0; m < count(); ++m) by[m] = holds_[m] ? volume_of(m, set, force) : 0;
  if (!solve_pumps(by)) return false;
  double moves = 0, size = 0;
  for (std::int32_t m = 0; m < count(); ++m)
    moves += std::fabs(by[m]) * longest_[m], size += std::fabs(now_[m]) * longest_[m];
  if (!(moves > kLeastMove + kMet * size) || !std::isfinite(moves)) return false;
  if (solve + 1 >= kMostSolves) {
    if (moves > kFarOff + kOff * size) *flags |= PALPATE_STEP_SOLVE_INEXACT;
    return false;
  }
  double next[kMost], along = 0, squared = 0;
  for (std::int32_t m = 0; m < count(); ++m) {
    next[m] = now_[m] + by[m];
    const double turned = (by[m] - last_by_[m]) * longest_[m];
    along += by[m] * longest_[m] * turned, squared += turned * turned;
  }
  if (solve > 0 && squared > 0)
    for (std::int32_t m = 0; m < count(); ++m)
      next[m] -= along / squared * (now_[m] + by[m] - last_now_[m] - last_by_[m]);
  std::copy_n(now_, count(), last_now_), std::copy_n(by, count(), last_by_);
  double moved = 0;
  for (std::int32_t m = 0; m < count(); ++m)
    if (holds_[m]) moved += std::fabs(next[m] - begun_[m]) * longest_[m];
  const double share = moved > most_ ? most_ / moved : 1;
  for (std::int32_t m = 0; m < count(); ++m)
    if (holds_[m]) now_[m] = share == 1 ? next[m] : begun_[m] + share * (next[m] - begun_[m]);
  if (share != 1) *flags |= PALPATE_STEP_MOTION_LIMITED;
  return true;
}

void Motions::end(const ContactConstraints& set, const Vec3* force) {
  for (std::int32_t m = 0; m < count(); ++m) state_[m] = {now_[m], volume_of(m, set, force)};
}

}  // namespace palpate
