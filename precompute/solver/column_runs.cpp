#include "precompute/solver/column_runs.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate {
namespace {

// Fills in the residuals; returns the worst column.
std::size_t report_residuals(std::span<const double> left, std::span<const double> load,
                             std::span<ColumnReport> reports) {
  std::size_t worst = 0;
  for (std::size_t c = 0; c < reports.size(); ++c) {
    reports[c].residual = load[c] > 0 ? left[c] / load[c] : 0.0;
    if (!(reports[c].residual <= reports[worst].residual)) worst = c;  // a NaN is the worst
  }
  return worst;
}

// The relative residual that rounding x alone may leave.
std::vector<double> rounding_floors(std::vector<double> solution, std::span<const double> load, double operator_norm) {
  for (std::size_t c = 0; c < solution.size(); ++c)
    solution[c] = load[c] > 0 ? std::numeric_limits<double>::epsilon() * operator_norm * solution[c] / load[c] : 0.0;
  return solution;
}

// Whether all columns above the tolerance are at what double precision allows; then their reports say so.
bool all_at_floor(std::span<ColumnReport> reports, std::span<const double> floor, double tolerance) {
  for (std::size_t c = 0; c < reports.size(); ++c)
    if (!(reports[c].residual <= std::max(tolerance, floor[c]))) return false;
  for (std::size_t c = 0; c < reports.size(); ++c)
    if (reports[c].residual > tolerance) reports[c].floor = floor[c];
  return true;
}

}  // namespace

void run_until_converged(ColumnRuns& runs, const ColumnSolverOptions& options, double operator_norm,
                         std::span<const double> load, std::span<ColumnReport> reports) {
  std::string reason = "no iteration";
  double before = std::numeric_limits<double>::infinity();
  for (int run = 0;; ++run) {
    const std::vector<double> left = runs.residual_norms();
    const std::size_t worst = report_residuals(left, load, reports);
    const double residual = reports[worst].residual;
    if (residual <= options.tolerance) break;
    // A correction that no longer halves the residual has met rounding, where the residual is of its size.
    const bool stalled = residual > 0.5 * before, given_up = run > options.most_restarts || !std::isfinite(residual);
    before = residual;
    if (stalled || given_up) {
      const std::vector<double> floor = rounding_floors(runs.solution_norms(), load, operator_norm);
      if (all_at_floor(reports, floor, options.tolerance)) break;
      if (given_up) throw NotConverged{static_cast<int>(worst), residual, floor[worst], reason};
    }
    std::vector<double> scale(reports.size());
    for (std::size_t c = 0; c < scale.size(); ++c) scale[c] = reports[c].residual > options.tolerance ? left[c] : 0.0;
    const double share = run == 0 ? 0.5 : 0.1;
    const int iterations = runs.correct(scale, std::clamp(share * options.tolerance / residual, 1e-12, 0.1), &reason);
    for (std::size_t c = 0; c < scale.size(); ++c)
      if (scale[c] > 0) reports[c].iterations += iterations;
  }
  for (std::size_t c = 0; c < reports.size(); ++c)
    if (load[c] == 0) reports[c] = {};
}

}  // namespace palpate
