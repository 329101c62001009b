#include "programs/fit/model_error.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace palpate::fit {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kNoises[] = {1e-3, 1e-2, 0.1, 1, 10, 1e3};  // variance of what is not correlated over that of what is
constexpr int kScales = 24;                                  // of the law's error, from kLeastScale to kMostScale
constexpr double kLeastScale = 0.03, kMostScale = 30;        // over the residuals' own size
constexpr double kJitter = 1e-8;
constexpr double kSet = 1.92;  // half of chi squared's 95 % quantile, one degree of freedom

// P(|t| < x). Abramowitz and Stegun 26.7.3 and 26.7.4.
double student_within(double x, int freedom) {
  const double angle = std::atan(x / std::sqrt(freedom)), c = std::cos(angle), s = std::sin(angle);
  double term = freedom % 2 == 0 ? 1 : c, sum = freedom == 1 ? 0 : term;
  for (int k = freedom % 2 == 0 ? 2 : 3; k <= freedom - 2; k += 2) term *= c * c * (k - 1) / k, sum += term;
  return freedom % 2 == 0 ? s * sum : 2 / M_PI * (angle + s * sum);
}

// A term of a mixture: a normal variable (freedom 0) or Student's t, each of its quantities with that scale.
struct Term {
  double log_weight = 0;
  int freedom = 0;
  VectorXd scale;
};

// A correlation that the error may have.
using Candidate = std::vector<Term>;

double log_of_sum(const std::vector<double>& logarithms) {
  const double most = *std::max_element(logarithms.begin(), logarithms.end());
  double whole = 0;
  for (const double value : logarithms) whole += std::exp(value - most);
  return most + std::log(whole);
}

double log_likelihood(const Candidate& candidate) {
  std::vector<double> weights;
  for (const Term& term : candidate) weights.push_back(term.log_weight);
  return log_of_sum(weights);
}

// x with P(|X| < x) = 0.95 of each quantity.
VectorXd quantiles(std::vector<Term>& terms) {
  double most = -std::numeric_limits<double>::infinity();
  for (const Term& term : terms) most = std::max(most, term.log_weight);
  double whole = 0;
  for (Term& term : terms) whole += term.log_weight = std::exp(term.log_weight - most);
  const Index count = terms.front().scale.size();
  VectorXd result(count);
  for (Index q = 0; q < count; ++q) {
    const auto within = [&](double x) {
      double sum = 0;
      for (const Term& term : terms) {
        const double at = term.scale[q] > 0 ? x / term.scale[q] : std::numeric_limits<double>::infinity();
        sum += term.log_weight / whole *
               (!std::isfinite(at) ? 1
                : term.freedom > 0 ? student_within(at, term.freedom)
                                   : std::erf(at / M_SQRT2));
      }
      return sum;
    };
    double low = 0, high = 0;
    for (const Term& term : terms) high = std::max(high, term.scale[q]);
    for (int i = 0; i < 60 && within(high) < 0.95; ++i) high *= 2;
    for (int i = 0; i < 60; ++i) {
      const double middle = (low + high) / 2;
      (within(middle) < 0.95 ? low : high) = middle;
    }
    result[q] = high;
  }
  return result;
}

MatrixXd correlation(const VectorXd& strain, double length) {
  const auto count = strain.size();
  MatrixXd k(count, count);
  for (Index i = 0; i < count; ++i)
    for (Index j = 0; j < count; ++j) {
      const double apart = std::abs(strain[i] - strain[j]) / length;
      k(i, j) = std::exp(-apart * apart / 2) + (i == j ? kJitter : 0);
    }
  return k;
}

// The restricted likelihood of residuals with covariance v whose mean is a combination of the columns of slope.
struct Restricted {
  double log_determinants = 0;  // of v and of slope^T v^-1 slope
  double square = 0;            // residual^T P residual
};
std::optional<Restricted> restricted(const MatrixXd& v, const MatrixXd& slope, const VectorXd& residual) {
  const Eigen::LLT<MatrixXd> of_v(v);
  if (of_v.info() != Eigen::Success) return std::nullopt;
  const MatrixXd x = of_v.matrixL().solve(slope);
  const VectorXd y = of_v.matrixL().solve(residual);
  const Eigen::LLT<MatrixXd> of_x(x.transpose() * x);
  if (of_x.info() != Eigen::Success) return std::nullopt;
  const VectorXd fitted = of_x.solve(x.transpose() * y);
  const auto log_of = [](const Eigen::LLT<MatrixXd>& factor) {
    return 2 * MatrixXd(factor.matrixL()).diagonal().array().log().sum();
  };
  return Restricted{log_of(of_v) + log_of(of_x), (y - x * fitted).squaredNorm()};
}

template <class Matrix>
Matrix rows_of(const Matrix& all, const std::vector<int>& rows) {
  Matrix result(static_cast<Index>(rows.size()), all.cols());
  for (std::size_t i = 0; i < rows.size(); ++i) result.row(static_cast<Index>(i)) = all.row(rows[i]);
  return result;
}

// The covariance of the units' own errors, by the likelihood of what they differ from their mean by: the best of all lengths and noises.
std::optional<MatrixXd> covariance_of_units(const VectorXd& strain, const MatrixXd& slope, const VectorXd& mean,
                                            const std::vector<UnitResiduals>& units) {
  double best = -std::numeric_limits<double>::infinity();
  std::optional<MatrixXd> result;
  const double share = 1 - 1.0 / static_cast<double>(units.size());
  for (const double length : kErrorLengths)
    for (const double noise : kNoises) {
      const MatrixXd v = correlation(strain, length) + noise * MatrixXd::Identity(strain.size(), strain.size());
      double determinants = 0, square = 0, freedom = 0;
      for (const UnitResiduals& unit : units) {
        if (static_cast<Index>(unit.place.size()) <= slope.cols()) continue;
        MatrixXd own(unit.place.size(), unit.place.size());
        for (std::size_t i = 0; i < unit.place.size(); ++i)
          for (std::size_t j = 0; j < unit.place.size(); ++j)
            own(static_cast<Index>(i), static_cast<Index>(j)) = v(unit.place[i], unit.place[j]);
        const auto found = restricted(own, rows_of(slope, unit.place), unit.residual - rows_of(mean, unit.place));
        if (!found) continue;
        determinants += share * found->log_determinants, square += found->square;
        freedom += share * (static_cast<double>(unit.place.size()) - static_cast<double>(slope.cols()));
      }
      if (!(freedom > 0.5) || !(square > 0)) continue;
      const double likelihood = -determinants / 2 - freedom / 2 * std::log(square);
      if (likelihood > best) best = likelihood, result = square / freedom * v;
    }
  return result;
}

}  // namespace

double student_quantile(int freedom) {
  double low = 1, high = 13;
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (student_within(middle, freedom) < 0.95 ? low : high) = middle;
  }
  return high;
}

ModelError model_error(const VectorXd& strain, const MatrixXd& slope, const MatrixXd& effect,
                       const MatrixXd& quantities, const std::vector<UnitResiduals>& units, double usual_error) {
  const Index places = strain.size(), freedom = places - slope.cols();
  ModelError result;
  result.half_width = VectorXd::Zero(quantities.rows());
  if (freedom < 1) return result;
  VectorXd mean = VectorXd::Zero(places), count = VectorXd::Zero(places);
  for (const UnitResiduals& unit : units)
    for (std::size_t i = 0; i < unit.place.size(); ++i)
      mean[unit.place[i]] += unit.residual[static_cast<Index>(i)], count[unit.place[i]] += 1;
  mean = mean.cwiseQuotient(count);
  const double size = mean.norm() / std::sqrt(static_cast<double>(freedom));
  if (!(size > 1e-12)) return result;  // exact forces
  result.rms = size;

  const MatrixXd moves = quantities * effect;
  const MatrixXd one = MatrixXd::Identity(places, places);
  std::vector<Candidate> candidates;
  if (units.size() == 1) {
    for (const double length : kErrorLengths)
      for (const double noise : kNoises) {
        const MatrixXd v = correlation(strain, length) + noise * one;
        const auto found = restricted(v, slope, mean);
        if (!found || !(found->square > 0)) continue;
        const double f = static_cast<double>(freedom), scale = found->square / f;
        candidates.push_back(
            {{-found->log_determinants / 2 - f / 2 * std::log(found->square), static_cast<int>(freedom),
              (scale * (moves * v * moves.transpose()).diagonal()).cwiseSqrt()}});
      }
  } else {
    const auto of_units = covariance_of_units(strain, slope, mean, units);
    if (!of_units) return result;
    // Of the mean at two places: units that have both, over the units of each.
    MatrixXd both = MatrixXd::Zero(places, places);
    for (const UnitResiduals& unit : units)
      for (const int i : unit.place)
        for (const int j : unit.place) both(i, j) += 1;
    const MatrixXd of_mean = of_units->cwiseProduct(both.cwiseQuotient(count * count.transpose()));
    const MatrixXd left = one - slope * slope.colPivHouseholderQr().solve(one);  // what a fit leaves
    for (const double length : kErrorLengths) {
      const MatrixXd k = correlation(strain, length);
      // The scale at which a fit would leave residuals of this size.
      const double own = size * std::sqrt(static_cast<double>(freedom) / (left * k * left.transpose()).trace());
      Candidate candidate;
      std::vector<double> priors;
      for (int i = 0; i < kScales; ++i) {
        const double step = kLeastScale * std::pow(kMostScale / kLeastScale, i / (kScales - 1.0));
        const double s = step * std::min(own, usual_error);
        const auto found = restricted(s * s * k + of_mean, slope, mean);
        if (!found) continue;
        // All scales up to `own` are equally likely; beyond it the density falls as 1 / s, as for Student's t, and beyond usual_error faster.
        const double prior = std::log(s / (1 + s / own) / (1 + s * s / (usual_error * usual_error)));
        priors.push_back(prior);
        candidate.push_back({prior - found->log_determinants / 2 - found->square / 2, 0,
                             s * (moves * k * moves.transpose()).diagonal().cwiseMax(0).cwiseSqrt()});
      }
      if (candidate.empty()) continue;
      candidates.push_back(candidate);
      result.log_evidence.push_back(log_likelihood(candidate) - log_of_sum(priors));
    }
  }
  if (candidates.empty()) return result;
  std::vector<double> likelihood;
  for (const Candidate& candidate : candidates) likelihood.push_back(log_likelihood(candidate));
  const double best = *std::max_element(likelihood.begin(), likelihood.end());
  for (std::size_t c = 0; c < candidates.size(); ++c)
    if (likelihood[c] >= best - kSet) result.half_width = result.half_width.cwiseMax(quantiles(candidates[c]));
  return result;
}

}  // namespace palpate::fit
