#include "programs/fit/stiffness_model.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace palpate::fit {
namespace {

constexpr double kStep = 1e-4;  // of the parameter's range, for the difference quotient

// The value at x of the parabola through three points.
double parabola(const double (&at)[3], const double (&value)[3], double x) {
  double sum = 0;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    sum += value[i] * (x - at[j]) * (x - at[k]) / ((at[i] - at[j]) * (at[i] - at[k]));
  }
  return sum;
}

}  // namespace

StiffnessModel::StiffnessModel(std::vector<double> parameter, const std::vector<std::vector<double>>& stiffness)
    : parameter_(std::move(parameter)), compliance_(stiffness), all_(parameter_.size()) {
  for (auto& bundle : compliance_)
    for (double& value : bundle) value = 1 / value;
  std::iota(all_.begin(), all_.end(), 0);
}

double StiffnessModel::interpolate(std::size_t spot, double x, const std::vector<std::size_t>& bundles) const {
  const auto at = [&](std::size_t b) { return parameter_[bundles[b]]; };
  const auto value = [&](std::size_t b) { return compliance_[bundles[b]][spot]; };
  const std::size_t count = bundles.size();
  if (count == 1) return value(0);
  if (count == 2) return value(0) + (value(1) - value(0)) * (x - at(0)) / (at(1) - at(0));
  std::size_t left = 0;
  while (left + 2 < count && x > at(left + 1)) ++left;
  const auto through = [&](std::size_t first) {
    return parabola({at(first), at(first + 1), at(first + 2)}, {value(first), value(first + 1), value(first + 2)}, x);
  };
  if (left == 0) return through(0);
  if (left + 2 == count) return through(count - 3);
  const double share = (x - at(left)) / (at(left + 1) - at(left));
  return (1 - share) * through(left - 1) + share * through(left);
}

double StiffnessModel::stiffness(std::size_t spot, double parameter) const {
  return 1 / interpolate(spot, parameter, all_);
}

double StiffnessModel::slope(std::size_t spot, double parameter) const {
  const double step = kStep * (high() - low());
  if (step == 0) return 0;
  const double before = std::max(low(), parameter - step), after = std::min(high(), parameter + step);
  return (stiffness(spot, after) - stiffness(spot, before)) / (after - before);
}

double StiffnessModel::error_without_one() const {
  double worst = 0;
  for (std::size_t out = 1; out + 1 < parameter_.size(); ++out) {
    std::vector<std::size_t> others = all_;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(out));
    for (std::size_t spot = 0; spot < spot_count(); ++spot)
      worst = std::max(worst, std::abs(compliance_[out][spot] / interpolate(spot, parameter_[out], others) - 1));
  }
  return worst;
}

double StiffnessModel::spread_between_spots() const {
  double least = INFINITY, most = 0;
  for (std::size_t spot = 0; spot < spot_count(); ++spot) {
    const double ratio = compliance_.front()[spot] / compliance_.back()[spot];
    least = std::min(least, ratio), most = std::max(most, ratio);
  }
  return spot_count() > 0 ? most / least - 1 : 0;
}

}  // namespace palpate::fit
