#include "runtime/motions/motions.h"

#include <algorithm>
#include <cmath>

#include "runtime/base/error_text.h"
#include "runtime/contact/touch_step.h"
#include "runtime/include/palpate/palpate_motions.h"

namespace palpate {
namespace {

// Farther no node may be moved.
constexpr double kFarthest = 1e6;  // m
constexpr std::int32_t kMost = formats::kMostMotions;
static_assert(kMost <= kMostOffsetRows);

palpate_status refuse_pressure(std::int32_t motion, const char* function, palpate_error* error) {
  return fail(
      error, PALPATE_ERROR_ARGUMENT, 0,
      "%s: pressure %d needs motion/pressed under large deformation, where it acts on a surface that turns and grows, "
      "and the bundle does not have it; make the bundle again, give the pressure the amount 0, or take deformation "
      "LINEAR",
      function, static_cast<int>(motion));
}

}  // namespace

bool Motions::create(SceneMemory& memory, const Source& source) {
  source_ = source;
  const auto motions = static_cast<std::size_t>(count());
  for (double** const array : {&wanted_, &held_}) {
    *array = memory.array<double>(motions);
    memory.keep_array(*array, motions);
  }
  holds_ = memory.array<std::int32_t>(motions), state_ = memory.array<palpate_motion_state>(motions);
  memory.keep_array(holds_, motions), memory.keep_array(state_, motions);
  memory.keep(first_), memory.keep(changed_);
  return !memory.failed();
}

void Motions::forget_rest() {
  std::fill_n(state_, count(), palpate_motion_state{});
  first_ = 1;
}

// ---- what the host gives ---------------------------------------------------------------------------------------------

palpate_status Motions::set(const double* amounts, std::int32_t given, palpate_error* error) {
  if (given != count() || !amounts)
    return fail(error, PALPATE_ERROR_ARGUMENT, 0,
                "palpate_scene_set_motions: expected an amount for each of the %d motions, found %d amounts",
                static_cast<int>(count()), amounts ? static_cast<int>(given) : 0);
  for (std::int32_t m = 0; m < count(); ++m)
    if (is_told(m) && !source_.has_surfaces && amounts[m] != 0)
      return refuse_pressure(m, "palpate_scene_set_motions", error);
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
  if (is_told(motion) && !source_.has_surfaces) return refuse_pressure(motion, "palpate_scene_hold_volume", error);
  if (!is_pressure(motion)) return bad("a motion of kind PRESSURE, whose surface sweeps a volume");
  if (!source_.is_whole) return bad("a scene with cut OFF, since a held volume does not follow a cut");
  const double own = source_.volume[static_cast<std::size_t>(motion) * static_cast<std::size_t>(count()) +
                                    static_cast<std::size_t>(motion)];
  if (holds && !(own > 0 && std::fabs(volume) / own * rows().longest[motion] <= kFarthest))
    return bad("a finite volume whose pressure moves no node by more than 1e6 m");
  const std::int32_t before = holds_[motion];
  double factor[kMost * kMost];
  holds_[motion] = holds;
  if (!OffsetFollowers::factorise(count(), holds_, source_.volume, factor)) {
    holds_[motion] = before;
    return bad("a motion whose volume does not follow from those that are held");
  }
  // The pressure goes on from where it is.
  if (!holds && before)
    wanted_[motion] = is_told(motion) ? state_[motion].amount : source_.offset->whole_amount(motion);
  if (holds_[motion] != before) changed_ = 1;
  held_[motion] = holds ? volume : 0;
  return succeed(error);
}

// ---- a step ----------------------------------------------------------------------------------------------------------

// to: [count]. All amounts that follow the contacts' forces, or all others, go there, by no more than moves a node *most, m, which becomes what
// is left of that; but the first step takes them all. Returns whether they have come there.
bool Motions::go_to(const double* to, bool followers, double* most) {
  double* const now = source_.offset->amounts();
  double moved = 0;
  for (std::int32_t m = 0; m < count(); ++m)
    if (holds(m) == followers) moved += std::fabs(to[m] - now[m]) * rows().longest[m];
  const double share = moved > *most && !first_ ? *most / moved : 1;
  for (std::int32_t m = 0; m < count(); ++m)
    if (holds(m) == followers) now[m] = share == 1 ? to[m] : now[m] + share * (to[m] - now[m]);
  *most = share == 1 ? *most - moved : 0;
  return share == 1;
}

// amounts: of all rows. In the place of those that follow come the pressures that hold these volumes beside the others, without contacts.
void Motions::hold(const double* volumes, double* amounts) const {
  double q[kMost];
  for (std::int32_t m = 0; m < count(); ++m) {
    if (!source_.offset->followers().follows(m)) continue;
    q[m] = volumes[m];
    for (std::int32_t other = 0; other < source_.offset->count(); ++other)
      if (!source_.offset->followers().follows(other)) q[m] -= swept(m, other) * amounts[other];
  }
  source_.offset->followers().solve(q);
  for (std::int32_t m = 0; m < count(); ++m)
    if (source_.offset->followers().follows(m)) amounts[m] = q[m];
}

// Other volumes are held than in the last step: the organ is where it was, with other pressures for what contacts would leave of it.
void Motions::change_held() {
  double whole[kMostOffsetRows], alone[kMostOffsetRows], volumes[kMost];
  for (std::int32_t m = 0; m < source_.offset->count(); ++m) whole[m] = alone[m] = source_.offset->whole_amount(m);
  for (std::int32_t m = 0; m < count(); ++m) volumes[m] = state_[m].volume;
  source_.offset->follow(count(), holds_, source_.volume);
  hold(volumes, alone);
  source_.offset->start_from(alone, whole);
  changed_ = 0;
}

// The same, of a body that holds them itself, from where they are.
void Motions::begin_held() {
  RowVolume* const volumes = source_.offset->volumes();
  for (std::int32_t m = 0; m < count(); ++m) {
    if (!is_told(m) || (volumes[m].holds != 0) == (holds_[m] != 0)) continue;
    volumes[m].holds = holds_[m];
    volumes[m].target = holds_[m] ? state_[m].volume : 0;
  }
}

// The volumes that such a body holds go to what was asked for, as far as a pressure that moves a node by `most`, m, sweeps; but the first step takes
// them all. Returns whether they have come there.
bool Motions::move_volumes(double most) {
  bool arrived = true;
  RowVolume* const volumes = source_.offset->volumes();
  for (std::int32_t m = 0; m < count(); ++m) {
    if (!is_told(m) || !holds_[m]) continue;
    const double way = held_[m] - volumes[m].target, farthest = most / rows().longest[m] * swept(m, m);
    const bool reaches = first_ || std::fabs(way) <= farthest;
    volumes[m].target = reaches ? held_[m] : volumes[m].target + std::copysign(farthest, way);
    arrived = arrived && reaches;
  }
  return arrived;
}

// most: m, that a node may move. Returns step flags.
std::uint32_t Motions::take(double most) {
  Offset& offset = *source_.offset;
  double to[kMostOffsetRows];
  std::copy_n(wanted_, count(), to);
  if (RowVolume* const volumes = offset.volumes(); volumes && !source_.is_linear) {
    begin_held();
    for (std::int32_t m = 0; m < count(); ++m) to[m] -= volumes[m].beyond;
    const bool at_amounts = go_to(to, false, &most), at_volumes = move_volumes(most);
    first_ = 0;
    return at_amounts && at_volumes ? 0 : PALPATE_STEP_MOTION_LIMITED;
  }
  if (changed_) change_held();
  bool arrived = go_to(to, false, &most);
  if (offset.followers().count() > 0) {
    std::copy_n(offset.amounts(), offset.count(), to);
    hold(held_, to);
    arrived = go_to(to, true, &most) && arrived;
  }
  first_ = 0;
  return arrived ? 0 : PALPATE_STEP_MOTION_LIMITED;
}

void Motions::begin_step(TouchStep& step) {
  TouchState& state = *step.state;
  step.flags |= take(step.context->def.max_tool_speed * state.input.dt());
  step.context->watch.ended(source_.pass);
}

// m^3, what the surface of a pressure has swept; 0 where that is not known.
double Motions::volume_of(std::int32_t motion, const ContactConstraints& set, const Vec3* force) const {
  if (!is_pressure(motion) || !source_.is_whole) return 0;
  double sum = 0;
  for (std::int32_t m = 0; m < source_.offset->count(); ++m) sum += swept(motion, m) * source_.offset->whole_amount(m);
  for (std::int32_t e = 0; e < set.node_count; ++e) sum += dot(rows().at(motion, set.nodes[e].node), force[e]);
  return sum;
}

void Motions::take_reactions(TouchStep& step, bool /*solved*/) {
  const ContactConstraints& set = step.state->rows.set();
  const Vec3* const force = step.state->force;
  source_.offset->take_forces(set, force);
  for (std::int32_t m = 0; m < count(); ++m) {
    if (const RowVolume* const volumes = source_.offset->volumes(); volumes && is_told(m))
      state_[m] = {volumes[m].pressure, volumes[m].swept};
    else
      state_[m] = {source_.offset->whole_amount(m), volume_of(m, set, force)};
  }
}

}  // namespace palpate
