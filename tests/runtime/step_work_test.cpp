// A step's counted operations: what does not fit is told, is done by the next steps, and is not lost.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <vector>

#include "runtime/base/step_work.h"
#include "tests/runtime/asked_scene.h"
#include "tests/runtime/sliding_crowd.h"

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

TEST(Turns, BeginWithTheFirstJobThatDidNotFit) {
  Turns turns;
  turns.begin();
  EXPECT_FALSE(turns.take(0, 3, false));
  EXPECT_FALSE(turns.take(1, 0, false));
  turns.begin();
  EXPECT_FALSE(turns.take(0, 1, true));
  EXPECT_TRUE(turns.take(0, 3, true));
}

TEST(Turns, BeginWithTheFirstPointOfTheFirstToolWhereThatDidNotFit) {
  Turns turns;
  turns.begin();
  EXPECT_FALSE(turns.take(0, 0, false));
  EXPECT_FALSE(turns.take(0, 1, false));
  turns.begin();
  EXPECT_TRUE(turns.take(0, 0, true));
  turns.put_off(0, 0);
  EXPECT_FALSE(turns.take(0, 1, false));
  turns.begin();
  EXPECT_TRUE(turns.take(0, 0, true));
}

// Whatever the solution needs and the last step owes, tests have something, and all shares together do not exceed the step's operations.
TEST(Shares, LeaveTestsSomethingAndStayWithinTheStep) {
  for (const Operations most : {Operations{16'000}, Operations{300'000}, kUnlimitedOperations})
    for (const double least : {0.0, 0.1, 0.3, 0.6, 0.62}) {
      StepWork work;
      work.create(most);
      const auto needed = static_cast<Operations>(least * static_cast<double>(most));
      work.keep_for_solution(needed);
      work.owe(work.debts_left());
      work.owe_change(work.first_debt_left());
      work.begin();
      EXPECT_EQ(work.paid_changes(), 1);
      work.keep_for_solution(needed);
      EXPECT_GT(work.tests_left(), most / 32) << least;
      EXPECT_GT(work.tests_have(), most / 32) << least;
      work.add(work.tests_left());
      EXPECT_GT(work.changes_left(0), most / 32) << least;
      EXPECT_EQ(work.first_change_left(most / 8 * 6), -1);
      work.add(work.first_change_left(0));
      EXPECT_GE(work.left(), needed) << least;
      EXPECT_LE(work.done(), most);
    }
}

// The fewest operations that the sentence of a refusal names; 0: the definition is not refused.
std::int64_t fewest_of(const TouchedBox& box, const SceneDef& def) {
  const palpate_error error = refusal_of(box, def);
  const char* const number = std::strstr(error.text, "expected ");
  return number ? std::strtoll(number + std::strlen("expected "), nullptr, 10) : 0;
}

// About as few as a scene on the box below may have (IsRefusedWhereItIsLessThanAStepNeeds), and one on that of SlidingCrowd.
constexpr std::int64_t kFewest = 35'000, kFew = 60'000;

// Points over one face of a box, pressed in together and drawn back together.
class Brush : public TouchedScene {
 public:
  static constexpr int kSide = 3, kPoints = kSide * kSide;
  Brush(std::int64_t most_operations, palpate_contact_law law)
      : TouchedScene(tiny_box(),
                     with_operations(with(SceneDef(), PALPATE_COLLISION_DEFORMED, PALPATE_CONTACT_POINT, law),
                                     most_operations)) {}
  // height: m, of the points above the face.
  palpate_step_flags step(double height) {
    const Vector3d size(TinyBox().size.data());
    std::vector<Vector3d> points;
    for (int row = 0; row < kSide; ++row)
      for (int i = 0; i < kSide; ++i)
        points.emplace_back(size[0] + height, (0.5 + i) / kSide * size[1], (0.5 + row) / kSide * size[2]);
    return touch({point_tool(points[0].data(), kPoints, 0, 0.3)});
  }
  int in_contact() const { return tool().contact_count; }
};

// So few operations leave a step some tests, so that all of them take several steps.
TEST(StepWork, ThatDoesNotFitIsToldAndDoneByTheNextSteps) {
  for (const palpate_contact_law law : {PALPATE_LAW_STICKING, PALPATE_LAW_SLIDING, PALPATE_LAW_COULOMB}) {
    Brush brush(kFewest, law);
    const auto steps_until = [&](double height, int contacts) {
      int steps = 0;
      for (bool told = true; steps < 8 * Brush::kPoints && (told || brush.in_contact() != contacts); ++steps)
        told = (brush.step(height) & PALPATE_STEP_WORK_DEFERRED) != 0;
      EXPECT_EQ(brush.in_contact(), contacts) << law << " at " << height;
      return steps;
    };
    EXPECT_GT(steps_until(0.001, 0), 0) << "see all points outside";
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
    for (const std::int64_t most : {kFewest, std::int64_t{100'000}, std::int64_t{300'000}}) {
      Brush brush(most, law);
      const std::int64_t bound = palpate_scene_most_operations(brush.get());
      EXPECT_EQ(bound, most);
      std::int64_t of_passes = 0;
      for (const palpate_plan_pass& pass : plan_of(brush.get())) of_passes += pass.most_operations;
      EXPECT_GE(of_passes, bound);
      std::int64_t worst = 0;
      for (int s = 0; s < 200; ++s) {
        brush.step(0.001 - 0.004 * std::fabs(std::sin(0.2 * s)));
        worst = std::max<std::int64_t>(worst, brush.contacts->operations);
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
TEST(StepWork, OfTheCollisionOfAHostileSceneLeavesAnEighthOfTheLimit) {
  constexpr std::int64_t most = 200'000;
  SlidingCrowd crowd(PALPATE_CONTACT_POINT, PALPATE_LAW_STICKING, most);
  CountedCollision counted(crowd);
  int deferred = 0;
  for (int s = 0; s < 2000; ++s) {
    crowd.step();
    deferred += (crowd.flags & PALPATE_STEP_WORK_DEFERRED) != 0;
  }
  EXPECT_GT(deferred, 100);
  EXPECT_LE(counted.worst, most - most / 8);
}

TEST(StepWork, CountsTheSameInEveryRun) {
  std::vector<std::int32_t> counts[2];
  for (auto& run : counts) {
    Brush brush(kFewest, PALPATE_LAW_COULOMB);
    for (int s = 0; s < 100; ++s) {
      brush.step(0.001 - 0.00005 * s);
      run.push_back(brush.contacts->operations);
    }
  }
  EXPECT_EQ(counts[0], counts[1]);
}

// The most that a step of the play counts. step(s) plays step s and returns its contacts.
template <class Step>
std::int64_t most_counted(int steps, Step step) {
  std::int64_t most = 0;
  for (int s = 0; s < steps; ++s) {
    const palpate_contacts* contacts = step(s);
    most = std::max<std::int64_t>(most, contacts->operations);
    for (int t = 0; t < contacts->tool_count; ++t)
      for (const double f : palpate_contacts_tool(contacts, t)->force) EXPECT_TRUE(std::isfinite(f));
  }
  return most;
}

TEST(StepWork, OfSixtyFourPointsThatHoverPressSlideAndJumpStaysWithinTheBound) {
  for (const palpate_contact_law law : {PALPATE_LAW_STICKING, PALPATE_LAW_COULOMB})
    for (const palpate_contact_model contact : {PALPATE_CONTACT_POINT, PALPATE_CONTACT_TRIANGLE, PALPATE_CONTACT_PATCH})
      for (const std::int64_t most : {kFew, std::int64_t{300'000}}) {
        SlidingCrowd crowd(contact, law, most);
        for (palpate_tool& tool : crowd.tools)
          tool.friction = 0.3, tool.disc_radius = contact == PALPATE_CONTACT_PATCH ? 0.005 : 0;
        EXPECT_EQ(palpate_scene_most_operations(crowd.scene.get()), most);
        const std::int64_t counted = most_counted(600, [&](int) {
          crowd.step();
          return crowd.contacts.get();
        });
        EXPECT_GT(counted, most / 2);
        EXPECT_LE(counted, most) << law << " " << contact;
      }
}

// Grips in one triangle, each with a displacement of its own, that all come at once, move, and go.
class GripCrowd : public TouchedScene {
 public:
  static constexpr int kGrips = 350;
  // most_operations: 0 for the fewest.
  explicit GripCrowd(std::int64_t most_operations, palpate_contact_model contact = PALPATE_CONTACT_POINT)
      : TouchedScene(SlidingCrowd::box(), def_of(most_operations, contact)) {}
  static SceneDef def_of(std::int64_t most_operations, palpate_contact_model contact) {
    SceneDef def = with(SceneDef(), PALPATE_COLLISION_OFF, contact);
    def.max_points = kGrips, def.max_contact_nodes = 3 * kGrips,
    def.max_operations = std::max<std::int64_t>(most_operations, 1);
    if (most_operations == 0) def.max_operations = fewest_of(SlidingCrowd::box(), def);
    return def;
  }
  // moved: all of them hold other places than before.
  palpate_step_flags step(int count, bool moved) {
    if (moved || grips.empty()) {
      grips.clear();
      for (int g = 0; g < kGrips; ++g) {
        const double a = random(0, 1), b = random(0, 1 - a);
        grips.push_back(grip_at_place(SlidingCrowd::box().far_triangle(), {a, b, 1 - a - b},
                                      {random(-1e-3, 1e-3), random(-1e-3, 1e-3), random(-1e-3, 1e-3)}));
      }
    }
    return touch({grip_tool(grips.data(), count)});
  }
  int held() { return tool().contact_count; }
  WanderingRandom random;
  std::vector<palpate_grip> grips;
};

TEST(StepWork, OfHundredsOfGripsInOneTriangleStaysWithinTheBound) {
  for (const auto contact : {PALPATE_CONTACT_POINT, PALPATE_CONTACT_TRIANGLE, PALPATE_CONTACT_PATCH})
    for (const std::int64_t wanted : {0, 300'000}) {
      GripCrowd crowd(wanted, contact);
      const std::int64_t most = palpate_scene_most_operations(crowd.scene.get());
      EXPECT_EQ(wanted > 0 ? wanted : most, most);
      const std::int64_t counted = most_counted(200, [&](int s) {
        const int count = s % 100 > 90 ? 0 : GripCrowd::kGrips;
        const palpate_step_flags flags = crowd.step(count, s % 10 == 9);
        EXPECT_TRUE(crowd.held() >= count || (flags & (PALPATE_STEP_WORK_DEFERRED | PALPATE_STEP_CONTACTS_DROPPED)));
        return crowd.contacts.get();
      });
      EXPECT_GT(counted, most / 2) << contact;
      EXPECT_LE(counted, most) << contact;
    }
}

// A step has room for some of them. The others come as the next steps have room, and those that fit into no step stay told.
TEST(StepWork, LetsGripsComeInTheStepsThatHaveRoomForThem) {
  GripCrowd crowd(300'000);
  EXPECT_NE(crowd.step(GripCrowd::kGrips, false) & PALPATE_STEP_WORK_DEFERRED, 0u);
  const int at_first = crowd.held();
  EXPECT_GT(at_first, 20);
  EXPECT_LT(at_first, GripCrowd::kGrips);
  for (int s = 0, before = at_first; s < 300; ++s, before = crowd.held()) {
    EXPECT_NE(crowd.step(GripCrowd::kGrips, false) & PALPATE_STEP_WORK_DEFERRED, 0u);
    EXPECT_GE(crowd.held(), before);
  }
  EXPECT_GT(crowd.held(), 150);
  // As many as fit are all held at once by a step that has room for them.
  GripCrowd roomy(INT64_MAX);
  EXPECT_EQ(roomy.step(GripCrowd::kGrips, false) & PALPATE_STEP_WORK_DEFERRED, 0u);
  EXPECT_EQ(roomy.held(), GripCrowd::kGrips);
}

TEST(StepWork, OfPointsThatHoverOverADentedSurfaceStaysWithinTheBound) {
  constexpr int points = 43;
  SceneDef def;
  def.collision = PALPATE_COLLISION_DEFORMED, def.contact = PALPATE_CONTACT_POINT, def.max_contact_nodes = 600;
  TouchedScene scene(SlidingCrowd::box(), def);
  const VisitedSurface surface(SlidingCrowd::box().bundle());
  WanderingRandom random;
  std::vector<VisitedSurface::Point> at(points);
  std::vector<palpate_grip> grips;
  const std::int64_t counted = most_counted(600, [&](int s) {
    grips.clear();
    for (int g = 0; g < 20; ++g) {
      const std::int32_t n = surface.touchable[(7 * g) % surface.touchable.size()];
      grips.push_back(grip_at_node(n, -2e-3 * std::sin(0.3 * s + g) * Vector3d::Map(surface.normal[n].data())));
    }
    for (int p = 0; p < points; ++p) {
      const std::int32_t n = surface.touchable[(5 * p) % surface.touchable.size()];
      for (int d = 0; d < 3; ++d) at[p][d] = surface.place[n][d] + 1e-3 * surface.normal[n][d] + random(-1e-4, 1e-4);
    }
    palpate_tool tools[2] = {tool_of(grips), palpate_default_tool()};
    tools[1].points = at[0].data(), tools[1].point_count = points;
    scene.touch(tools);
    return scene.contacts.get();
  });
  EXPECT_GT(counted, def.max_operations / 2);
  EXPECT_LE(counted, palpate_scene_most_operations(scene.get()));
  EXPECT_EQ(palpate_scene_most_operations(scene.get()), def.max_operations);
}

TEST(StepWork, IsRefusedWhereItIsLessThanAStepNeeds) {
  SceneDef def;
  for (const std::int64_t most : {-1, 0, 1, 9'999}) {
    def.max_operations = most;
    EXPECT_THROW(tiny_box().scene(def), std::runtime_error) << most;
  }
  const std::int64_t fewest = fewest_of(tiny_box(), def);
  EXPECT_GT(fewest, 9'999);
  EXPECT_LT(fewest, kFewest);
  def.max_operations = fewest;  // which suffice
  EXPECT_EQ(palpate_scene_most_operations(tiny_box().scene(def).get()), fewest);
  def.max_operations = fewest - 1;
  EXPECT_EQ(fewest_of(tiny_box(), def), fewest);
}

// A step takes its input and looks at each point, however far they are: a scene has the operations for all that it may get.
TEST(StepWork, OfPointsFarAwayIsCountedAndASceneOfMoreThanFitIsRefused) {
  for (const palpate_collision collision : {PALPATE_COLLISION_REST, PALPATE_COLLISION_DEFORMED}) {
    SceneDef def;
    def.collision = collision, def.contact = PALPATE_CONTACT_POINT, def.max_tools = 1, def.max_points = 100'000;
    const std::int64_t fewest = fewest_of(tiny_box(), def);
    ASSERT_GT(fewest, StepWork::kOfPoint * def.max_points);
    def.max_operations = fewest;
    TouchedScene scene(tiny_box(), def);
    std::vector<double> points(3 * def.max_points, 1.0);
    const palpate_tool tool = point_tool(points.data(), def.max_points);
    for (int s = 0; s < 3; ++s) {
      scene.touch({tool});
      EXPECT_GE(scene.contacts->operations, StepWork::kOfPoint * def.max_points);
      EXPECT_LE(scene.contacts->operations, palpate_scene_most_operations(scene.get()));
    }
  }
}

// Grips along one direction, each with a disc so small that it has few nodes: what they take is the discs.
class DiscCrowd : public TouchedScene {
 public:
  static constexpr int kGrips = 20;
  explicit DiscCrowd(std::int64_t most_operations)
      : TouchedScene(SlidingCrowd::box(),
                     with_operations(with(SceneDef(), PALPATE_COLLISION_OFF, PALPATE_CONTACT_PATCH), most_operations)) {
  }
  // shift: where in its triangle each grip is.
  palpate_step_flags step(int count, double shift, double radius = 1e-3) {
    std::vector<palpate_grip> grips;
    for (int g = 0; g < count; ++g)
      grips.push_back(
          grip_at_place(SlidingCrowd::box().far_triangle(g), {0.3 + shift, 0.3, 0.4 - shift}, {-1e-4, 0, 0}, 1));
    return hold(grips, radius);
  }
  std::int64_t operations() const { return contacts->operations; }
  // Grips whose discs are where they were asked for.
  int at(double shift) const {
    const ContactConstraints& set = scene->touch.rows.set();
    return static_cast<int>(
        std::count_if(set.constraints, set.constraints + set.constraint_count,
                      [&](const ContactConstraint& c) { return c.surface_point.barycentric[0] == 0.3 + shift; }));
  }
};

TEST(StepWork, CountsEachDiscThatIsComputedAnew) {
  constexpr int discs = 4;
  DiscCrowd crowd(INT64_MAX);
  crowd.step(discs, 0);
  crowd.step(discs, 0);
  const std::int64_t standing = crowd.operations();
  EXPECT_LT(standing, discs * ContactPatch::kToPress);
  crowd.step(discs, 0.05);
  EXPECT_GT(crowd.operations(), standing + discs * ContactPatch::kToPress) << "at other places";
  crowd.step(discs, 0.05, 1.5e-3);
  EXPECT_GT(crowd.operations(), standing + discs * ContactPatch::kToPress) << "of another radius";
}

TEST(StepWork, LetsDiscsMoveInTheStepsThatHaveRoomToComputeThem) {
  constexpr std::int64_t most = 100'000;  // the rows of all discs take 82,000 in a step, and the discs 40,000
  DiscCrowd crowd(most);
  for (const double shift : {0.0, 0.05, 0.1}) {
    int there = 0, steps = 0;
    for (; there < DiscCrowd::kGrips && steps < 20; ++steps) {
      const bool told = (crowd.step(DiscCrowd::kGrips, shift) & PALPATE_STEP_WORK_DEFERRED) != 0;
      const int before = there;
      there = crowd.at(shift);
      EXPECT_LE((there - before) * ContactPatch::kToPress, most);
      EXPECT_LE(crowd.operations(), most);
      EXPECT_EQ(told, there < DiscCrowd::kGrips) << shift << " " << steps;
    }
    EXPECT_EQ(there, DiscCrowd::kGrips) << shift;
    EXPECT_GT(steps, 1) << shift;
  }
}

TEST(StepWork, OfAMachineIsMeasured) {
  EXPECT_GT(palpate_operations_in(300), 0);
  EXPECT_EQ(palpate_operations_in(0), 0);
  EXPECT_EQ(palpate_operations_in(NAN), 0);
}

}  // namespace
}  // namespace palpate::tests
