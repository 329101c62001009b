#include "programs/player/link_stretches.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "formats/scene_holds.h"

namespace palpate {
namespace {

static_assert(static_cast<int>(SceneConfig::Link::Kind::thread) + 1 == PALPATE_LINK_THREAD);
static_assert(static_cast<int>(SceneConfig::Link::Kind::spring) + 1 == PALPATE_LINK_SPRING);
static_assert(static_cast<int>(SceneConfig::Link::Kind::clip) + 1 == PALPATE_LINK_CLIP);

double distance(const SceneConfig::Vector& a, const SceneConfig::Vector& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

}  // namespace

palpate_link_end end_at(const SurfacePlace& place) {
  palpate_link_end end = {};
  end.kind = PALPATE_END_SURFACE_POINT, end.triangle = place.triangle;
  std::copy(place.barycentric.begin(), place.barycentric.end(), end.barycentric);
  return end;
}

palpate_link_end end_in_world(const SceneConfig::Vector& point) {
  palpate_link_end end = {};
  end.kind = PALPATE_END_WORLD;
  std::copy(point.begin(), point.end(), end.point);
  return end;
}

std::vector<LinkStretch> stretches_through(std::size_t index, const std::vector<SceneConfig::Vector>& points) {
  const std::size_t count = points.size() - 1;
  double length = 0;
  for (std::size_t i = 0; i < count; ++i) length += distance(points[i], points[i + 1]);
  std::vector<LinkStretch> stretches;
  for (std::size_t i = 0; i < count; ++i) {
    const double apart = distance(points[i], points[i + 1]);
    stretches.push_back(
        {index, static_cast<int>(i), length > 0 ? apart / length : 1 / static_cast<double>(count), apart});
  }
  return stretches;
}

std::string name_of(const SceneConfig::Link& link, const LinkStretch& stretch) {
  return stretches_of(link) == 1 ? link.name : fmt::format("{} {}", link.name, stretch.part + 1);
}

bool take_numbers(const SceneConfig::Link& link, const LinkStretch& stretch, double time, double* rest_length,
                  double* stiffness) {
  const double length_before = *rest_length, stiffness_before = *stiffness;
  if (!link.rest_length.empty()) *rest_length = stretch.share * value_at(link.rest_length, time);
  if (!link.stiffness.empty()) *stiffness = value_at(link.stiffness, time);
  return *rest_length != length_before || *stiffness != stiffness_before;
}

const char* word_of(palpate_link_condition condition) {
  static constexpr const char* words[] = {"slack", "taut", "broken"};
  return words[condition];
}

void LinkPeak::add(const palpate_link_state* state, double at) {
  if (!state) return;
  if (std::fabs(state->tension) > std::fabs(tension)) tension = state->tension, time = at;
  if (state->condition == PALPATE_LINK_BROKEN && !broken) broken = at;
  if (state->condition == last_) return;
  last_ = state->condition;
  if (event_count++ < kMostEvents) events.push_back({at, last_});
}

void LinkPeak::put(nlohmann::ordered_json* entry) const {
  (*entry)["peak_tension_N"] = tension, (*entry)["peak_time_s"] = time;
  (*entry)["broken_s"] = broken ? nlohmann::ordered_json(*broken) : nlohmann::ordered_json(nullptr);
  (*entry)["event_count"] = event_count;
  nlohmann::ordered_json& list = (*entry)["events"] = nlohmann::ordered_json::array();
  for (const Event& event : events) list.push_back({{"time_s", event.time}, {"became", word_of(event.to)}});
}

std::string LinkPeak::sentence() const {
  std::string text = fmt::format("largest tension {:.3g} N, at {:.3g} s", tension, time);
  if (broken) return text + fmt::format("; broke at {:.3g} s", *broken);
  if (event_count > 1) text += fmt::format("; became taut or slack {} times", event_count);
  return text;
}

}  // namespace palpate
