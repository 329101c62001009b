// summary.json: counts, peak forces, flags and timing percentiles of a played scene.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "programs/player/bundle_fields.h"
#include "programs/player/held_summary.h"
#include "programs/player/player.h"
#include "programs/player/scene_warnings.h"

namespace palpate {

// Nearest-rank percentile (the smallest value that at least that share of the values does not exceed); 0 where there
// are no values. share in (0, 1].
double percentile(std::vector<double> values, double share);

// The names of the flags that are set, without PALPATE_STEP_, in the order of their bits.
std::vector<std::string> flag_names(palpate_step_flags flags);

class Summary {
 public:
  explicit Summary(const Player& player);
  void add(const TouchRecord& touch);
  void add(const ShapeRecord& shape);
  // JSON text. Everything but "timing_us" is the same for the same input. warnings: those of warnings().
  std::string text(const Timing& timing, const BundleFields& fields, const std::filesystem::path& bundle,
                   int shapes_written, const std::vector<std::string>& warnings) const;
  // One line for each tool that touched: its largest force; and for each link and grasp.
  std::vector<std::string> forces() const;
  // What the user should know of this run, a sentence each (scene_warnings.h). Asks the surface; takes milliseconds.
  std::vector<std::string> warnings(const BundleFields& fields) const;

 private:
  struct Tool {
    double peak_force = 0, peak_time = 0, first_contact_time = -1;
    std::array<double, 3> peak_force_vector{};
    int most_contacts = 0, points = 0;
    bool point_touched = false;  // its grips do not count
    palpate_step_flags flags = 0;
  };
  const Player& player_;
  std::vector<Tool> tools_;
  HeldSummary held_;
  FlagCounts touch_flags_, shape_flags_;
  std::uint64_t touches_ = 0, shapes_ = 0;
  int most_contact_nodes_ = 0;
  LargestDisplacement largest_;
};

}  // namespace palpate
