#include "programs/player/needle_peak.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace palpate {
namespace {

nlohmann::ordered_json or_null(const std::optional<double>& value) {
  return value ? nlohmann::ordered_json(*value) : nlohmann::ordered_json(nullptr);
}

// A needle may also be stuck in front of the surface, where no corridor begins.
bool is_inside(const palpate_needle_state& state) {
  return state.condition == PALPATE_NEEDLE_INSIDE || state.condition == PALPATE_NEEDLE_CUTS ||
         (state.condition == PALPATE_NEEDLE_STUCK && state.depth > 0);
}

}  // namespace

const char* word_of(palpate_needle_condition condition) {
  static constexpr const char* words[] = {"none", "outside", "presses", "inside", "cuts", "stuck"};
  return words[condition];
}

void NeedlePeak::add(const palpate_needle_state& state, double time, int most_places) {
  force_.add(std::hypot(state.force[0], state.force[1], state.force[2]), time);
  torque_.add(std::hypot(state.torque[0], state.torque[1], state.torque[2]), time);
  tip_.add(state.tip_force, time), shaft_.add(std::fabs(state.shaft_force), time);
  depth_.add(state.depth, time);
  places_ = std::max(places_, state.places);
  note_events(state, time, most_places);
}

void NeedlePeak::note_events(const palpate_needle_state& state, double time, int most_places) {
  if (is_inside(state)) {
    if (!pierced_) pierced_ = time;
    out_.reset();
  }
  if (state.condition == PALPATE_NEEDLE_STUCK && !stuck_) stuck_ = time, no_place_ = state.places >= most_places;
  if (state.condition == PALPATE_NEEDLE_OUTSIDE && pierced_ && !out_) out_ = time;
}

nlohmann::ordered_json NeedlePeak::json(const palpate_needle& needle) const {
  return {{"radius_m", needle.radius},
          {"peak_force_N", force_.value},
          {"peak_torque_Nm", torque_.value},
          {"peak_tip_force_N", tip_.value},
          {"peak_shaft_force_N", shaft_.value},
          {"deepest_m", depth_.value},
          {"deepest_s", depth_.time},
          {"most_places", places_},
          {"pierced_s", or_null(pierced_)},
          {"stuck_s", or_null(stuck_)},
          {"out_s", or_null(out_)}};
}

std::string NeedlePeak::stuck() const {
  if (!stuck_) return {};
  return fmt::format("stuck at {:.3g} s, {}", *stuck_,
                     no_place_  ? "for want of needle_places"
                     : pierced_ ? "where the tip would leave the corridor"
                                : "since the bundle has no corridor where it enters");
}

std::string NeedlePeak::sentence() const {
  std::string text = pierced_ ? fmt::format("pierced the surface at {:.3g} s, deepest {:.3g} mm at {:.3g} s", *pierced_,
                                            1e3 * depth_.value, depth_.time)
                              : std::string("did not pierce the surface");
  text += fmt::format("; largest force {:.3g} N, at {:.3g} s", force_.value, force_.time);
  if (stuck_) text += "; " + stuck();
  if (out_) text += fmt::format("; out at {:.3g} s", *out_);
  return text;
}

}  // namespace palpate
