// What the study concludes from what it measured: extrapolation, differences, the chooser.
#include <gmock/gmock.h>

#include <cmath>

#include "studies/accuracy/choose.h"
#include "studies/accuracy/errors_of_points.h"

namespace palpate::accuracy {
namespace {

// Distances to the finest of meshes with q(h) = q0 + c h^p, the finest of spacing 1 and error c.
std::vector<DistanceToFinest> of_a_power(double p, double c, std::initializer_list<double> spacings) {
  std::vector<DistanceToFinest> distances;
  for (const double h : spacings) distances.push_back({h, c * (std::pow(h, p) - 1)});
  return distances;
}

TEST(Extrapolation, FindsTheOrderAndTheErrorOfAPower) {
  for (const double p : {0.7, 1.0, 1.8}) {
    const Extrapolated found = extrapolate(of_a_power(p, 0.02, {1.3, 1.9, 2.8, 4.1}));
    EXPECT_TRUE(found.order_observed);
    EXPECT_NEAR(found.order, p, 0.011) << p;            // the order's steps are 0.01
    EXPECT_NEAR(found.error, 1.25 * 0.02, 0.001) << p;  // a step of the order moves it by some per cent
    EXPECT_NEAR(found.scatter, 0, 1e-3) << p;
  }
}

TEST(Extrapolation, TakesFirstOrderAndAFactorOfThreeWhereItSeesNoOrder) {
  const Extrapolated steep = extrapolate(of_a_power(5, 0.02, {1.3, 1.9, 2.8, 4.1}));
  EXPECT_FALSE(steep.order_observed);
  EXPECT_EQ(steep.order, 1);
  EXPECT_GT(steep.error, 3 * 0.02);
  const Extrapolated two = extrapolate(of_a_power(1, 0.02, {2}));
  EXPECT_FALSE(two.order_observed);
  EXPECT_NEAR(two.error, 3 * 0.02, 1e-12);
}

TEST(Extrapolation, AddsTheScatterOfMeshesThatAreNotNested) {
  auto distances = of_a_power(1, 0.02, {1.3, 1.9, 2.8, 4.1});
  const double smooth = extrapolate(distances).error;
  for (std::size_t i = 0; i < distances.size(); ++i) distances[i].distance += i % 2 ? 0.01 : -0.004;
  const Extrapolated rough = extrapolate(distances);
  EXPECT_GT(rough.scatter, 0.004);
  EXPECT_GT(rough.error, smooth);
}

TEST(Extrapolation, SaysNothingOfOneMesh) {
  EXPECT_TRUE(std::isnan(extrapolate({}).error));
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

// Measured points whose force errs by c (149 / vertices)^(order / 3) and whose field errs by twice that, plus a share of its own.
class AccuracyReference : public testing::Test {
 protected:
  void add(const char* element, const char* resolution, int vertices, double c, double order, double more = 0) {
    const double error = c * std::pow(149.0 / vertices, order / 3) + more;
    Setting s;
    s.bundle.element = element, s.bundle.resolution = resolution;
    measured_.push_back({s, {{"vertices", vertices}}, one_press(1 + error, 1 + 2 * error)});
  }
  void add_meshes(const char* element, int count, double c, double order) {
    constexpr int kVertices[] = {149, 563, 1696, 5287, 10479, 19656, 98373};
    for (int m = 0; m < count; ++m) add(element, std::to_string(kVertices[m]).c_str(), kVertices[m], c, order);
  }
  std::vector<JudgedPoint> judged(const std::set<std::string>& axes = {"reference"}) const {
    std::vector<PlannedMeasurement> planned;
    for (const auto& point : measured_) planned.push_back({&point, axes});
    return judge(planned);
  }
  JudgedPoint reference() const {
    for (const auto& point : judged())
      if (point.is_reference) return point;
    return {};
  }
  std::string name() const {
    const JudgedPoint found = reference();
    return found.point ? name_of(found.point->setting) : "none";
  }

  std::vector<MeasuredPoint> measured_;
};

TEST_F(AccuracyReference, IsTheFinestMeshOfQuadraticElements) {
  add_meshes("p2-p0", 6, 0.1, 1);
  EXPECT_EQ(name(), "19656 p2-p0");
}

TEST_F(AccuracyReference, IsTheOtherElementOnAFinerMeshWithSmallerEstimates) {
  add_meshes("p2-p0", 6, 0.1, 0.8);
  add_meshes("p1-anp", 7, 0.1, 1.2);
  EXPECT_EQ(name(), "98373 p1-anp");
  const TruthError error = reference().reference_error;
  EXPECT_NEAR(error.force.error, 1.25 * 0.1 * std::pow(149.0 / 98373, 0.4), 0.002);  // the meshes of its own element
  EXPECT_EQ(error.check.vertices, 19656);
  EXPECT_NEAR(error.range.least_force, error.force.error, 1e-3);  // meshes that follow one power: none of them matters
  EXPECT_NEAR(error.range.most_force, error.force.error, 1e-3);
  ASSERT_NE(error.other.point, nullptr);
  EXPECT_EQ(name_of(error.other.point->setting), "19656 p2-p0");
  EXPECT_GT(error.other.force.error, error.force.error);
  const double apart = 0.1 * (std::pow(149.0 / 19656, 0.8 / 3) - std::pow(149.0 / 98373, 0.4));
  EXPECT_NEAR(error.other.distance.force, apart, 0.02 * apart);  // relative to a force that is a little above 1
}

TEST_F(AccuracyReference, TellsWhatTheEstimateIsWithoutOneMesh) {
  add("p2-p0", "149", 149, 0.1, 1, 0.05);  // the coarsest mesh is out of line
  for (const int vertices : {563, 1696, 5287}) add("p2-p0", std::to_string(vertices).c_str(), vertices, 0.1, 1);
  const TruthError error = reference().reference_error;
  EXPECT_LT(error.range.least_force, error.range.most_force);
  // Without that mesh the others follow one power.
  const double without = 1.25 * 0.1 * std::cbrt(149.0 / 5287);
  EXPECT_LE(error.range.least_force, without + 0.002);
  EXPECT_GE(error.range.most_force, without - 0.002);
}

TEST_F(AccuracyReference, StaysQuadraticWhereTheEstimatesAreNotBothSmaller) {
  add_meshes("p2-p0", 6, 0.02, 1.2);
  add_meshes("p1-anp", 7, 0.1, 0.8);
  EXPECT_EQ(name(), "19656 p2-p0");
  EXPECT_EQ(name_of(reference().reference_error.other.point->setting), "98373 p1-anp");
}

TEST_F(AccuracyReference, StaysQuadraticOnOneMeshWhateverTheEstimatesSay) {
  add_meshes("p2-p0", 6, 0.1, 0.8);
  add_meshes("p1-anp", 6, 0.01, 1.2);
  EXPECT_EQ(name(), "19656 p2-p0");
}

TEST_F(AccuracyReference, WithAKnownErrorIsPreferredToOneWithout) {
  add_meshes("p2-p0", 1, 0.1, 1);
  add_meshes("p1-anp", 3, 0.1, 1);
  EXPECT_EQ(name(), "1696 p1-anp");
  measured_.clear();
  add("p2-p0", "149", 149, 0.1, 1);
  add("p1-anp", "563", 563, 0.1, 1);
  EXPECT_EQ(name(), "149 p2-p0");
}

TEST_F(AccuracyReference, IsAmongThePointsThatWereMeantToBeOne) {
  add_meshes("p1-anp", 3, 0.1, 1);
  EXPECT_EQ(name(), "1696 p1-anp");
  EXPECT_TRUE(judged({"mesh"}).empty());
}

TEST_F(AccuracyReference, SharesItsAnswerWithOtherStorageOfItsMesh) {
  add_meshes("p2-p0", 3, 0.1, 1);
  measured_.push_back(measured_.back());
  measured_.back().setting.bundle.storage = "f16";
  measured_.push_back(measured_.back());
  measured_.back().setting.scene.contact = "node";
  const auto points = judged();
  ASSERT_EQ(points.size(), 5u);
  EXPECT_FALSE(points[1].shares_reference);  // another mesh
  EXPECT_TRUE(points[2].shares_reference && points[2].is_reference);
  EXPECT_TRUE(points[3].shares_reference && !points[3].is_reference);
  EXPECT_FALSE(points[4].shares_reference);  // another contact
}

nlohmann::ordered_json setting(const char* name, double error, double touch, double megabytes, double seconds,
                               double field_error = 0.1) {
  return {{"name", name},
          {"own_material", true},
          {"solver", "auto"},
          {"columns_everywhere", true},
          {"exercise", "press"},
          {"law", "sticking"},
          {"contacts", 1},
          {"is_reference", false},
          {"storage", "f32"},
          {"force_error", error},
          {"touch_us", touch},
          {"bundle_MB", megabytes},
          {"precompute_s", seconds},
          {"field_error", field_error}};
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
  points_[0]["force_error"] = 0.02, points_[0]["storage"] = "f64";
  points_[1]["columns_everywhere"] = false;
  EXPECT_EQ(cheapest(points_, {{"force_error", "--force-error 5%", 0.05}}, "precompute_s")->at("name"), "fine");
  points_[2]["is_reference"] = true;
  EXPECT_EQ(cheapest(points_, {{"force_error", "--force-error 5%", 0.05}}, "precompute_s"), nullptr);
  points_[2]["is_reference"] = false, points_[2]["shares_reference"] = true;
  EXPECT_EQ(cheapest(points_, {{"force_error", "--force-error 5%", 0.05}}, "precompute_s"), nullptr);
}

TEST_F(Chooser, SaysWhatStandsInTheWay) {
  const std::vector<Limit> limits = {{"force_error", "--force-error 2%", 0.02}, {"bundle_MB", "--bundle-mb 50", 50}};
  EXPECT_EQ(cheapest(points_, limits, "precompute_s"), nullptr);
  const std::string text = what_stands_in_the_way(points_, limits);
  for (const char* noun : {"--force-error 2%", "3 % (middle)", "--bundle-mb 50", "400 (fine)"})
    EXPECT_THAT(text, testing::HasSubstr(noun));
}

TEST_F(Chooser, DoesNotAnswerWhereTheReferenceIsFartherOffThanTheLimit) {
  nlohmann::ordered_json point = points_[1];
  point["reference_force_error"] = 0.26, point["reference_field_error"] = nullptr;
  const Limit force{"force_error", "--force-error 5%", 0.05}, size{"bundle_MB", "--bundle-mb 50", 50};
  EXPECT_EQ(beyond_the_reference(point, {size}), "");
  EXPECT_THAT(beyond_the_reference(point, {size, force}), testing::StartsWith("--force-error 5%: "));
  point["reference_force_error"] = 0.05;
  EXPECT_EQ(beyond_the_reference(point, {force}), "");
  EXPECT_THAT(beyond_the_reference(point, {{"field_error", "--field-error 9%", 0.09}}),
              testing::HasSubstr("unknown amount"));
}

TEST_F(Chooser, PicksTheSmallestErrorThatEachBudgetAffords) {
  const auto picked = picks(points_, {});
  ASSERT_EQ(picked.size(), 3u);
  EXPECT_EQ(picked[0].at("pick"), "coarse");
  EXPECT_EQ(picked[1].at("pick"), "middle");
  EXPECT_EQ(picked[2].at("pick"), "fine");
}

TEST_F(Chooser, PicksTheShorterPrecomputeOfTwoThatAreAsGood) {
  points_.push_back(setting("as fine", 0.0105, 30, 400, 50));
  points_.push_back(setting("coarser", 0.012, 30, 400, 1));
  EXPECT_EQ(picks(points_, {})[2].at("pick"), "as fine");
}

TEST_F(Chooser, PicksTheShorterPrecomputeOfTwoThatMeshesDoNotTellApart) {
  EXPECT_EQ(picks(points_, {0.019, 0})[2].at("pick"), "fine");
  EXPECT_EQ(picks(points_, {0.021, 0})[2].at("pick"), "middle");
}

TEST_F(Chooser, PicksTheSmallerFieldErrorOfTwoForcesThatAreAsGood) {
  points_.push_back(setting("smooth", 0.0105, 30, 400, 600, 0.05));
  EXPECT_EQ(picks(points_, {})[2].at("pick"), "smooth");
  EXPECT_EQ(picks(points_, {0, 0.049})[2].at("pick"), "smooth");
  EXPECT_EQ(picks(points_, {0, 0.051})[2].at("pick"), "fine");
}

}  // namespace
}  // namespace palpate::accuracy
