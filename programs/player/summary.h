// summary.json: counts, peak forces, flags and timing percentiles of a played scene.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "programs/player/bundle_fields.h"
#include "programs/player/held_summary.h"
#include "programs/player/player.h"
#include "programs/player/scene_warnings.h"
#include "programs/player/world_player.h"

namespace palpate {

// Nearest-rank percentile (the smallest value that at least that share of the values does not exceed); 0 where there
// are no values. share in (0, 1].
double percentile(std::vector<double> values, double share);

// The names of the flags that are set, without PALPATE_STEP_, in the order of their bits.
std::vector<std::string> flag_names(palpate_step_flags flags);

class Summary {
 public:
  explicit Summary(const Player& player);
  explicit Summary(const WorldPlayer& player);
  void add(const TouchRecord& touch);
  void add(const ShapeRecord& shape, std::size_t organ = 0);
  void add(const WorldTouchRecord& touch);
  // JSON text. Everything but "timing_us" is the same for the same input. fields: [organ] of its bundle. warnings: those of warnings().
  // digits: significant ones of a number, but for the provenance, which is the bundle's.
  std::string text(const Timing& timing, const std::vector<BundleFields>& fields, int shapes_written,
                   const std::vector<std::string>& warnings, int digits) const;
  // One line for each tool that touched: its largest force; and for each link, grasp and needle, and each organ that others press.
  std::vector<std::string> forces() const;
  // What the user should know of this run, a sentence each (scene_warnings.h). Asks the surface; takes milliseconds.
  std::vector<std::string> warnings(const std::vector<BundleFields>& fields) const;

 private:
  struct Tool {
    double peak_force = 0, peak_time = 0, first_contact_time = -1;
    std::array<double, 3> peak_force_vector{};
    int most_contacts = 0, points = 0;
    bool point_touched = false;  // its grips do not count
    palpate_step_flags flags = 0;
  };
  struct Organ {
    NamedOrgan of;
    HeldSummary held;
    int most_contact_nodes = 0;
    LargestDisplacement largest{};
    CrossingsSummary crossings{};
    double peak_pressed = 0, peak_pressed_time = 0;  // N, by other organs; s
  };
  Summary(const SceneConfig& scene, const std::vector<std::vector<SceneConfig::Vector>>& points,
          const std::vector<NamedOrgan>& organs);
  template <typename State>
  void add_tool(double time, std::size_t tool, const State& state);
  void add_nodes(Organ& organ, double time, const palpate_contacts& contacts);

  const SceneConfig& scene_;
  std::optional<OrganLinkSummary> links_;  // between organs, where there are some
  std::vector<Tool> tools_;
  std::vector<Organ> organs_;
  FlagCounts touch_flags_, shape_flags_;
  LostDeformation lost_;
  std::uint64_t touches_ = 0, shapes_ = 0;
  int most_pairs_ = 0;
  double peak_pressure_ = 0, largest_overlap_ = 0;  // Pa, m, of pairs of organs
};

}  // namespace palpate
