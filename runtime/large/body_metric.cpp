#include "runtime/large/body_metric.h"

#include <algorithm>

namespace palpate {
namespace {

// N/m, that assemble_stiffness gave the single held dofs; 0 where there are none.
double held_diagonal(const BlockRows& stiffness, const HyperelasticBody& body, const std::int32_t* place) {
  for (std::int32_t n = 0; n < body.node_count; ++n)
    for (int i = 0; i < 3; ++i)
      if (place[n] < stiffness.rows && body.fixed[3 * static_cast<std::size_t>(n) + static_cast<std::size_t>(i)])
        return stiffness.block[9 * stiffness.index_of(place[n], place[n]) + 4 * i];
  return 0;
}

}  // namespace

BodyMetric::Made BodyMetric::create(SceneMemory& memory, const HyperelasticBody& body, HyperelasticEnergy* energy,
                                    const double* preload, bool renews, std::int64_t fewest_for_rough) {
  energy_ = energy;
  SceneMemory scratch = memory.of_same_host();
  std::int32_t* const improved = scratch.array<std::int32_t>(static_cast<std::size_t>(energy->rows_at_rest()));
  BlockRows stiffness;
  Made made = Made::no_memory;
  if (!scratch.failed() && assemble_stiffness(scratch, body, energy->places(), energy->rows_at_rest(), &stiffness) &&
      postorder(scratch, stiffness, improved)) {
    energy->reorder(improved);
    stiffness = {};
    if (assemble_stiffness(scratch, body, energy->places(), energy->rows_at_rest(), &stiffness)) {
      const BlockFactor::Outcome outcome = rest_.create(memory, stiffness, fewest_for_rough);
      if (outcome == BlockFactor::Outcome::made) made = Made::yes;
      if (preload && !energy->take_load(memory, body, stiffness, preload)) made = Made::no_memory;
      if (outcome == BlockFactor::Outcome::not_definite) made = Made::not_definite;
      if (renews && made == Made::yes) {
        of_metric_ = memory.array<float>(energy->padded()), of_next_ = memory.array<float>(energy->padded());
        if (memory.failed() || !renewed_.create_like(memory, rest_) || !work_.create(memory, rest_) ||
            !tangent_.create(memory, body, energy->places(), energy->rows_at_rest(),
                             held_diagonal(stiffness, body, energy->places())))
          made = Made::no_memory;
      }
    }
  }
  scratch.release_all();
  return made;
}

void BodyMetric::solve(float* const* x, int count) const {
  double amounts[kMostVectors][kMostOffsetRows];
  for (int c = 0; c < count; ++c) held_.before(x[c], amounts[c]);
  solve_unheld(x, count);
  for (int c = 0; c < count; ++c) held_.after(amounts[c], x[c]);
}

void BodyMetric::solve_with(const BlockFactor& factor, float* const* x, int count) const {
  if (!added_ || !added_->acts()) return factor.solve(x, count);
  added_->begin(x, count);
  factor.solve(x, count);
  added_->go_on(x, count);
  factor.solve(x, count);
  added_->end(x, count);
}

// Where a cut leaves little, what it adds is large, and the rounding of a rough solve with it.
void BodyMetric::solve_roughly(float* x) const {
  if (added_ && added_->acts()) return solve(x);
  double amounts[kMostOffsetRows];
  held_.before(x, amounts);
  now().solve_roughly(x);
  held_.after(amounts, x);
}

void BodyMetric::keep(SceneMemory& memory) {
  if (!renews()) return;
  memory.keep(state_);
  memory.keep_array(of_metric_, 3 * static_cast<std::size_t>(energy_->nodes()));
  memory.keep_array(of_next_, 3 * static_cast<std::size_t>(energy_->nodes()));
}

void BodyMetric::restored() {
  if (state_.active) {
    tangent_.begin(of_metric_);
    for (std::int32_t s = 0; s < renewed_.supernodes(); ++s) renewed_.factorise_supernode(work_, s, tangent_);
    renewed_.take_panels(work_);
  }
  for (std::int32_t slice = 0; slice < state_.slices; ++slice) make_slice(slice);
}

// Goes on to the end of a slice, which is a share of all operations. False where the tangent is not definite.
bool BodyMetric::make_slice(std::int32_t slice) {
  if (slice == 0) {
    tangent_.begin(of_next_);
    next_supernode_ = 0;
  }
  const std::int64_t end = slice + 1 < kSlices ? rest_.operations() / kSlices * (slice + 1) : INT64_MAX;
  for (; next_supernode_ < rest_.supernodes(); ++next_supernode_) {
    if (next_supernode_ > 0 && work_.operations() >= end) break;
    if (!rest_.factorise_supernode(work_, next_supernode_, tangent_)) return false;
  }
  return true;
}

bool BodyMetric::renew(const float* u) {
  const std::size_t numbers = 3 * static_cast<std::size_t>(energy_->nodes());
  for (std::size_t i = 0; i < numbers && state_.slices == 0; ++i)
    of_next_[i] =
        (energy_->base() ? energy_->base()[i] : 0.0f) + (energy_->moved() ? energy_->moved()[i] : 0.0f) + u[i];
  if (!make_slice(state_.slices)) {
    state_.slices = 0;
    return false;
  }
  if (++state_.slices < kSlices) return false;
  renewed_.take_panels(work_);
  std::copy(of_next_, of_next_ + numbers, of_metric_);
  state_.active = 1, state_.slices = 0, ++state_.count;
  return true;
}

bool BodyMetric::forget() {
  const bool was_active = state_.active != 0;
  state_ = {};
  return was_active;
}

}  // namespace palpate
