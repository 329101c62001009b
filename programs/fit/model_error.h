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

// P(|t| > result) = 0.05 for Student's t; freedom 1 ..
double student_quantile(int freedom);

// slope: [place][parameter] of the logarithm of the force; strain: [place]; effect: [parameter][place], by how much an error at a place moves
// each parameter; quantities: [quantity][parameter]. Returns for each quantity the half width of the interval that holds 95 % of what the
// law's error, and with one unit its whole error, moves it by. The widest one is taken of all correlations that the residuals allow at 95 %
// (a likelihood ratio): an error with a long correlation leaves small residuals, so the residuals seldom exclude it. rms: of the units' mean
// residual at the places.
struct ModelError {
  Eigen::VectorXd half_width;
  double rms = 0;
};
ModelError model_error(const Eigen::VectorXd& strain, const Eigen::MatrixXd& slope, const Eigen::MatrixXd& effect,
                       const Eigen::MatrixXd& quantities, const std::vector<UnitResiduals>& units);

}  // namespace palpate::fit
