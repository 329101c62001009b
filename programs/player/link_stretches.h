// A link of a scene as the library takes it: a piece for each two neighbouring ends. The same for links of one organ (palpate_link) and
// for links between organs (palpate_world_link).
#pragma once

#include <palpate/palpate_complete.h>

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "formats/scene_config.h"
#include "programs/player/tool_places.h"

namespace palpate {

struct LinkStretch {
  std::size_t link;  // of the scene
  int part;          // 0 .. of that link
  double share;      // of the link's rest length
  double apart;      // m, on the mesh
};

palpate_link_end end_at(const SurfacePlace& place);
palpate_link_end end_in_world(const SceneConfig::Vector& point);

// The stretches of link number `index` through its ends. points: m, in one frame.
std::vector<LinkStretch> stretches_through(std::size_t index, const std::vector<SceneConfig::Vector>& points);
// "suture", and "suture 2" for the second stretch of a thread through several places.
std::string name_of(const SceneConfig::Link& link, const LinkStretch& stretch);

// What a stretch has of its link, but for its ends. Made: palpate_link or palpate_world_link.
template <class Made>
void take_link(const SceneConfig::Link& link, const LinkStretch& stretch, bool runs_on, Made* made) {
  made->kind = static_cast<palpate_link_kind>(static_cast<int>(link.kind) + 1);
  made->runs_on = runs_on;
  made->radius = link.radius;
  made->rest_length = link.kind == SceneConfig::Link::Kind::clip ? 0 : stretch.apart;
  if (link.breaking_force) made->breaking_force = *link.breaking_force;
}

// Rest length and stiffness at a time, s. Returns whether one has changed. Allocates nothing.
bool take_numbers(const SceneConfig::Link& link, const LinkStretch& stretch, double time, double* rest_length,
                  double* stiffness);
// The same of all stretches. made: [stretch]
template <class Stretch, class Made>
bool take_numbers(const std::vector<SceneConfig::Link>& links, const std::vector<Stretch>& stretches, double time,
                  std::vector<Made>* made) {
  bool changed = false;
  for (std::size_t s = 0; s < made->size(); ++s)
    changed =
        take_numbers(links[stretches[s].link], stretches[s], time, &(*made)[s].rest_length, &(*made)[s].stiffness) ||
        changed;
  return changed;
}

// "slack", "taut", "broken".
const char* word_of(palpate_link_condition condition);

// What became of a stretch: its largest tension, and when it became taut, slack or broke.
struct LinkPeak {
  struct Event {
    double time;  // s
    palpate_link_condition to;
  };
  static constexpr std::size_t kMostEvents = 100;  // that are kept: a stretch may tremble

  double tension = 0, time = 0;
  std::optional<double> broken;  // s
  std::vector<Event> events;     // the first ones
  std::size_t event_count = 0;   // those that are not kept too

  // Call it between the touch of that time, s, and the next one. state: nullptr: nothing.
  void add(const palpate_link_state* state, double at);
  void put(nlohmann::ordered_json* entry) const;
  std::string sentence() const;  // "largest tension ..."

 private:
  palpate_link_condition last_ = PALPATE_LINK_SLACK;
};

}  // namespace palpate
