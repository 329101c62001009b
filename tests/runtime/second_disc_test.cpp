// A disc that comes down beside another one that is deep in the organ: it begins without a force, never pulls, and ends as it began.
#include "tests/runtime/touched_box.h"
#include "tests/support/grid_body.h"

namespace palpate::tests {
namespace {

using Eigen::Vector3d;

constexpr double kSize = 0.06, kHeight = 0.03, kEdge = 0.0075;

// A block of gel that lies on its bottom.
const TouchedBody& block() {
  static const TouchedBody shared([] {
    GridBody grid;
    const int across = static_cast<int>(kSize / kEdge), down = static_cast<int>(kHeight / kEdge);
    grid.lines = {grid_lines(0, kSize, across), grid_lines(0, kSize, across), grid_lines(0, kHeight, down)};
    grid.held = [](std::array<double, 3> p) { return p[2] == 0; };
    return dense_grid(grid);
  }());
  return shared;
}

struct Course {
  double first_force;           // N, of what was there first, before the disc comes
  std::vector<double> on, off;  // N, of the disc, outward, from step to step: on its way in; on its way out
};

// What is in the organ when the disc comes: another disc, or a node that a grip holds, 4 mm deep.
struct First {
  double radius;  // m; 0: a grip
};

constexpr double kDeep = 0.004, kAbove = 0.0005, kStep = 2e-5;

// A disc that comes down `apart` (m) from the first one, as deep as it, in steps of 20 um, and goes back.
class SecondDisc : public testing::Test {
 public:
  void start(palpate_contact_law law, First first, double radius, double apart) {
    scene_ = std::make_unique<TouchedScene>(block(), unlimited_def(PALPATE_COLLISION_DEFORMED, law));
    first_ = first, radius_ = radius, node_ = -1;
    place_ = {0.027, 0.029, kHeight};
    for (const std::int32_t n : block().touchable)
      if (first.radius == 0 && block().node(n)[2] == kHeight &&
          (node_ < 0 || (block().node(n) - place_).norm() < (block().node(node_) - place_).norm()))
        node_ = n;
    if (node_ >= 0) place_ = block().node(node_);
    beside_ = place_ + Vector3d(0.8 * apart, 0.6 * apart, 0);
  }
  // Both go so deep, m. Returns the force on the second one, N.
  double move(double first, double second) {
    const Vector3d point[2] = {place_ - first * Vector3d::UnitZ(), beside_ - second * Vector3d::UnitZ()};
    const palpate_grip grip = grip_at_node(node_, {0, 0, -first});
    const palpate_tool tools[2] = {node_ >= 0 ? grip_tool(&grip) : point_tool(point[0].data(), 1, first_.radius, 0.5),
                                   point_tool(point[1].data(), 1, radius_, 0.5)};
    // A disc that slides into the dent of one node, which no mesh resolves, may not meet its law in the step in which it comes.
    const palpate_step_flags may_raise = node_ >= 0 ? PALPATE_STEP_SOLVE_INEXACT : 0;
    EXPECT_EQ(scene_->touch(tools) & ~may_raise, 0u);
    first_force = scene_->force(0)[2];
    return scene_->force(1)[2];
  }
  Course play() {
    for (double first = -kAbove; first < kDeep; first += 1e-4) move(first, -0.01);
    Course course = {first_force, {}, {}};
    const int steps = static_cast<int>((kDeep + kAbove) / kStep);
    for (int s = 0; s <= steps; ++s) course.on.push_back(move(kDeep, -kAbove + s * kStep));
    for (int s = steps; s >= 0; --s) course.off.push_back(move(kDeep, -kAbove + s * kStep));
    return course;
  }
  double first_force = 0;  // N

 private:
  std::unique_ptr<TouchedScene> scene_;
  First first_ = {};
  double radius_ = 0;
  std::int32_t node_ = -1;
  Vector3d place_, beside_;
};

double least_of(const std::vector<double>& force) {
  return *std::min_element(force.begin(), force.end());
}
// N, the largest change from one step to the next.
double largest_step(const std::vector<double>& force) {
  double most = 0;
  for (std::size_t s = 1; s < force.size(); ++s) most = std::max(most, std::abs(force[s] - force[s - 1]));
  return most;
}

// A step of 20 um changes the force of a disc that holds by up to 1.7 % of the first one's: no more may come or go at once. A contact
// under `sliding` ends in the step after the one in which its force passes zero, so it may pull as much.
constexpr double kOneStep = 0.02;

void expect_smooth(const Course& course, const std::string& what) {
  ASSERT_GT(course.first_force, 0.01) << what;
  EXPECT_GT(course.on.back(), 0.1 * course.first_force) << what;
  EXPECT_GE(least_of(course.on), -1e-9) << what;
  EXPECT_GE(least_of(course.off), -kOneStep * course.first_force) << what;
  EXPECT_LE(largest_step(course.on), kOneStep * course.first_force) << what;
  EXPECT_LE(largest_step(course.off), kOneStep * course.first_force) << what;
  EXPECT_EQ(course.on.front(), 0) << what;
  EXPECT_EQ(course.off.back(), 0) << what;
}

TEST_F(SecondDisc, BesideADeepOneBeginsAndEndsWithoutAForceAndNeverPulls) {
  for (const auto law : kEveryLaw)
    for (const double radius : {0.003, 0.006})
      for (const double share : {1.0, 0.5})
        for (const double radii : {0.5, 1.0, 2.0}) {
          start(law, {radius}, share * radius, radii * radius);
          expect_smooth(play(), "law " + std::to_string(law) + ", " + std::to_string(radius) + " and " +
                                    std::to_string(share * radius) + " m, " + std::to_string(radii) + " radii apart");
        }
}

// The disc meets the mean of a dent that is narrower than it is, not the place below its centre.
TEST_F(SecondDisc, BesideANodeThatAGripPressesBeginsAndEndsWithoutAForceAndNeverPulls) {
  for (const auto law : kEveryLaw)
    for (const double apart : {0.0015, 0.003, 0.006}) {
      start(law, {0}, 0.003, apart);
      expect_smooth(play(), "law " + std::to_string(law) + ", " + std::to_string(apart) + " m apart");
    }
}

TEST_F(SecondDisc, HasTheForceOfALoneOneWhenTheFirstOneHasGone) {
  for (const auto law : kEveryLaw) {
    double force[2];
    for (const bool alone : {false, true}) {
      start(law, {0.003}, 0.003, 0.0015);
      const double deep = alone ? -0.01 : kDeep;
      for (double first = -kAbove; first < deep; first += 1e-4) move(first, -0.01);
      for (double second = -kAbove; second < kDeep; second += 1e-4) move(deep, second);
      for (double first = deep; first > -0.01; first -= 1e-4) move(first, kDeep);
      for (int step = 0; step < 30; ++step) force[alone] = move(-0.01, kDeep);  // a disc that slides comes to rest
    }
    // The disc under friction and `sticking` still holds the place that it met in the dent of the first one, 0.1 mm aside.
    EXPECT_NEAR(force[0], force[1], 0.01 * force[1]) << law;
  }
}

}  // namespace
}  // namespace palpate::tests
