// Young's modulus, and one parameter of the bundles, from measured forces: least squares, and a bootstrap for the intervals.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "programs/fit/measurements.h"
#include "programs/fit/stiffness_model.h"

namespace palpate::fit {

struct FitOptions {
  bool initial_slope = false;  // a term in depth^2 of its own for each spot, which takes up what is not linear
  int repetitions = 2000;      // of the bootstrap
  std::uint64_t seed = 1;
};

struct Interval {
  double low = 0, high = 0;  // 95 %
};

struct Estimate {
  double value = 0;
  std::optional<Interval> interval;  // none: too few rows, or a bootstrap that does not bound it
};

// One place on its own: the modulus that its rows alone ask for, with the fitted parameter.
struct PlaceFit {
  std::string name;
  int rows = 0;
  double young = 0;  // Pa
};

struct Fit {
  Estimate young;                     // Pa
  std::optional<Estimate> parameter;  // where the model has one
  Estimate product;      // Pa: young times exp(parameter), for a parameter that is the logarithm of a ratio of moduli
  bool at_edge = false;  // the parameter is at the first or the last bundle
  bool over_places = false;  // the bootstrap drew places; else rows
  double residual = 0;       // root mean square, N
  double largest_force = 0;  // N
  std::vector<PlaceFit> places;
  std::vector<double> fitted_force;  // N, of each row
  // The residual against the parameter, for the plot; empty without one.
  std::vector<double> profile_parameter, profile_residual;
};

// Fewer units than these give no interval that holds what it promises (measured: tests/programs/fit). Places are drawn where there
// are as many of them, else rows.
constexpr std::size_t kFewestUnits = 6, kFewestUnitsWithParameter = 8;

// The forces are taken as E k(parameter) depth plus an error of one size for all rows: E and the parameter minimise the sum of
// squares of the difference. For given parameter E is one division, sum(F k d) / sum((k d)^2).
//
// The intervals hold 95 %: value -+ q se. se is the cluster-robust (sandwich) standard error of log E and of the parameter, in
// which the rows of one place may err together; q is the 95 % quantile of |value* - value| / se* over draws of whole places with
// replacement (symmetric bootstrap-t, Hall 1988). Intervals of the parameter end at the first and the last bundle.
// Errors: InputError where the forces do not push, or do not tell the parameter from Young's modulus.
Fit fit_forces(const Measurements& measurements, const StiffnessModel& model, const FitOptions& options);

}  // namespace palpate::fit
