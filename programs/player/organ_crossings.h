// What a scene with `crossings` asks after each shape: whether the surface crosses itself, and where.
#pragma once

#include <optional>
#include <vector>

#include <palpate/palpate_complete.h>

namespace palpate {

class OrganCrossings {
 public:
  // runtime_scene: with crossings; it must outlive this.
  explicit OrganCrossings(palpate_scene* runtime_scene);
  OrganCrossings(const OrganCrossings&) = delete;
  OrganCrossings& operator=(const OrganCrossings&) = delete;

  // After palpate_scene_shape, which has filled positions. Allocates nothing. Returns step flags.
  palpate_step_flags follow(const palpate_shape_out& shape);

  // Of the last finished check; the places of the first 64 pairs.
  const palpate_crossings_out& found() const { return found_; }

 private:
  palpate_scene* runtime_scene_;
  std::vector<palpate_crossing> places_;
  palpate_crossings_out found_ = palpate_default_crossings_out();
};

// All checks of an organ.
struct CrossingsSummary {
  std::uint64_t checks = 0;
  std::int32_t most_pairs = 0;
  double first_time = -1;                 // s, of the first shape at which a check had found some
  std::optional<palpate_crossing> first;  // of that check
  void add(double time, const palpate_crossings_out& found);
};

}  // namespace palpate
