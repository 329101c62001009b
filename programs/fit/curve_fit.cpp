#include "programs/fit/curve_fit.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <random>

#include "formats/errors.h"
#include "programs/fit/draw.h"

namespace palpate::fit {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kFloor = 0.05;    // of a curve's largest force: below, rows count less
constexpr int kMostRounds = 40;    // of Levenberg and Marquardt's method
constexpr double kSettled = 1e-8;  // relative decrease of the sum of squares
constexpr double kExact = 1e-10;   // root mean square residual below which nothing is left to find
constexpr double kStep = 1e-3;     // of a constant, or of 1, of difference quotients
constexpr int kMostPlaces = 12;    // along the curves, at which the law's error is looked at
constexpr int kFewestForBootstrap = 6;
constexpr double kToldModulus = 0.4;  // half width of log mu: the interval spans a factor of 2.2
constexpr double kToldShare = 1;      // half width over the constant
constexpr double kAlike = 2;          // residual of an example over the fit's
constexpr double kAlone =
    1.0 / 3;  // with the other constants held the interval is that much narrower: they are untold together

struct Solution {
  VectorXd at;
  double square = std::numeric_limits<double>::infinity();  // sum over rows of weight residual^2
  double log_shear = 0;
  VectorXd residual;  // log F - log mu - log f
};

class Fitter {
 public:
  Fitter(const CurveData& data, const LawFamily& family, const ForceModel& model)
      : family_(family), model_(model), log_force_(Index(data.force.size())), weight_(Index(data.force.size())) {
    std::map<int, double> largest;
    for (std::size_t r = 0; r < data.force.size(); ++r)
      largest[data.curve[r]] = std::max(largest[data.curve[r]], data.force[r]);
    for (std::size_t r = 0; r < data.force.size(); ++r) {
      const double share = std::min(1.0, data.force[r] / (kFloor * largest[data.curve[r]]));
      log_force_[Index(r)] = std::log(data.force[r]), weight_[Index(r)] = share * share;
    }
  }

  int solutions() const { return solutions_; }
  const VectorXd& weight() const { return weight_; }

  // log f, or nothing where the law cannot be solved.
  const VectorXd* log_of_model(const VectorXd& at) {
    solve({at});
    const VectorXd& kept = known_[key_of(at)];
    return kept.size() > 0 ? &kept : nullptr;
  }

  // With the points of the difference quotients, which cost little beside it.
  Solution evaluate(const VectorXd& at, const std::vector<LawConstant::Range>& range) {
    Solution result;
    result.at = at;
    std::vector<VectorXd> points = {at};
    for (Index k = 0; k < at.size(); ++k) points.push_back(quotient_of(at, k, range, false).up);
    solve(points);
    const VectorXd* model = log_of_model(at);
    if (!model) return result;
    result.residual = log_force_ - *model;
    result.log_shear = weight_.dot(result.residual) / weight_.sum();
    result.residual.array() -= result.log_shear;
    result.square = weight_.dot(result.residual.cwiseAbs2());
    return result;
  }

  // d log F / d (log mu, coordinates). central: by differences to both sides, where the range allows.
  MatrixXd slopes(const VectorXd& at, const std::vector<LawConstant::Range>& range, bool central) {
    MatrixXd result = MatrixXd::Ones(log_force_.size(), 1 + at.size());
    std::vector<Quotient> quotients;
    std::vector<VectorXd> points = {at};
    for (Index k = 0; k < at.size(); ++k) {
      quotients.push_back(quotient_of(at, k, range, central));
      points.push_back(quotients.back().up), points.push_back(quotients.back().down);
    }
    solve(points);
    const VectorXd middle = *log_of_model(at);
    for (Index k = 0; k < at.size(); ++k) {
      auto& [up, down] = quotients[std::size_t(k)];
      const VectorXd *above = log_of_model(up), *below = log_of_model(down);
      if (!above) above = &middle, up = at;
      if (!below) below = &middle, down = at;
      if (!(up[k] > down[k]))
        throw OperationError(failed_.empty() ? "the body has no balance near the fitted constants" : failed_);
      result.col(1 + k) = (*above - *below) / (up[k] - down[k]);
    }
    return result;
  }

  // Levenberg and Marquardt's method within the ranges; free: which coordinates move.
  Solution minimise(const VectorXd& start, const std::vector<LawConstant::Range>& range,
                    const std::vector<bool>& free) {
    Solution best = evaluate(start, range);
    if (!std::isfinite(best.square)) return best;
    double damping = 1e-3;
    for (int round = 0; round < kMostRounds; ++round) {
      if (std::sqrt(best.square / weight_.sum()) < kExact) break;
      const MatrixXd j = slopes(best.at, range, false);
      const VectorXd g = j.transpose() * weight_.cwiseProduct(best.residual);
      std::vector<Index> moved = {0};
      for (Index k = 0; k < best.at.size(); ++k) {
        const auto& of = range[std::size_t(k)];
        const bool held = (best.at[k] <= of.low && g[1 + k] < 0) || (best.at[k] >= of.high && g[1 + k] > 0);
        if (free[std::size_t(k)] && !held) moved.push_back(1 + k);
      }
      if (moved.size() == 1) break;
      const MatrixXd own = j(Eigen::all, moved);
      const MatrixXd h = own.transpose() * weight_.asDiagonal() * own;
      const VectorXd own_g = g(moved);
      bool better = false;
      double gained = 0;
      for (; damping < 1e8; damping *= 4) {
        MatrixXd damped = h;
        damped.diagonal() *= 1 + damping;
        damped(0, 0) = h(0, 0);  // the modulus follows exactly
        const VectorXd step = damped.ldlt().solve(own_g);
        VectorXd at = best.at;
        for (std::size_t i = 1; i < moved.size(); ++i) {
          const auto& of = range[std::size_t(moved[i] - 1)];
          at[moved[i] - 1] = std::clamp(at[moved[i] - 1] + step[Index(i)], of.low, of.high);
        }
        const Solution trial = evaluate(at, range);
        if (trial.square < best.square) {
          gained = 1 - trial.square / best.square, best = trial, damping = std::max(damping / 10, 1e-9), better = true;
          break;
        }
        if ((at - best.at).norm() <= 1e-9 * (1 + best.at.norm())) break;
      }
      if (!better || gained < kSettled) break;
    }
    return best;
  }

  const std::string& failed() const { return failed_; }

 private:
  struct Quotient {
    VectorXd up, down;
  };
  static Quotient quotient_of(const VectorXd& at, Index k, const std::vector<LawConstant::Range>& range, bool central) {
    const double step = kStep * std::max(1.0, std::abs(at[k]));
    Quotient result{at, at};
    result.up[k] = std::min(at[k] + step, range[std::size_t(k)].high);
    if (central || result.up[k] - at[k] < step / 2) result.down[k] = std::max(at[k] - step, range[std::size_t(k)].low);
    return result;
  }
  static std::vector<double> key_of(const VectorXd& at) { return {at.begin(), at.end()}; }
  // Those that are not known yet; the others lie near the first one.
  void solve(const std::vector<VectorXd>& points) {
    std::vector<LawForm> forms;
    std::vector<std::vector<double>> keys;
    for (const VectorXd& at : points)
      if (const auto key = key_of(at); !known_.count(key) && std::find(keys.begin(), keys.end(), key) == keys.end())
        keys.push_back(key), forms.push_back(family_.form(at));
    if (forms.empty()) return;
    try {
      const std::vector<VectorXd> found = model_(forms);
      for (std::size_t i = 0; i < found.size(); ++i)
        known_[keys[i]] =
            found[i].size() > 0 && found[i].minCoeff() > 0 ? VectorXd(found[i].array().log()) : VectorXd();
      solutions_ += static_cast<int>(found.size());
    } catch (const OperationError& error) {
      failed_ = error.what();
      known_[keys.front()] = VectorXd();
    }
  }

  const LawFamily& family_;
  const ForceModel& model_;
  VectorXd log_force_, weight_;
  std::map<std::vector<double>, VectorXd> known_;
  int solutions_ = 0;
  std::string failed_;
};

std::vector<std::vector<LawConstant::Range>> range_choices(const LawFamily& family) {
  std::vector<std::vector<LawConstant::Range>> choices = {{}};
  for (const LawConstant& constant : family.fitted()) {
    std::vector<std::vector<LawConstant::Range>> longer;
    for (const auto& choice : choices)
      for (const LawConstant::Range& range : constant.ranges) longer.push_back(choice), longer.back().push_back(range);
    choices = longer;
  }
  return choices;
}

// Of the fit's parameters, log mu and the coordinates: normal equations of each unit, and what follows from them.
struct UnitSums {
  std::vector<MatrixXd> h;  // [unit] J^T W J
  std::vector<VectorXd> g;  // [unit] J^T W e
  MatrixXd whole;
};

UnitSums sums_of(const CurveData& data, const MatrixXd& j, const VectorXd& weight, const VectorXd& residual) {
  UnitSums sums;
  sums.whole = MatrixXd::Zero(j.cols(), j.cols());
  sums.h.assign(std::size_t(data.units), sums.whole), sums.g.assign(std::size_t(data.units), VectorXd::Zero(j.cols()));
  for (Index r = 0; r < j.rows(); ++r) {
    const auto unit = std::size_t(data.unit[std::size_t(r)]);
    sums.h[unit] += weight[r] * j.row(r).transpose() * j.row(r);
    sums.g[unit] += weight[r] * residual[r] * j.row(r).transpose();
  }
  for (const MatrixXd& h : sums.h) sums.whole += h;
  return sums;
}

// Standard errors of the quantities, by leaving one unit out after the other.
VectorXd jackknife(const UnitSums& sums, const MatrixXd& quantities) {
  const double units = double(sums.h.size());
  VectorXd squares = VectorXd::Zero(quantities.rows());
  for (std::size_t u = 0; u < sums.h.size(); ++u) {
    const Eigen::FullPivLU<MatrixXd> of(sums.whole - sums.h[u]);
    if (!of.isInvertible()) return VectorXd::Constant(quantities.rows(), std::numeric_limits<double>::infinity());
    squares += (quantities * of.solve(sums.g[u])).cwiseAbs2();
  }
  return (squares * (units - 1) / units).cwiseSqrt();
}

// Half widths by the symmetric bootstrap-t over whole units (fit.h). The forces are taken as linear in the parameters.
VectorXd bootstrap(const UnitSums& sums, const MatrixXd& quantities, const CurveOptions& options) {
  const std::size_t units = sums.h.size();
  const auto errors_of = [&](const std::vector<int>& count, VectorXd* moved) -> std::optional<VectorXd> {
    MatrixXd h = MatrixXd::Zero(sums.whole.rows(), sums.whole.cols());
    VectorXd g = VectorXd::Zero(h.rows());
    for (std::size_t u = 0; u < units; ++u) h += count[u] * sums.h[u], g += count[u] * sums.g[u];
    const Eigen::LDLT<MatrixXd> of(h);
    if (of.info() != Eigen::Success || of.rcond() < 1e-14) return std::nullopt;
    *moved = of.solve(g);
    VectorXd squares = VectorXd::Zero(quantities.rows());
    for (std::size_t u = 0; u < units; ++u)
      squares += count[u] * (quantities * of.solve(sums.g[u] - sums.h[u] * *moved)).cwiseAbs2();
    return squares.cwiseSqrt();
  };
  VectorXd moved;
  const auto own = errors_of(std::vector<int>(units, 1), &moved);
  if (!own) return VectorXd::Constant(quantities.rows(), std::numeric_limits<double>::infinity());
  std::mt19937_64 generator(options.seed);
  std::vector<std::vector<double>> distances(std::size_t(quantities.rows()));
  for (int b = 0; b < options.repetitions; ++b) {
    std::vector<int> count(units, 0);
    for (std::size_t u = 0; u < units; ++u) ++count[draw(generator, units)];
    const auto errors = errors_of(count, &moved);
    const VectorXd distance = errors ? VectorXd((quantities * moved).cwiseAbs()) : VectorXd();
    for (Index q = 0; q < quantities.rows(); ++q)
      distances[std::size_t(q)].push_back(!errors            ? INFINITY
                                          : (*errors)[q] > 0 ? distance[q] / (*errors)[q]
                                          : distance[q] > 0  ? INFINITY
                                                             : 0);
  }
  VectorXd result(quantities.rows());
  for (Index q = 0; q < quantities.rows(); ++q) {
    auto& all = distances[std::size_t(q)];
    const auto rank = all.begin() + static_cast<std::ptrdiff_t>(0.95 * (double(options.repetitions) - 1));
    std::nth_element(all.begin(), rank, all.end());
    result[q] = (*own)[q] > 0 ? *rank * (*own)[q] : 0;
  }
  return result;
}

// Residuals, gathered at places along the curves: one for each strain where they are few, else equal parts of the range.
struct Places {
  VectorXd strain;
  MatrixXd slope, effect;
  std::vector<UnitResiduals> units;
};

Places places_of(const CurveData& data, const MatrixXd& j, const VectorXd& weight, const VectorXd& residual,
                 const MatrixXd& whole) {
  std::vector<double> strains = data.strain;
  std::sort(strains.begin(), strains.end());
  const double most = strains.back();
  strains.erase(std::unique(strains.begin(), strains.end(), [&](double a, double b) { return b - a < 1e-6 * most; }),
                strains.end());
  const bool each = strains.size() <= std::size_t(kMostPlaces);
  std::vector<int> place(data.strain.size());
  std::map<int, int> used;
  for (std::size_t r = 0; r < place.size(); ++r) {
    const double s = data.strain[r];
    place[r] = each ? int(std::lower_bound(strains.begin(), strains.end(), s - 1e-6 * most) - strains.begin())
                    : std::min(kMostPlaces - 1, int(kMostPlaces * s / most));
    used[place[r]] = 0;
  }
  int count = 0;
  for (auto& [at, index] : used) index = count++;
  Places result;
  result.strain = VectorXd::Zero(count), result.slope = MatrixXd::Zero(count, j.cols());
  result.effect = MatrixXd::Zero(j.cols(), count);
  VectorXd sum = VectorXd::Zero(count);
  MatrixXd of_unit = MatrixXd::Zero(count, data.units), unit_sum = of_unit;
  for (std::size_t r = 0; r < place.size(); ++r) {
    const Index at = used[place[r]], unit = data.unit[r];
    const double w = weight[Index(r)];
    sum[at] += w, result.strain[at] += w * data.strain[r] / most, result.slope.row(at) += w * j.row(Index(r));
    result.effect.col(at) += w * j.row(Index(r)).transpose();
    of_unit(at, unit) += w * residual[Index(r)], unit_sum(at, unit) += w;
  }
  result.strain = result.strain.cwiseQuotient(sum);
  result.slope = sum.cwiseInverse().asDiagonal() * result.slope;
  result.effect = whole.ldlt().solve(result.effect);
  for (Index u = 0; u < data.units; ++u) {
    UnitResiduals unit;
    std::vector<double> values;
    for (Index at = 0; at < count; ++at)
      if (unit_sum(at, u) > 0) unit.place.push_back(int(at)), values.push_back(of_unit(at, u) / unit_sum(at, u));
    unit.residual = VectorXd::Map(values.data(), Index(values.size()));
    result.units.push_back(unit);
  }
  return result;
}

struct HalfWidths {
  VectorXd all;  // [quantity]; infinite: none
  double law_error = 0;
  std::vector<double> law_evidence;
  UnitPart part = UnitPart::none;
};

HalfWidths half_widths(const CurveData& data, const MatrixXd& j, const VectorXd& weight, const VectorXd& residual,
                       const MatrixXd& quantities, const CurveOptions& options) {
  HalfWidths result;
  const UnitSums sums = sums_of(data, j, weight, residual);
  const Places places = places_of(data, j, weight, residual, sums.whole);
  const ModelError of_law =
      model_error(places.strain, places.slope, places.effect, quantities, places.units, options.usual_error);
  result.law_error = of_law.rms, result.law_evidence = of_law.log_evidence;
  VectorXd of_units = VectorXd::Zero(quantities.rows());
  if (data.units >= kFewestForBootstrap)
    result.part = UnitPart::bootstrap, of_units = bootstrap(sums, quantities, options);
  else if (data.units > 1)
    result.part = UnitPart::jackknife, of_units = student_quantile(data.units - 1) * jackknife(sums, quantities);
  result.all = (of_units.cwiseAbs2() + of_law.half_width.cwiseAbs2()).cwiseSqrt();
  return result;
}

}  // namespace

CurveFit fit_curves(const CurveData& data, const LawFamily& family, const ForceModel& model,
                    const CurveOptions& options, const std::string& file) {
  const auto& constants = family.fitted();
  const Index count = Index(constants.size());
  std::vector<double> strains = data.strain;
  std::sort(strains.begin(), strains.end());
  const auto different = std::unique(strains.begin(), strains.end()) - strains.begin();
  if (different < count + 2)
    throw InputError(fmt::format("{}: expected {} depths or more to fit the modulus and {} of the law {}, found {}",
                                 file, count + 2, count == 1 ? "one constant" : fmt::format("{} constants", count),
                                 family.name(), different));
  Fitter fitter(data, family, model);
  Solution best;
  std::vector<LawConstant::Range> range;
  std::vector<Solution> of_ranges;
  for (const auto& choice : range_choices(family)) {
    VectorXd start(count);
    for (Index k = 0; k < count; ++k) start[k] = choice[std::size_t(k)].start;
    const Solution found = fitter.minimise(start, choice, std::vector<bool>(std::size_t(count), true));
    of_ranges.push_back(found);
    if (range.empty() || found.square < best.square) best = found, range = choice;
  }
  if (!std::isfinite(best.square)) throw OperationError(fitter.failed());

  CurveFit fit;
  fit.at = best.at, fit.form = family.form(best.at), fit.shear.value = std::exp(best.log_shear);
  const VectorXd& weight = fitter.weight();
  fit.residual = std::sqrt(best.square / weight.sum());
  fit.fitted_force = (*fitter.log_of_model(best.at)).array().exp() * fit.shear.value;
  const MatrixXd j = fitter.slopes(best.at, range, true);

  // log mu, the constants, and Yeoh's in Pa.
  const bool yeoh = family.law() == FittedLaw::yeoh;
  const VectorXd values = family.constants(best.at);
  MatrixXd quantities = MatrixXd::Zero(1 + count + (yeoh ? count : 0), 1 + count);
  quantities(0, 0) = 1;
  if (count > 0) quantities.block(1, 1, count, count) = family.slopes(best.at);
  if (yeoh && count > 0) {
    quantities.bottomRows(count) = fit.shear.value * quantities.middleRows(1, count);
    quantities.bottomLeftCorner(count, 1) = fit.shear.value * values;
  }
  const HalfWidths half = half_widths(data, j, weight, best.residual, quantities, options);
  fit.unit_part = half.part, fit.law_error = half.law_error, fit.law_evidence = half.law_evidence;
  const double of_shear = half.all[0];
  if (std::isfinite(of_shear))
    fit.shear.interval = Interval{fit.shear.value * std::exp(-of_shear), fit.shear.value * std::exp(of_shear)};
  for (Index k = 0; k < count; ++k) {
    const auto of = [&](double value, Index q) {
      Estimate estimate{value, {}};
      if (std::isfinite(half.all[q])) estimate.interval = Interval{value - half.all[q], value + half.all[q]};
      return estimate;
    };
    const auto& limits = range[std::size_t(k)];
    FittedConstant constant{constants[std::size_t(k)].name, of(values[k], 1 + k), {}, false};
    constant.at_limit = best.at[k] <= limits.low || best.at[k] >= limits.high;
    if (yeoh) constant.pascals = of(fit.shear.value * values[k], 1 + count + k);
    auto& interval = constant.estimate.interval;
    if (interval && !yeoh)
      interval->low = std::max(interval->low, limits.low), interval->high = std::min(interval->high, limits.high);
    fit.constants.push_back(constant);
  }

  const auto fitted = [&](const Solution& found) {
    return Untold::Fitted{std::exp(found.log_shear), std::sqrt(found.square / weight.sum()),
                          family.constants(found.at)};
  };
  // What the curves do not tell: which of a constant's ranges it is. The interval knows one of them.
  for (const Solution& other : of_ranges)
    for (Index k = 0; k < count; ++k) {
      const auto& of = range[std::size_t(k)];
      if ((other.at[k] < of.low || other.at[k] > of.high) && other.square < kAlike * kAlike * best.square)
        fit.untold.push_back({constants[std::size_t(k)].name, false, true, fitted(best), fitted(other)});
    }

  // What the curves do not tell: the interval is wide. It is narrow with the other parameters held where these are untold together.
  for (Index k = 0; k < count; ++k) {
    const double width = half.all[1 + k], least = kToldShare * std::abs(values[k]);
    const bool wide = width > std::max(least, 1e-12), wide_modulus = of_shear > kToldModulus;
    if (!wide && !wide_modulus) continue;
    const HalfWidths held = half_widths(data, j.col(1 + k), weight, best.residual, MatrixXd::Identity(1, 1), options);
    const bool together = !(held.all[0] > kAlone * width);
    if (!together && !wide) continue;
    Untold untold{constants[std::size_t(k)].name, together, false, {}, {}};
    std::vector<bool> free(std::size_t(count), true);
    free[std::size_t(k)] = false;
    const auto at_end = [&](double to) {
      VectorXd start = best.at;
      const auto& of = range[std::size_t(k)];
      // As far as the law can be solved and its forces are nearly the same.
      for (double way = to; std::abs(way) > 1e-3 * std::abs(to); way /= 2) {
        start[k] = std::clamp(best.at[k] + way, of.low, of.high);
        const Solution found = fitter.minimise(start, range, free);
        if (found.square < kAlike * kAlike * best.square) return fitted(found);
      }
      return Untold::Fitted{fit.shear.value, fit.residual, values};
    };
    const double reach = std::isfinite(width) ? width : range[std::size_t(k)].high - range[std::size_t(k)].low;
    // Half way to the ends, where the residual has grown little.
    untold.low = at_end(-reach / 2), untold.high = at_end(reach / 2);
    fit.untold.push_back(untold);
  }

  VectorXd squares = VectorXd::Zero(data.units), sums = squares, weights = squares;
  for (std::size_t r = 0; r < data.force.size(); ++r) {
    const double w = weight[Index(r)], e = best.residual[Index(r)];
    squares[data.unit[r]] += w * e * e, sums[data.unit[r]] += w * e, weights[data.unit[r]] += w;
  }
  for (Index u = 0; u < data.units; ++u) {
    fit.unit_shear.push_back(fit.shear.value * std::exp(sums[u] / weights[u]));
    fit.unit_residual.push_back(std::sqrt(squares[u] / weights[u]));
  }
  fit.solutions = fitter.solutions();
  return fit;
}

}  // namespace palpate::fit
