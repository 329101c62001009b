// Runs of an iteration on a block of columns, each on what the last one left, wherever the operator lies.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "precompute/solver/column_solver.h"

namespace palpate {

// K x = b of one block, [dofs][width], on one rank or divided among those of a group; then every call is collective.
class ColumnRuns {
 public:
  virtual ~ColumnRuns() = default;

  virtual std::vector<double> residual_norms() = 0;  // ||b - K x|| of each column
  virtual std::vector<double> solution_norms() = 0;  // ||x|| of each column

  // One run from zero on K d = (b - K x) / scale, for the columns whose scale is not 0, then x += scale d. Returns the
  // iterations; reason: why they ended.
  virtual int correct(std::span<const double> scale, double relative_tolerance, std::string* reason) = 0;
};

// Goes on until each column's true relative residual holds options.tolerance or, where a correction no longer halves
// it, what double precision allows: epsilon operator_norm ||x|| / load. load: ||b|| of each column; reports: [width], the
// iterations already in it are kept. Errors: NotConverged.
void run_until_converged(ColumnRuns& runs, const ColumnSolverOptions& options, double operator_norm,
                         std::span<const double> load, std::span<ColumnReport> reports);

}  // namespace palpate
