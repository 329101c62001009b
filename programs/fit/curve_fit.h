// The shear modulus and up to two more constants of a law from curves of force against depth under large strain.
//
// The forces are taken as F = mu f(depth; constants) times (1 + an error): least squares of the differences of log F, in which a row counts
// less where its force is below a twentieth of its curve's largest one.
//
// The error has two parts. That of a unit (a specimen, else a place) is what makes units differ, in whatever way it is correlated along
// a curve. The law's own error is what all units have alike: a random function of the strain with a scale and a correlation length,
// which are not known. Their restricted likelihood (Patterson and Thompson 1971, Biometrika 58), from the mean residual of all units, weighs
// the scales and says which lengths are possible; the widest interval of these lengths counts. The half width of a 95 % interval is the root of the sum of the squares of the two parts' half widths.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "programs/fit/fit.h"
#include "programs/fit/model_error.h"
#include "programs/fit/tissue_law.h"

namespace palpate::fit {

struct CurveData {
  std::vector<double> force, strain;  // N; depth over the curve's scale
  std::vector<int> curve, unit;
  int units = 0;
};

// [form][row] the force over the shear modulus, m^2, of laws over a shear modulus of 1 Pa, the others near the first one; empty where it is not
// found. Errors: OperationError where that of the first one is not found.
using ForceModel = std::function<std::vector<Eigen::VectorXd>(const std::vector<LawForm>&)>;

struct CurveOptions {
  int repetitions = 2000;  // of the bootstrap
  std::uint64_t seed = 1;
  double usual_error = kUsualError;  // of laws
};

// How the part of the interval is found that is due to the units' differences.
enum class UnitPart { none, jackknife, bootstrap };  // one unit; 2 to 5; more

struct FittedConstant {
  std::string name;
  Estimate estimate;  // of Yeoh's c2 and c3 over the shear modulus; `pascals` has them in Pa
  std::optional<Estimate> pascals;
  bool at_limit = false;  // it is where the law's range ends
};

// A constant that the curves do not tell: two fits whose forces are nearly the same.
struct Untold {
  std::string constant;
  bool together =
      false;  // with the modulus or the other constant, each of which alone would be told; else it does not act on these curves
  bool range = false;  // the two lie in different ranges of the constant, such as an exponent below and one above 0
  struct Fitted {
    double shear = 0, residual = 0;  // Pa, 1
    Eigen::VectorXd constants;
  };
  Fitted low, high;
};

struct CurveFit {
  Estimate shear;  // Pa
  std::vector<FittedConstant> constants;
  LawForm form;        // over a shear modulus of 1 Pa
  Eigen::VectorXd at;  // coordinates of the family
  UnitPart unit_part = UnitPart::none;
  double residual = 0;               // relative, root mean square
  double law_error = 0;              // relative: the part of the residual that all units have alike, root mean square
  std::vector<double> law_evidence;  // ModelError::log_evidence
  std::vector<double> unit_shear,
      unit_residual;             // [unit] Pa, 1: the modulus that its rows alone ask for, with the fitted constants
  Eigen::VectorXd fitted_force;  // [row] N
  std::vector<Untold> untold;
  int solutions = 0;  // of all curves
};

// Errors: InputError where rows are too few; OperationError where no law that was tried could be solved.
CurveFit fit_curves(const CurveData& data, const LawFamily& family, const ForceModel& model,
                    const CurveOptions& options, const std::string& file);

}  // namespace palpate::fit
