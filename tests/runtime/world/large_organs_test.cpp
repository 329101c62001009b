// Organs of a world that are hyperelastic bodies, and that touch one another. How each effect acts with them: tests/effects.
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "tests/runtime/world/random_pushes.h"
#include "tests/runtime/world/touching_world.h"

namespace palpate::tests {
namespace {

using Eigen::Vector3d;

constexpr palpate_deformation_model kLarge[] = {PALPATE_DEFORMATION_LARGE, PALPATE_DEFORMATION_LARGE_BESIDE,
                                                PALPATE_DEFORMATION_LARGE_RENEWED};

// The upper block on its way into the lower one, back, or aside. again: how often each step of the way is played: some ten times, it is
// converged.
class PressedBlocks : public Touching {
 public:
  PressedBlocks(palpate_deformation_model deformation, double friction, int again)
      : Touching({{&upper_block(), kStart}, {&lower_block(), {0, 0, 0}}}, friction, 200, deformation), again_(again) {}

  palpate_step_flags move(const Vector3d& way) {
    at_ += way;
    place(0, at_);
    palpate_step_flags flags = 0;
    for (int i = 0; i < again_; ++i) flags = step();
    // Of the organ on the host that moves it, against its way.
    work_ -= 0.5 * (force_ + pressed(0)).dot(way), force_ = pressed(0);
    return flags;
  }
  std::vector<float> shapes() {
    std::vector<float> all = shape(0, upper_block()), other = shape(1, lower_block());
    all.insert(all.end(), other.begin(), other.end());
    return all;
  }
  double work() const { return work_; }  // J, of the host

 private:
  static inline const Vector3d kStart{0, 0, 0.0302};
  int again_;
  Vector3d at_ = kStart, force_ = Vector3d::Zero();
  double work_ = 0;
};

double size(const std::vector<float>& u) {
  return std::sqrt(std::inner_product(u.begin(), u.end(), u.begin(), 0.0));
}
double difference(const std::vector<float>& a, const std::vector<float>& b) {
  std::vector<float> d(a.size());
  std::transform(a.begin(), a.end(), b.begin(), d.begin(), std::minus<>());
  return size(d);
}

// A tenth of a millimetre in each step is 0.1 m/s.
TEST(LargeOrgans, PressOneAnotherAsTheirConvergedSolution) {
  const double linear = [] {
    PressedBlocks blocks(PALPATE_DEFORMATION_LINEAR, 0, 1);
    for (int s = 0; s < 60; ++s) blocks.move({0, 0, -1e-4});
    return blocks.pressed(0).z();
  }();
  for (const palpate_deformation_model deformation : kLarge)
    for (const double friction : {0.0, 0.3}) {
      SCOPED_TRACE(testing::Message() << "deformation " << deformation << ", friction " << friction);
      PressedBlocks touched(deformation, friction, 1), converged(deformation, friction, 4);
      int trusted = 0;
      for (int s = 0; s < 75; ++s) {
        const Vector3d way(s < 60 ? 0 : 1e-4, 0, s < 60 ? -1e-4 : 0);
        const palpate_step_flags flags = touched.move(way);
        converged.move(way);
        // Friction begins a step after a pair begins to press, wherever that is.
        if (s < 20 || flags != 0) continue;
        ++trusted;
        EXPECT_LT((touched.pressed(0) - converged.pressed(0)).norm(), 0.02 * converged.pressed(0).norm()) << s;
        EXPECT_LT(difference(touched.shapes(), converged.shapes()), 0.02 * size(converged.shapes())) << s;
        EXPECT_LT((touched.pressed(0) + touched.pressed(1)).norm(), 1e-9 * touched.pressed(0).norm()) << s;
      }
      EXPECT_GT(trusted, 44);
      EXPECT_GT(converged.pressed(0).z(), 0.8 * linear);
      EXPECT_LT(converged.pressed(0).z(), 2 * linear);
    }
}

// Pressed, dragged, lifted: the host gets back no more than it gave.
TEST(LargeOrgans, GiveBackNoMoreThanWasPutIn) {
  for (const palpate_deformation_model deformation : kLarge)
    for (const double friction : {0.0, 0.3}) {
      SCOPED_TRACE(testing::Message() << "deformation " << deformation << ", friction " << friction);
      PressedBlocks blocks(deformation, friction, 2);
      double most = 0;
      const auto go = [&](int steps, const Vector3d& way) {
        for (int s = 0; s < steps; ++s) blocks.move(way), most = std::max(most, blocks.work());
      };
      go(30, {0, 0, -2e-4}), go(20, {2e-4, 0, 0}), go(32, {0, 0, 2e-4}), go(20, {-2e-4, 0, 0});
      EXPECT_GT(most, 1e-4);
      EXPECT_GT(blocks.work(), -0.02 * most);
      EXPECT_LT(blocks.pressed(0).norm(), 1e-9);
    }
}

TEST(LargeOrgans, MayTouchLinearOnes) {
  const auto pressed = [](palpate_deformation_model upper, palpate_deformation_model lower) {
    SceneDef defs[2] = {touching_def(), touching_def()};
    defs[0].large.deformation = upper, defs[1].large.deformation = lower;
    const palpate_pose poses[2] = {pose_at({0, 0, 0.0282}), pose_at({0, 0, 0})};
    const palpate_world_organ organs[2] = {organ_of(upper_block().bundle(), &defs[0], &poses[0]),
                                           organ_of(lower_block().bundle(), &defs[1], &poses[1])};
    palpate_world_def def = palpate_default_world_def();
    def.organs = organs, def.organ_count = 2, def.max_pairs = 200;
    palpate_world* made = nullptr;
    EXPECT_EQ(palpate_world_create(&def, &made, nullptr), PALPATE_OK);
    const WorldPointer world(made);
    WorldContacts contacts(made);
    const palpate_pose start = pose_at({0, 0, 0.0302});
    palpate_scene_set_pose(palpate_world_scene(made, 0), &start, nullptr);
    for (int s = 0; s < 20; ++s) palpate_world_touch(made, nullptr, 0, 1e-3, contacts.get(), contacts.bytes());
    palpate_scene_set_pose(palpate_world_scene(made, 0), &poses[0], nullptr);
    for (int s = 0; s < 20; ++s) palpate_world_touch(made, nullptr, 0, 1e-3, contacts.get(), contacts.bytes());
    return contacts.state(0).pressed[2];
  };
  const double linear = pressed(PALPATE_DEFORMATION_LINEAR, PALPATE_DEFORMATION_LINEAR),
               large = pressed(PALPATE_DEFORMATION_LARGE, PALPATE_DEFORMATION_LARGE),
               mixed = pressed(PALPATE_DEFORMATION_LARGE, PALPATE_DEFORMATION_LINEAR);
  EXPECT_GT(mixed, 0.99 * std::min(linear, large));
  EXPECT_LT(mixed, 1.01 * std::max(linear, large));
}

// make -f Makefile.data organ-pushes PUSH_DEFORMATION=1 plays many more.
TEST(LargeOrgans, PushedAtRandomLetNothingThrough) {
  for (const palpate_deformation_model deformation : kLarge) {
    PushCounts counts;
    for (const std::uint64_t seed : {0, 1, 2})
      play_pushes(
          seed, 60, 4, &counts, [](const PassedThrough& found) { ADD_FAILURE() << sentence_of(found); }, deformation);
    EXPECT_GT(counts.pressed, 60);
    EXPECT_LT(counts.largest, 5);
    EXPECT_LT(counts.flagged, deformation == PALPATE_DEFORMATION_LARGE ? 10 : 100);
  }
}

}  // namespace
}  // namespace palpate::tests
