#include "runtime/motions/motions.h"

#include <algorithm>
#include <cmath>

#include "runtime/base/error_text.h"
#include "runtime/contact/touch_step.h"
#include "runtime/include/palpate/palpate_motions.h"

namespace palpate {
namespace {

// A held volume counts as met where its pressure would change by what moves no node farther than this, or by this share.
constexpr double kLeastMove = 1e-9, kMet = 1e-7;  // m; 1
// After the last solve the step is not trusted where the pressure would still move a node farther than this and this share.
constexpr double kFarOff = 1e-5, kOff = 1e-4;  // m; 1
// Farther no node may be moved.
constexpr double kFarthest = 1e6;  // m
constexpr std::int32_t kMost = formats::kMostMotions;

}  // namespace

bool Motions::create(SceneMemory& memory, const Source& source) {
  source_ = source;
  const auto motions = static_cast<std::size_t>(count());
  for (double** const array : {&last_now_, &last_by_}) *array = memory.array<double>(motions);
  for (double** const array : {&wanted_, &held_}) {
    *array = memory.array<double>(motions);
    memory.keep_array(*array, motions);
  }
  holds_ = memory.array<std::int32_t>(motions), state_ = memory.array<palpate_motion_state>(motions);
  memory.keep_array(holds_, motions), memory.keep_array(state_, motions);
  memory.keep(first_), memory.keep(pumps_);
  return !memory.failed();
}

void Motions::forget_rest() {
  source_.offset->forget();
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
  for (std::int32_t m = 0; m < count(); ++m) farthest += std::fabs(amounts[m]) * rows().longest[m];
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
  if (holds && !(own > 0 && std::fabs(volume) / own * rows().longest[motion] <= kFarthest))
    return bad("a finite volume whose pressure moves no node by more than 1e6 m");
  // The pressure goes on from where it is.
  if (!holds && holds_[motion]) wanted_[motion] = source_.offset->amounts()[motion];
  pumps_ += (holds ? 1 : 0) - holds_[motion];
  holds_[motion] = holds, held_[motion] = holds ? volume : 0;
  return succeed(error);
}

// ---- a step ----------------------------------------------------------------------------------------------------------

void Motions::take_all() {
  double* const now = source_.offset->amounts();
  for (std::int32_t m = 0; m < count(); ++m)
    if (!holds_[m]) now[m] = wanted_[m];
  double by[kMost];
  for (std::int32_t m = 0; m < count(); ++m) by[m] = volume_of(m, {}, nullptr);
  if (pumps_ > 0 && solve_pumps(by))
    for (std::int32_t m = 0; m < count(); ++m)
      if (holds_[m]) now[m] += by[m];
}

// most: m, that a node may move. Returns step flags.
std::uint32_t Motions::take(double most) {
  Offset& offset = *source_.offset;
  double* const now = offset.amounts();
  offset.end_last_step();
  double moved = 0;
  for (std::int32_t m = 0; m < count(); ++m)
    if (!holds_[m]) moved += std::fabs(wanted_[m] - now[m]) * rows().longest[m];
  const double share = moved > most && !first_ ? most / moved : 1;
  if (first_) take_all();
  for (std::int32_t m = 0; m < count(); ++m)
    if (!holds_[m]) now[m] = share == 1 ? wanted_[m] : now[m] + share * (wanted_[m] - now[m]);
  offset.begin_step(first_ != 0);
  most_ = first_ ? INFINITY : share == 1 ? most - moved : 0;
  first_ = followed_ = 0;
  return share == 1 ? 0 : PALPATE_STEP_MOTION_LIMITED;
}

void Motions::begin_step(TouchStep& step) {
  TouchState& state = *step.state;
  step.flags |= take(step.context->def.max_tool_speed * state.input.dt());
  if (state.field.has_offset()) state.field.begin_moved();
  step.context->watch.ended(source_.pass);
}

// m^3, what the surface of a pressure has swept.
double Motions::volume_of(std::int32_t motion, const ContactConstraints& set, const Vec3* force) const {
  if (static_cast<formats::MotionKind>(source_.kind[motion]) != formats::MotionKind::pressure) return 0;
  double sum = 0;
  for (std::int32_t m = 0; m < count(); ++m)
    sum += source_.volume[static_cast<std::size_t>(motion) * static_cast<std::size_t>(count()) +
                          static_cast<std::size_t>(m)] *
           source_.offset->amounts()[m];
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

// by: [count] Pa, by how much the held pressures are to change. Returns how far that moves a node at most, m; zero where nothing is to change
// or the numbers are not finite. size: m, how far the amounts now move one.
double Motions::find_change(const ContactConstraints& set, const Vec3* force, double* by, double* size) const {
  *size = 0;
  if (pumps_ == 0) return 0;
  for (std::int32_t m = 0; m < count(); ++m) by[m] = holds_[m] ? volume_of(m, set, force) : 0;
  if (!solve_pumps(by)) return 0;
  double moves = 0;
  for (std::int32_t m = 0; m < count(); ++m)
    moves += std::fabs(by[m]) * rows().longest[m], *size += std::fabs(source_.offset->amounts()[m]) * rows().longest[m];
  return std::isfinite(moves) ? moves : 0;
}

// q <- q + V^-1 (v - V q - B^T f), which alone converges slowly where contacts hold the surface; so from the second time on it goes
// along the line between the last two (Anderson's method of depth one, for a single volume the secant): contacts that stick then are
// met in the third solve.
bool Motions::follow(TouchStep& step, bool has_room) {
  if (!has_room) return pumps_ > 0;
  double *const now = source_.offset->amounts(), by[kMost], size = 0;
  const double moves = find_change(step.state->rows.set(), step.state->force, by, &size);
  if (!(moves > kLeastMove + kMet * size)) return false;
  const double* const longest = rows().longest;
  double next[kMost], along = 0, squared = 0;
  for (std::int32_t m = 0; m < count(); ++m) {
    next[m] = now[m] + by[m];
    const double turned = (by[m] - last_by_[m]) * longest[m];
    along += by[m] * longest[m] * turned, squared += turned * turned;
  }
  if (followed_ > 0 && squared > 0)
    for (std::int32_t m = 0; m < count(); ++m)
      next[m] -= along / squared * (now[m] + by[m] - last_now_[m] - last_by_[m]);
  std::copy_n(now, count(), last_now_), std::copy_n(by, count(), last_by_);
  ++followed_;
  const double* const begun = source_.offset->begun_amounts();
  double moved = 0;
  for (std::int32_t m = 0; m < count(); ++m)
    if (holds_[m]) moved += std::fabs(next[m] - begun[m]) * longest[m];
  const double share = moved > most_ ? most_ / moved : 1;
  for (std::int32_t m = 0; m < count(); ++m)
    if (holds_[m]) now[m] = share == 1 ? next[m] : begun[m] + share * (next[m] - begun[m]);
  if (share != 1) step.flags |= PALPATE_STEP_MOTION_LIMITED;
  return true;
}

bool Motions::is_far_off(const ContactConstraints& set, const Vec3* force) const {
  double by[kMost], size = 0;
  return find_change(set, force, by, &size) > kFarOff + kOff * size;
}

void Motions::take_reactions(TouchStep& step, bool solved) {
  const ContactConstraints& set = step.state->rows.set();
  const Vec3* const force = step.state->force;
  if (solved && is_far_off(set, force)) step.flags |= PALPATE_STEP_SOLVE_INEXACT;
  for (std::int32_t m = 0; m < count(); ++m) state_[m] = {source_.offset->amounts()[m], volume_of(m, set, force)};
}

}  // namespace palpate
