// A step's counted operations: what does not fit is told, is done by the next steps, and is not lost.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <vector>

#include "runtime/base/step_work.h"
#include "tests/runtime/sliding_crowd.h"
#include "tests/runtime/touched_box.h"

namespace palpate::tests {
namespace {

using Eigen::Vector3d;

TEST(Turns, GiveEachJobItsTurnWhereOnlyOneFits) {
  Turns turns;
  std::vector<std::int32_t> done;
  for (int step = 0; step < 8; ++step) {
    turns.begin();
    bool fits = true;
    for (const std::int32_t key : {2, 5, 6, 9})
      if (turns.take(key / 4, key % 4, fits)) {
        done.push_back(key);
        fits = false;
      }
  }
  EXPECT_EQ(done, (std::vector<std::int32_t>{2, 5, 6, 9, 2, 5, 6, 9}));
}

TEST(Turns, DoTheFirstJobWhateverItCosts) {
  Turns turns;
  turns.begin();
  EXPECT_TRUE(turns.take(0, 3, false));
  EXPECT_FALSE(turns.take(1, 0, false));
}

// Points over one face of a box, pressed in together and drawn back together.
class Brush {
 public:
  static constexpr int kSide = 3, kPoints = kSide * kSide;
  Brush(std::int64_t most_operations, palpate_contact_law law) {
    palpate_scene_def def = palpate_default_scene_def();
    def.collision = PALPATE_COLLISION_DEFORMED, def.contact = PALPATE_CONTACT_POINT, def.law = law;
    def.max_operations = most_operations;
    scene_ = box().scene(def);
    contacts_ = std::make_unique<Contacts>(scene_.get());
    tool_.points = points_[0].data(), tool_.point_count = kPoints, tool_.friction = 0.3;
  }
  // height: m, of the points above the face.
  palpate_step_flags step(double height) {
    const std::int32_t t = box().far_triangle();
    const double face = box().node(box().body.triangles[t][0])[0];
    Vector3d low = Vector3d::Constant(INFINITY), high = -low;
    for (const auto& n : box().body.mesh.nodes)
      for (int d = 0; d < 3; ++d) low[d] = std::min(low[d], n[d]), high[d] = std::max(high[d], n[d]);
    for (int i = 0; i < kPoints; ++i)
      for (int d = 1; d < 3; ++d) {
        const double share = (0.5 + (d == 1 ? i % kSide : i / kSide)) / kSide;
        points_[i][0] = face + height, points_[i][d] = low[d] + share * (high[d] - low[d]);
      }
    return palpate_scene_touch(scene_.get(), &tool_, 1, 1e-3, contacts_->get(), contacts_->bytes());
  }
  int in_contact() { return palpate_contacts_tool(contacts_->get(), 0)->contact_count; }
  palpate_contacts* contacts() { return contacts_->get(); }
  palpate_scene* scene() { return scene_.get(); }

 private:
  static TouchedBox& box() {
    static TouchedBox one;
    return one;
  }
  ScenePointer scene_;
  std::unique_ptr<Contacts> contacts_;
  std::vector<Vector3d> points_ = std::vector<Vector3d>(kPoints);
  palpate_tool tool_ = palpate_default_tool();
};

// The fewest operations leave each step one test, so all of them take a few times as many steps as there are points.
TEST(StepWork, ThatDoesNotFitIsToldAndDoneByTheNextSteps) {
  for (const palpate_contact_law law : {PALPATE_LAW_STICKING, PALPATE_LAW_SLIDING, PALPATE_LAW_COULOMB}) {
    Brush brush(1, law);
    const auto steps_until = [&](double height, int contacts) {
      int steps = 0;
      for (bool told = true; steps < 8 * Brush::kPoints && (told || brush.in_contact() != contacts); ++steps)
        told = (brush.step(height) & PALPATE_STEP_WORK_DEFERRED) != 0;
      EXPECT_EQ(brush.in_contact(), contacts) << law << " at " << height;
      return steps;
    };
    EXPECT_GT(steps_until(0.001, 0), 1) << "see all points outside";
    // So little that no point leaves the others in the dent that it makes.
    EXPECT_GT(steps_until(-0.0002, Brush::kPoints), 1);
    EXPECT_GT(steps_until(0.001, 0), 1);
    if (::testing::Test::HasFailure()) return;
  }
}

TEST(StepWork, ThatFitsIsDoneAtOnce) {
  Brush brush(std::numeric_limits<std::int64_t>::max(), PALPATE_LAW_SLIDING);
  for (const double height : {0.001, -0.0002, -0.0004, 0.001}) {
    EXPECT_EQ(brush.step(height) & PALPATE_STEP_WORK_DEFERRED, 0u);
    if (height < 0) {
      EXPECT_EQ(brush.in_contact(), Brush::kPoints);
    }
  }
}

TEST(StepWork, StaysBelowWhatThePlanStates) {
  for (const palpate_contact_law law : {PALPATE_LAW_STICKING, PALPATE_LAW_SLIDING, PALPATE_LAW_COULOMB})
    for (const std::int64_t most : {std::int64_t{1}, std::int64_t{20'000}, std::int64_t{300'000}}) {
      Brush brush(most, law);
      std::int64_t bound = 0;
      for (const palpate_plan_pass& pass : plan_of(brush.scene())) bound += pass.most_operations;
      EXPECT_GE(bound, most);
      std::int64_t worst = 0;
      for (int s = 0; s < 200; ++s) {
        brush.step(0.001 - 0.004 * std::fabs(std::sin(0.2 * s)));
        worst = std::max<std::int64_t>(worst, brush.contacts()->operations);
      }
      EXPECT_GT(worst, 0);
      EXPECT_LE(worst, bound) << law << " " << most;
    }
}

// What a step has counted when its pass `collision` ends, the most of all steps.
struct CountedCollision {
  explicit CountedCollision(SlidingCrowd& crowd) : scene(*crowd.scene) {
    palpate_watch_passes(
        &scene, [](void* self, std::int32_t pass) { static_cast<CountedCollision*>(self)->note(pass); }, this);
  }
  void note(std::int32_t pass) {
    if (pass == scene.watch.index_in_plan[static_cast<std::int32_t>(Pass::collision)])
      worst = std::max<std::int64_t>(worst, scene.touch.work.done());
  }
  palpate_scene& scene;
  std::int64_t worst = 0;
};

// Sixty-four points, of which a step can test some: a test that looks at the whole surface ends where the limit is.
TEST(StepWork, OfTheCollisionOfAHostileSceneStaysWithinThreeQuartersOfTheLimit) {
  constexpr std::int64_t most = 200'000;
  SlidingCrowd crowd(PALPATE_CONTACT_POINT, PALPATE_LAW_STICKING, most);
  CountedCollision counted(crowd);
  int deferred = 0;
  for (int s = 0; s < 2000; ++s) {
    crowd.step();
    deferred += (crowd.flags & PALPATE_STEP_WORK_DEFERRED) != 0;
  }
  EXPECT_GT(deferred, 100);
  EXPECT_LE(counted.worst, most - most / 4);
}

TEST(StepWork, CountsTheSameInEveryRun) {
  std::vector<std::int32_t> counts[2];
  for (auto& run : counts) {
    Brush brush(20'000, PALPATE_LAW_COULOMB);
    for (int s = 0; s < 100; ++s) {
      brush.step(0.001 - 0.00005 * s);
      run.push_back(brush.contacts()->operations);
    }
  }
  EXPECT_EQ(counts[0], counts[1]);
}

TEST(StepWork, IsRefusedWhereNoneIsAllowed) {
  palpate_scene_def def = palpate_default_scene_def();
  for (const std::int64_t most : {std::int64_t{0}, std::int64_t{-1}}) {
    def.max_operations = most;
    palpate_scene* scene = nullptr;
    palpate_error error = {};
    TouchedBox box;
    EXPECT_EQ(palpate_scene_create(box.bundle(), &def, &scene, &error), PALPATE_ERROR_ARGUMENT);
    EXPECT_NE(std::string(error.text).find("max_operations"), std::string::npos) << error.text;
  }
}

TEST(StepWork, OfAMachineIsMeasured) {
  EXPECT_GT(palpate_operations_in(300), 0);
  EXPECT_EQ(palpate_operations_in(0), 0);
  EXPECT_EQ(palpate_operations_in(NAN), 0);
}

}  // namespace
}  // namespace palpate::tests
