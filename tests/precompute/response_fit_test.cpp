// The corrections P and Q that are fitted to measured curves.
#include "precompute/run/response_fit.h"

#include <gmock/gmock.h>

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <numbers>

#include "formats/errors.h"
#include "tests/precompute/support.h"
#include "tests/support/test_files.h"
#include "tests/support/texts.h"

namespace palpate::tests {
namespace {

using ::testing::HasSubstr;

std::vector<double> grid(int count, double to) {
  std::vector<double> x;
  for (int i = 1; i <= count; ++i) x.push_back(to * i / count);
  return x;
}

std::vector<double> values_of(const std::vector<double>& x, const std::function<double(double)>& f) {
  std::vector<double> y;
  for (const double v : x) y.push_back(f(v));
  return y;
}

void expect_monotone_from_zero(const ResponsePolynomial& p) {
  double alternating = 0;
  for (std::size_t i = 0; i < p.coefficient.size(); ++i) alternating += (i % 2 ? -1 : 1) * p.coefficient[i];
  EXPECT_NEAR(alternating, 0, 1e-15 * p(p.range));  // one rounding of the last sum
  double before = p(0);
  for (int i = 1; i <= 1000; ++i) {
    const double now = p(p.range * i / 1000);
    ASSERT_GE(now, before - 1e-12 * p(p.range)) << i;
    before = now;
  }
}

TEST(ResponseFit, RecoversAPolynomialOfEachDegreeExactly) {
  for (int degree = 4; degree <= 10; ++degree) {
    const auto cubic = [](double x) {
      return 0.27347 * x - 0.12448 * x * x + 0.0593 * x * x * x;
    };  // N, mm: measured shape
    const auto power = [degree](double x) { return std::pow(x, degree); };
    const auto x = grid(40, 3.9);
    const auto p = fit_response(x, values_of(x, [&](double v) { return cubic(v) + 1e-3 * power(v); }), degree, "curve");
    for (const double v : grid(97, 3.9))
      ASSERT_NEAR(p(v), cubic(v) + 1e-3 * power(v), 1e-11 * p(3.9))
          << degree;  // condition of the basis (tens) and room
    expect_monotone_from_zero(p);
    EXPECT_EQ(p.range, 3.9);
    EXPECT_LE(p.largest, 1e-11);
    EXPECT_EQ(p.note, "");
  }
}

TEST(ResponseFit, DoesNotDependOnTheUnit) {
  const auto f = [](double x) { return std::exp(x) - 1; };
  const auto x = grid(30, 1.0), tiny = grid(30, 1e-6);
  const auto p = fit_response(x, values_of(x, f), 8, "a");
  const auto q = fit_response(tiny, values_of(tiny, [&](double v) { return 1e-3 * f(1e6 * v); }), 8, "b");
  for (const double v : grid(50, 1.0)) EXPECT_NEAR(q(1e-6 * v), 1e-3 * p(v), 1e-13);
}

TEST(ResponseFit, ConstrainsAFitThatWouldNotBeMonotone) {
  // The data are a step; the least-squares polynomial of degree 9 overshoots on one side and undershoots on the other.
  const auto x = grid(60, 1.0);
  const auto y = values_of(x, [](double v) { return 1 / (1 + std::exp(-60 * (v - 0.5))); });
  const auto p = fit_response(x, y, 9, "curve");
  EXPECT_THAT(p.note, HasSubstr("constrained to be monotone"));
  expect_monotone_from_zero(p);
  EXPECT_LE(p.rms, 0.15);  // it still follows the step as far as degree 9 can
  EXPECT_GE(p(1.0), 0.85);
}

TEST(ResponseFit, ConstrainsAFitThatFallsOnAnIntervalOfAnyLength) {
  // p' = 12 ((x - a)^2 - w^2): p falls by 16 w^3 = 4.4e-9 of its range, on 1.3e-3 of the interval; the check of stored curves
  // allows 1e-9. At 400 samples, of which none is nearer to a than 1.25e-3, p grows from each to the next.
  const double a = 0.50125, w = 6.5e-4;
  const auto f = [&](double x) { return 4 * (std::pow(x - a, 3) + std::pow(a, 3)) - 12 * w * w * x; };
  for (int i = 0; i < 400; ++i) ASSERT_GT(f((i + 1) / 400.0), f(i / 400.0)) << i;
  ASSERT_LT(f(a + w), f(a - w) - 4e-9);
  const auto x = grid(40, 1.0);
  EXPECT_THAT(fit_response(x, values_of(x, f), 4, "curve").note, HasSubstr("constrained to be monotone"));
  // With the sign of w^2 turned the same cubic grows everywhere and is left alone.
  const auto grows = [&](double v) { return f(v) + 24 * w * w * v; };
  EXPECT_EQ(fit_response(x, values_of(x, grows), 4, "curve").note, "");
}

TEST(ResponseFit, LowersTheDegreeToTheNumberOfPointsAndSaysSo) {
  const auto x = grid(5, 1.0);
  const auto p = fit_response(x, values_of(x, [](double v) { return v + v * v; }), 8, "curve");
  EXPECT_EQ(p.coefficient.size(), 6u);
  EXPECT_THAT(p.note, HasSubstr("degree 8 lowered to 5"));
  expect_monotone_from_zero(p);
}

TEST(ResponseFit, RefusesThreePoints) {
  EXPECT_THROW(fit_response({1, 2, 3}, {1, 2, 3}, 4, "curve"), InputError);
}

std::filesystem::path curve_file(const std::string& text) {
  const auto file = scratch("curve.csv");
  std::ofstream(file) << text;
  return file;
}

std::string curve_refusal(const std::string& text) {
  return input_error([&] { read_measured_curve(curve_file(text)); });
}

TEST(MeasuredCurve, IsReadInMetresWithoutItsOrigin) {
  const auto file = curve_file(  // a byte order mark first
      "\xef\xbb\xbf# source\ndisplacement_mm,force_N,radial_mm\n0,0,0\n1, 2,0.5\r\n\n2,3,1.25\n");
  const auto curve = read_measured_curve(file);
  EXPECT_THAT(curve.displacement, ::testing::ElementsAre(1e-3, 2e-3));
  EXPECT_THAT(curve.force, ::testing::ElementsAre(2, 3));
  EXPECT_THAT(curve.radial, ::testing::ElementsAre(0.5e-3, 1.25e-3));
}

TEST(MeasuredCurve, IsRefusedWithTheLineWhenMalformed) {
  EXPECT_THAT(curve_refusal(""), HasSubstr("expected a header"));
  EXPECT_THAT(curve_refusal("x,y\n1,2\n"), HasSubstr(":1: expected the header"));
  EXPECT_THAT(curve_refusal("displacement_mm,force_N\n1\n"), HasSubstr(":2: "));
  EXPECT_THAT(curve_refusal("displacement_mm,force_N\n1,nan\n"), HasSubstr(":2: expected a number"));
  EXPECT_THAT(curve_refusal("displacement_mm,force_N\n1,-2\n"), HasSubstr("not negative"));
  EXPECT_THAT(curve_refusal("displacement_mm,force_N\n1,2x\n"), HasSubstr("found \"2x\""));
  EXPECT_THAT(curve_refusal("displacement_mm,force_N\n0,1\n"), HasSubstr("at displacement 0"));
  EXPECT_THAT(curve_refusal("displacement_mm,force_N\n1,1\n1,2\n"), HasSubstr(":3: expected displacements"));
  EXPECT_THAT(curve_refusal("displacement_mm,force_N\n1,1\n2,3\n3,2.5\n"), HasSubstr(":4: expected a force"));
  EXPECT_THAT(curve_refusal("displacement_mm,force_N,radial_mm\n1,1,2\n2,3,1\n"), HasSubstr(":3: expected a radial"));
  EXPECT_THAT(curve_refusal("displacement_mm,force_N\n1,0\n"), HasSubstr("force above 0"));
}

TEST(ResponseFit, TakesTheLinearModelsRadialMotionAndForceAsArguments) {
  // The measured curve is 3 times the linear force and half the linear radial displacement: Q(f) = 3 f, P(d) = d / 2.
  const double height = 0.013, radius = 0.015, young = 3000, poisson = 0.45;
  std::string text = "displacement_mm,force_N,radial_mm\n";
  for (int i = 1; i <= 20; ++i) {
    const double x = 1e-3 * 0.2 * i;
    const double linear_force = std::numbers::pi * radius * radius * young * x / height;
    text +=
        fmt::format("{:.17g},{:.17g},{:.17g}\n", 0.2 * i, 3 * linear_force, 1e3 * 0.5 * poisson * radius * x / height);
  }
  const auto fit = fit_responses({curve_file(text), "test", height, radius, young, poisson, 5});
  const double last = 4e-3;
  EXPECT_NEAR(fit.force.range, std::numbers::pi * radius * radius * young * last / height, 1e-14);
  EXPECT_NEAR(fit.radial.range, poisson * radius * last / height, 1e-16);
  for (const double share : {0.1, 0.5, 0.9}) {
    EXPECT_NEAR(fit.force(share * fit.force.range), 3 * share * fit.force.range, 1e-12);
    EXPECT_NEAR(fit.radial(share * fit.radial.range), 0.5 * share * fit.radial.range, 1e-15);
  }
}

}  // namespace
}  // namespace palpate::tests
