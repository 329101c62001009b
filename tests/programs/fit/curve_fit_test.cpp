// The constants of laws from made-up curves between sliding plates, whose force is a closed form: exact curves give exact constants, 95 % intervals
// hold the truth, and what curves cannot tell is said.
#include "programs/fit/curve_fit.h"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "formats/errors.h"
#include "tests/programs/fit/made_curves.h"
#include "tests/support/texts.h"

namespace palpate::fit {
namespace {

using testing::HasSubstr;

TEST(CurveFit, FindsTheConstantsOfExactCurves) {
  const std::pair<LawFamily, std::vector<double>> laws[] = {
      {LawFamily(FittedLaw::neo_hookean, {}), {}},
      {LawFamily(FittedLaw::stiffening, {}), {3.5}},
      {LawFamily(FittedLaw::yeoh, {}), {-0.06, 0.02}},
      {LawFamily(FittedLaw::yeoh, {{"c2", 0}}), {0.3}},
      {LawFamily(FittedLaw::ogden, {}), {-4.7}},
      {LawFamily(FittedLaw::ogden, {}), {3.8}},
      {LawFamily(FittedLaw::ogden, {{"second_exponent", -6}}), {4, 0.3}}};
  for (const auto& [family, constants] : laws) {
    const MadeCurves made(family, constants, {});
    const CurveFit fit = fit_curves(made.data(), family, made.model(), {}, "made.csv");
    EXPECT_NEAR(fit.shear.value, made.shear, 1e-4 * made.shear) << family.name();
    for (std::size_t k = 0; k < constants.size(); ++k)
      EXPECT_NEAR(fit.constants[k].estimate.value, constants[k], 1e-3 * std::abs(constants[k]))
          << fit.constants[k].name;
    EXPECT_LT(fit.residual, 1e-5);
  }
}

// Three standard deviations of a count of 200 intervals that each hold the truth with probability 0.95: fit_test.cpp.
constexpr int kRepetitions = 200;
constexpr double kBinomial = 0.046;

TEST(CurveFitCoverage, IsAtLeast95PercentWhereSpecimensDifferAndTheLawIsOff) {
  const LawFamily family(FittedLaw::stiffening, {});
  Noise noise;
  noise.of_units = 0.04, noise.along_curves = 0.02, noise.of_law = 0.02, noise.of_rows = 0.002;
  const Coverage held = coverage(family, {3.5}, noise, kRepetitions);
  EXPECT_GT(held.shear, 0.95 - kBinomial);
  EXPECT_GT(held.constants[0], 0.95 - kBinomial);
  RecordProperty("shear", std::to_string(held.shear));
  RecordProperty("b", std::to_string(held.constants[0]));
}

TEST(CurveFit, TellsThatCurvesOfSmallStrainsSayNothingOfTheStiffening) {
  const LawFamily family(FittedLaw::stiffening, {});
  Noise noise;
  noise.most_strain = 0.06, noise.along_curves = 0.02, noise.of_units = 0.03, noise.of_rows = 0.005;
  const MadeCurves made(family, {4}, noise);
  const CurveFit fit = fit_curves(made.data(), family, made.model(), {}, "made.csv");
  ASSERT_EQ(fit.untold.size(), 1u);
  EXPECT_EQ(fit.untold[0].constant, "b");
  // Its two examples really are nearly the same curve.
  EXPECT_LT(fit.untold[0].high.residual, 2 * fit.residual);
  EXPECT_GT(fit.untold[0].high.constants[0], fit.untold[0].low.constants[0]);
}

TEST(CurveFit, TellsThatDeepCurvesWithoutShallowRowsDoNotTellModulusFromStiffening) {
  const LawFamily family(FittedLaw::stiffening, {});
  Noise noise;
  noise.least_strain = 0.45, noise.most_strain = 0.5, noise.along_curves = 0.05, noise.of_law = 0.05,
  noise.length = 0.05;
  const MadeCurves made(family, {6}, noise);
  const CurveFit fit = fit_curves(made.data(), family, made.model(), {}, "made.csv");
  ASSERT_EQ(fit.untold.size(), 1u);
  EXPECT_TRUE(fit.untold[0].together);
  EXPECT_GT(fit.untold[0].low.shear, 1.5 * fit.untold[0].high.shear);
  EXPECT_LT(std::max(fit.untold[0].low.residual, fit.untold[0].high.residual), 2 * fit.residual);
  // With good curves nothing is untold.
  noise = {};
  noise.along_curves = 0.01, noise.of_units = 0.03;
  const MadeCurves good(family, {6}, noise);
  EXPECT_TRUE(fit_curves(good.data(), family, good.model(), {}, "made.csv").untold.empty());
}

// A shear has the same force with the exponent of the other sign, a compression has not.
TEST(CurveFit, TellsThatShearSaysNothingOfTheSignOfAnExponent) {
  const LawFamily family(FittedLaw::ogden, {});
  Noise noise;
  noise.along_curves = 0.02, noise.of_units = 0.03;
  EXPECT_TRUE([&] {
    const MadeCurves made(family, {6}, noise);
    return fit_curves(made.data(), family, made.model(), {}, "made.csv").untold.empty();
  }());
  noise.shape = Shape::sheared;
  const MadeCurves made(family, {6}, noise);
  const CurveFit fit = fit_curves(made.data(), family, made.model(), {}, "made.csv");
  ASSERT_EQ(fit.untold.size(), 1u);
  EXPECT_TRUE(fit.untold[0].range);
  EXPECT_NEAR(fit.untold[0].low.constants[0], -fit.untold[0].high.constants[0], 0.01);
  EXPECT_NEAR(fit.untold[0].low.residual, fit.untold[0].high.residual, 1e-4);
}

TEST(CurveFit, RefusesTooFewDepths) {
  const LawFamily family(FittedLaw::yeoh, {});
  Noise noise;
  noise.depths = 3;
  const MadeCurves made(family, {0.1, 0.1}, noise);
  EXPECT_THAT(tests::input_error([&] { fit_curves(made.data(), family, made.model(), {}, "made.csv"); }),
              HasSubstr("4 depths"));
}

TEST(CurveFit, RefusesConstantsThatALawDoesNotTake) {
  const auto error = [](FittedLaw law, const std::map<std::string, double>& held) {
    return tests::input_error([&] { LawFamily(law, held); });
  };
  EXPECT_THAT(error(FittedLaw::neo_hookean, {{"b", 1}}), HasSubstr("found b"));
  EXPECT_THAT(error(FittedLaw::stiffening, {{"b", -1}}), HasSubstr("found -1"));
  EXPECT_THAT(error(FittedLaw::yeoh, {{"c2", -0.5}, {"c3", 0.01}}), HasSubstr("c2 -0.5"));
  EXPECT_THAT(error(FittedLaw::ogden, {{"exponent", 1}}), HasSubstr("1.5 to 50"));
  EXPECT_THAT(error(FittedLaw::ogden, {{"second_exponent", 0}}), HasSubstr("second_exponent"));
}

}  // namespace
}  // namespace palpate::fit
