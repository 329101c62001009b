// The stiffness of each spot as a function of one parameter, interpolated between bundles.
#pragma once

#include <cstddef>
#include <vector>

namespace palpate::fit {

// Between the bundles the compliance, 1 / stiffness, is interpolated, because it is nearly quadratic in Poisson's ratio: that of a
// disc on a half-space is (1 - nu^2) / (2 E a). One bundle: a constant. Two: a straight line. Three and more: in each interval
// the parabolas through the three bundles to its left and to its right, blended linearly (Overhauser 1968); continuous with its
// slope, and exact for a quadratic.
class StiffnessModel {
 public:
  // parameter: ascending. stiffness: [parameter][spot] over Young's modulus, m, each above 0.
  StiffnessModel(std::vector<double> parameter, const std::vector<std::vector<double>>& stiffness);

  std::size_t spot_count() const { return compliance_.empty() ? 0 : compliance_[0].size(); }
  bool has_parameter() const { return parameter_.size() > 1; }
  double low() const { return parameter_.front(); }
  double high() const { return parameter_.back(); }
  const std::vector<double>& parameter() const { return parameter_; }

  double stiffness(std::size_t spot, double parameter) const;
  // By the parameter; a difference quotient within [low, high].
  double slope(std::size_t spot, double parameter) const;

  // The largest relative error of the stiffness at an inner bundle, predicted from the other bundles: an upper estimate of the
  // interpolation's error. 0 with fewer than three bundles.
  double error_without_one() const;
  // By how much the ratio of the stiffness at the last and at the first bundle differs between spots, relative. Near 0, no force
  // tells the parameter from Young's modulus.
  double spread_between_spots() const;

 private:
  double interpolate(std::size_t spot, double parameter, const std::vector<std::size_t>& bundles) const;

  std::vector<double> parameter_;
  std::vector<std::vector<double>> compliance_;  // [parameter][spot], 1 / m
  std::vector<std::size_t> all_;
};

}  // namespace palpate::fit
