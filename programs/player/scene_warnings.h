// What the user should know of a played scene, a sentence each, for the list of warnings that palpate-run prints at its end and
// writes into summary.json.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "programs/player/bundle_fields.h"
#include "programs/player/played_organ.h"

namespace palpate {

// Organs of a scene with their names, in a scene of one organ without, and where they stand.
struct NamedOrgan {
  const PlayedOrgan* organ;
  std::string name;
  palpate_pose pose = palpate_default_pose();
};

// Where the tools and grips lie, against the organs at rest. touched[tool]: whether a point of the tool was ever in contact; its
// grips do not count. At most one sentence for each tool and one for each grip:
// - A tool with points that never touched: the least distance, when and where. Distances are right to 1 um.
// - A tool that began inside the organ: how deep, and which point. Such a point touches nothing until it has been outside.
// - A grip whose `nearest` is farther from its node than the node's longest edge of the surface.
// Cost: a query of the surface (microseconds) for each step of the path that may come nearer than those before.
std::vector<std::string> placement_warnings(const SceneConfig& scene, const std::vector<NamedOrgan>& organs,
                                            const std::vector<bool>& touched);

// One sentence where the organ is shorter than kSmallestOrgan or longer than kLargestOrgan, else none.
std::vector<std::string> size_warnings(const NamedOrgan& of);

// The largest displacement of a node in a played scene.
struct LargestDisplacement {
  double length = 0, time = 0;  // m, s
  int node = 0;
};

// One sentence where the displacement is beyond what linear elasticity is good for, else none. The limit is `displacement` of the
// scene's [limits]; without it and under linear deformation the least of two: accuracy_linear_limit_mm of the bundle's provenance, or else kLinearLimit; and
// kLargestShare of the organ's smallest extent.
inline constexpr double kLinearLimit = 0.01;  // m: docs/accuracy.md, "Linear elasticity itself"
inline constexpr double kLargestShare = 0.1;
std::vector<std::string> displacement_warnings(const NamedOrgan& of, const BundleFields& fields,
                                               const LargestDisplacement& largest);

// Where large deformation lost its tools: steps that were undone.
class LostDeformation {
 public:
  // body_residual of palpate_contacts is above this in such a step.
  static constexpr double kUndone = 0.5;
  void add(double time, const palpate_contacts& contacts);
  std::vector<std::string> warnings() const;  // one sentence, or none

 private:
  std::uint64_t touches_ = 0, undone_ = 0;
  double first_ = 0;  // s
};

// Counts the step flags of the steps of one kind.
class FlagCounts {
 public:
  void add(palpate_step_flags flags);
  const std::array<std::uint64_t, 32>& steps_with() const { return steps_with_; }  // [bit]
  // steps: what they are called: "touches", "shapes". One sentence for each flag that was raised, with its count.
  std::vector<std::string> warnings(const std::string& steps) const;

 private:
  std::array<std::uint64_t, 32> steps_with_{};
  std::uint64_t steps_ = 0;
};

}  // namespace palpate
