// What a needle of a played scene came to: forces, depth and events.
#pragma once

#include <palpate/palpate_complete.h>

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

namespace palpate {

class NeedlePeak {
 public:
  // Call it between the touch of that time, s, and the next one. most_places: that it may hold.
  void add(const palpate_needle_state& state, double time, int most_places);
  // For summary.json.
  nlohmann::ordered_json json(const palpate_needle& needle) const;
  // "pierced the surface at 0.3 s, deepest 40 mm at 2 s, ..."
  std::string sentence() const;
  // "stuck at 0.4 s, where the tip would leave the corridor"; empty: it never was.
  std::string stuck() const;

 private:
  void note_events(const palpate_needle_state& state, double time, int most_places);

  struct Largest {
    double value = 0, time = 0;
    void add(double now, double at) {
      if (now > value) value = now, time = at;
    }
  };
  Largest force_, torque_, tip_, shaft_, depth_;  // shaft_: either way
  int places_ = 0;
  bool no_place_ = false;                        // it was stuck for want of a place
  std::optional<double> pierced_, stuck_, out_;  // s
};

// "none", "outside", "presses", "inside", "cuts", "stuck".
const char* word_of(palpate_needle_condition condition);

}  // namespace palpate
