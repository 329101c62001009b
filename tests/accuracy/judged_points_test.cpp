// What the study concludes from what it measured: extrapolation, differences, the chooser.
#include <gmock/gmock.h>

#include <cmath>

#include "bench/accuracy/choose.h"
#include "bench/accuracy/errors_of_points.h"

namespace palpate::accuracy {
namespace {

// q(h) = q0 (1 + c h^p): e21 and e32 of three meshes that are not nested.
Extrapolated of_a_power(double p, double h1, double h2, double h3) {
  const auto q = [p](double h) { return 1 + 0.1 * std::pow(h, p); };
  return richardson((q(h2) - q(h1)) / q(h1), h2 / h1, (q(h3) - q(h2)) / q(h2), h3 / h2);
}

TEST(Richardson, FindsTheOrderAndTheErrorOfAPower) {
  for (const double p : {0.7, 1.0, 1.8}) {
    const auto found = of_a_power(p, 0.2, 0.29, 0.5);
    // Neighbours are divided by their own values, which differ by some per cent: so does the order.
    EXPECT_NEAR(found.order, p, 0.1) << p;
    EXPECT_NEAR(found.error, 1.25 * 0.1 * std::pow(0.2, p), 0.1 * 0.1 * std::pow(0.2, p)) << p;
  }
}

TEST(Richardson, DoesNotBelieveAnOrderAboveTwo) {
  EXPECT_EQ(of_a_power(5, 0.2, 0.29, 0.5).order, 2);
}

TEST(Richardson, TakesTwoMeshesWithAFactorOfThree) {
  EXPECT_DOUBLE_EQ(richardson(0.01, 2).error, 0.03);
}

Observation one_press(double force, double moved) {
  Observation seen;
  seen.presses.push_back({{{force, 0, 0}}, {{moved, 0, 0}, {0, moved, 0}}});
  return seen;
}

TEST(Difference, IsRelativeToTheTruth) {
  const Difference d = difference(one_press(1.1, 2.1e-3), one_press(1, 2e-3));
  EXPECT_NEAR(d.force, 0.1, 1e-12);
  EXPECT_NEAR(d.force_newtons, 0.1, 1e-12);
  EXPECT_NEAR(d.field, 0.05, 1e-12);
  EXPECT_NEAR(d.field_mm, 0.1, 1e-12);
}

nlohmann::ordered_json setting(const char* name, double error, double touch, double megabytes, double seconds) {
  return {{"name", name},         {"own_material", true}, {"solver", "auto"},       {"columns_everywhere", true},
          {"exercise", "press"},  {"law", "sticking"},    {"contacts", 1},          {"is_reference", false},
          {"force_error", error}, {"touch_us", touch},    {"bundle_MB", megabytes}, {"precompute_s", seconds}};
}

class Chooser : public testing::Test {
 protected:
  std::vector<nlohmann::ordered_json> points_ = {setting("coarse", 0.1, 1, 1, 1), setting("middle", 0.03, 5, 20, 10),
                                                 setting("fine", 0.01, 30, 400, 60)};
};

TEST_F(Chooser, TakesTheCheapestWithinAllLimits) {
  const auto* found = cheapest(points_, {{"force_error", "--force-error 5%", 0.05}}, "precompute_s");
  ASSERT_NE(found, nullptr);
  EXPECT_EQ(found->at("name"), "middle");
}

TEST_F(Chooser, LeavesOutWhatNobodyCanHave) {
  points_[1]["columns_everywhere"] = false;
  EXPECT_EQ(cheapest(points_, {{"force_error", "--force-error 5%", 0.05}}, "precompute_s")->at("name"), "fine");
  points_[2]["is_reference"] = true;
  EXPECT_EQ(cheapest(points_, {{"force_error", "--force-error 5%", 0.05}}, "precompute_s"), nullptr);
}

TEST_F(Chooser, SaysWhatStandsInTheWay) {
  const std::vector<Limit> limits = {{"force_error", "--force-error 2%", 0.02}, {"bundle_MB", "--bundle-mb 50", 50}};
  EXPECT_EQ(cheapest(points_, limits, "precompute_s"), nullptr);
  const std::string text = what_stands_in_the_way(points_, limits);
  EXPECT_THAT(
      text, testing::HasSubstr("--force-error 2% stands in the way: with the other limits the least is 3 % (middle)"));
  EXPECT_THAT(text,
              testing::HasSubstr("--bundle-mb 50 stands in the way: with the other limits the least is 400 (fine)"));
}

TEST_F(Chooser, PicksTheSmallestErrorThatEachBudgetAffords) {
  const auto picked = picks(points_);
  ASSERT_EQ(picked.size(), 3u);
  EXPECT_EQ(picked[0].at("pick"), "coarse");
  EXPECT_EQ(picked[1].at("pick"), "middle");
  EXPECT_EQ(picked[2].at("pick"), "fine");
}

TEST_F(Chooser, PicksTheShorterPrecomputeOfTwoThatAreAsGood) {
  points_.push_back(setting("as fine", 0.0105, 30, 400, 50));
  points_.push_back(setting("coarser", 0.012, 30, 400, 1));
  EXPECT_EQ(picks(points_)[2].at("pick"), "as fine");
}

}  // namespace
}  // namespace palpate::accuracy
