// The metric of the method: the factor of the stiffness at rest, or of the tangent at a later state, which takes its place slice by slice.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/large/block_factor.h"
#include "runtime/large/held_volumes.h"
#include "runtime/large/hyperelastic_energy.h"
#include "runtime/large/mesh_follower.h"
#include "runtime/large/tangent.h"

namespace palpate {

class BodyMetric {
 public:
  enum class Made { yes, no_memory, not_definite };
  // Gives the nodes of `energy` their order, too. preload: as HyperelasticEnergy::take_load, or nullptr.
  Made create(SceneMemory& memory, const HyperelasticBody& body, HyperelasticEnergy* energy, const double* preload,
              bool renews, std::int64_t fewest_for_rough);
  void keep(SceneMemory& memory);
  // Makes anew what the kept state says.
  void restored();

  // x <- metric^-1 x, with what volumes that are held add; of kMostVectors at most. solve_roughly(): as BlockFactor's.
  static constexpr int kMostVectors = AddedCompliance::kMostVectors;
  void solve(float* const* x, int count) const;
  void solve(float* x) const { solve(&x, 1); }
  // The same without held volumes; and with the stiffness at rest.
  void solve_unheld(float* const* x, int count) const { solve_with(now(), x, count); }
  void solve_at_rest(float* const* x, int count) const { solve_with(rest_, x, count); }
  // The mesh is cut. Borrowed. Where it acts, the metric is that at rest.
  void add(AddedCompliance* added) { added_ = added; }
  void solve_roughly(float* x) const;
  // LargeSolver fills these in, and does so anew where the factor becomes another one.
  HeldVolumes& held() { return held_; }
  const HeldVolumes& held() const { return held_; }
  const BlockFactor& now() const { return state_.active ? renewed_ : rest_; }
  const BlockFactor& rest() const { return rest_; }
  bool renews() const { return of_metric_ != nullptr; }
  bool is_renewed() const { return state_.active != 0; }
  bool has_begun() const { return state_.slices > 0; }
  std::int32_t renewals() const { return state_.count; }

  // A slice of the next metric, whose state is u (m, by places) at the first slice. True where it has become the metric.
  static constexpr std::int32_t kSlices = 16;
  bool renew(const float* u);
  // Back to the stiffness at rest. True where the metric was another one.
  bool forget();

 private:
  // From call to call.
  struct State {
    std::int32_t count = 0;   // as renewals()
    std::int32_t slices = 0;  // done of the next metric
    std::int32_t active = 0, unused = 0;
  };
  bool make_slice(std::int32_t slice);
  void solve_with(const BlockFactor& factor, float* const* x, int count) const;

  BlockFactor rest_, renewed_;
  HeldVolumes held_;
  BlockFactor::Work work_;
  Tangent tangent_;
  State state_;
  std::int32_t next_supernode_ = 0;
  const HyperelasticEnergy* energy_ = nullptr;
  AddedCompliance* added_ = nullptr;
  float *of_metric_ = nullptr, *of_next_ = nullptr;  // [padded] m, the states of the metric and of the next one
};

}  // namespace palpate
