// What a step may count in operations (step_work.h), stated in the plan, and how many operations a machine does in a time.
#include <algorithm>
#include <cmath>
#include <ctime>

#include "runtime/base/aligned_memory.h"
#include "runtime/base/error_text.h"
#include "runtime/dense/node_sum.h"
#include "runtime/scene/build_scene.h"

namespace palpate {
namespace {

// Upper bounds, at the limits of the scene's definition, in the order of a step. The tests, the changes of contacts and the solution of
// a linear organ take no more than max_operations together (step_work.h); other parts come on top.
class WorkBounds {
 public:
  // bound: triangles of the bound surface, where tools meet one.
  explicit WorkBounds(const palpate_scene& scene)
      : scene_(scene),
        def_(scene.def),
        touch_(scene.touch),
        in_touch_(scene.body_in_touch() ? scene.body_in_touch()->effect->body : nullptr),
        bound_(scene.touch.surface.bound ? scene.touch.surface.bound->triangle_count() : 0) {}

  // Of tests and changes. The rest is kept for the solution.
  double collision() const { return most() - std::floor(most() / 8); }
  // Normals of a bound surface below discs that have moved, each of which may visit the whole surface.
  double rows() const { return 30 * bound_ * def_.max_points; }
  double contact() const {
    if (in_touch_) return in_touch_->most_operations(scene_);
    return most() + of_effects(false);
  }
  // Of an effect, on top of max_operations.
  double of_effect(std::int32_t e) const {
    const EffectPass& pass = scene_.effects[e].effect->pass;
    return pass.most_operations ? pass.most_operations(scene_, of_a_change()) : 0;
  }
  double step() const {
    const double on_top = rows() + of_effects(true);
    return in_touch_ ? collision() + contact() + on_top : contact() + on_top;
  }
  // A step of the fewest operations looks at all points and still tests one.
  double least() const {
    constexpr double tests = 24, linear = 10'000;
    const double test =
        def_.collision == PALPATE_COLLISION_OFF ? 0 : tests * static_cast<double>(touch_.points.collision.overshoot());
    return std::max(in_touch_ ? 1 : linear, test) + points();
  }

 private:
  double most() const { return static_cast<double>(def_.max_operations); }
  double points() const { return static_cast<double>(StepWork::kOfPoint) * def_.max_points; }
  double nodes() const { return def_.max_contact_nodes; }
  std::int32_t contacts() const { return constraints_of_point(def_) * def_.max_points + scene_.rows.constraints; }
  // Of those with a pass of their own; of all others.
  double of_effects(bool with_pass) const {
    double sum = 0;
    for (std::int32_t e = 0; e < scene_.effect_count; ++e)
      if ((scene_.effects[e].effect->pass.name != nullptr) == with_pass) sum += of_effect(e);
    return sum;
  }
  // Of one contact.
  double of_a_change() const { return 9 * nodes() * nodes() / kDense + of_discs() + most() / 4; }
  // Between the disc of a contact and those of all others.
  double of_discs() const {
    return def_.contact == PALPATE_CONTACT_PATCH ? static_cast<double>(kOfTwoDiscs) * contacts() : 0;
  }

  const palpate_scene& scene_;
  const palpate_scene_def& def_;
  const TouchState& touch_;
  const EffectBody* in_touch_;  // the body that is solved in the touch; nullptr: the linear organ is
  const double bound_;
};

}  // namespace

palpate_status state_work_bounds(palpate_scene& scene, palpate_error* error) {
  const WorkBounds bounds(scene);
  const double least = bounds.least();
  if (static_cast<double>(scene.def.max_operations) < least)
    return fail(
        error, PALPATE_ERROR_ARGUMENT, 0,
        "palpate_scene_def: max_operations: expected %.0f or more, which this organ's surface, these effects and "
        "max_points %d take at least, found %lld; raise it (default 300000), or lower max_points",
        least, static_cast<int>(scene.def.max_points), static_cast<long long>(scene.def.max_operations));
  const auto state = [&](Pass id, double operations) {
    if (const std::int32_t at = scene.watch.index_in_plan[static_cast<std::int32_t>(id)]; at >= 0)
      scene.plan.pass[at].most_operations = static_cast<std::int64_t>(std::min(operations, 9e18));
  };
  if (scene.def.collision != PALPATE_COLLISION_OFF) state(Pass::collision, bounds.collision());
  state(Pass::rows, bounds.rows());
  state(Pass::contact, bounds.contact());
  for (std::int32_t e = 0; e < scene.effect_count; ++e) state(pass_of_effect(e), bounds.of_effect(e));
  scene.plan.most_operations = static_cast<std::int64_t>(std::min(bounds.step(), 9e18));
  return PALPATE_OK;
}

}  // namespace palpate

int64_t palpate_scene_most_operations(const palpate_scene* scene) {
  return scene ? scene->plan.most_operations : 0;
}

#ifdef __wasm__
// The browser's module has no clock.
int64_t palpate_operations_in(double) {
  return 0;
}
#else
// Sums at nodes are what a step does most, and operations are counted by them.
int64_t palpate_operations_in(double microseconds) {
  constexpr int kColumns = 300, kNodes = 1000, kNumbers = 3 * kNodes, kRounds = 10, kSums = 200;
  constexpr std::size_t kBytes = sizeof(float) * kColumns * kNumbers;
  auto* const numbers = static_cast<float*>(palpate::take_aligned((kBytes + 63) / 64 * 64));
  if (!numbers || !(microseconds > 0)) {
    palpate::release_aligned(numbers);
    return 0;
  }
  std::fill(numbers, numbers + kColumns * kNumbers, 1.0f);
  const void* column[kColumns];
  double coefficient[kColumns], sum[3], best = INFINITY;
  for (int j = 0; j < kColumns; ++j) column[j] = numbers + j * kNumbers, coefficient[j] = 1;
  // The processor time of the fastest of some rounds; a clock that is too coarse for one round gets more sums.
  int sums = kSums;
  for (int round = 0; round < kRounds; ++round) {
    const std::clock_t start = std::clock();
    for (int n = 0; n < sums; ++n)
      palpate::sum_at_node(palpate::formats::ElementType::f32, column, coefficient, kColumns,
                           3 * static_cast<std::size_t>(n * 7 % kNodes), kNumbers, sum);
    const double ticks = static_cast<double>(std::clock() - start);
    if (ticks < 100) {
      sums *= 4, --round;
      continue;
    }
    best = std::min(best, 1e6 * ticks / CLOCKS_PER_SEC / sums);
  }
  palpate::release_aligned(numbers);
  return static_cast<int64_t>(std::min(microseconds / best * (10 + kColumns), 9e18));
}
#endif
