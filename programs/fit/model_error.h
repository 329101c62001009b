// The law's own error: what the residuals of all units have alike, as a random function of the strain.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace palpate::fit {

// Residuals of one unit at places along the curve.
struct UnitResiduals {
  std::vector<int> place;  // ascending
  Eigen::VectorXd residual;
};

// Correlation lengths that the law's own error may have, over the largest strain.
inline constexpr double kErrorLengths[] = {0.1, 0.14, 0.2, 0.25, 0.3, 0.45, 0.7, 1};

// Of the force: the scale of the law's own error beyond which larger scales become ever less likely where residuals cannot show them. It is the value
// of the largest likelihood, over all lengths, of the errors that four laws have on 19 measured silicones (tests/programs/fit/law_errors.cpp).
inline constexpr double kUsualError = 0.25;

// P(|t| > result) = 0.05 for Student's t; freedom 1 ..
double student_quantile(int freedom);

// slope: [place][parameter] of the logarithm of the force; strain: [place]; effect: [parameter][place], by how much an error at a place moves
// each parameter; quantities: [quantity][parameter]. Returns for each quantity the half width of the interval that holds 95 % of what the
// law's error, and with one unit its whole error, moves it by. The widest one is taken of all correlations that the residuals allow at 95 %
// (a likelihood ratio): an error with a long correlation leaves small residuals, so the residuals seldom exclude it. rms: of the units' mean
// residual at the places. log_evidence: [of kErrorLengths] of two units or more: the logarithm of the likelihood of the mean residual with
// usual_error, over all scales.
struct ModelError {
  Eigen::VectorXd half_width;
  double rms = 0;
  std::vector<double> log_evidence;
};
ModelError model_error(const Eigen::VectorXd& strain, const Eigen::MatrixXd& slope, const Eigen::MatrixXd& effect,
                       const Eigen::MatrixXd& quantities, const std::vector<UnitResiduals>& units,
                       double usual_error = kUsualError);

}  // namespace palpate::fit
