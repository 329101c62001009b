// The last lines of a run, and its report as JSON: what was written, how good it is and what it took.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "precompute/journal/certificate.h"
#include "precompute/run/run_inputs.h"
#include "precompute/run/run_report.h"
#include "precompute/run/solve_columns.h"
#include "precompute/solver/solver_plan.h"

namespace palpate {

struct RunOutcome {
  const PrecomputeOptions& options;
  const RunInputs& inputs;
  const Certificate& certificate;
  std::string solver;  // ColumnSolver::description()
  const SolverPlan& plan;
  PlanOutcome took;
  SolveSeconds columns;     // of the slowest rank
  std::size_t batches = 0;  // of columns
  std::size_t resumed = 0;  // of them, how many an earlier run had solved
};

void tell(const RunOutcome& outcome, const RunReport& report);
nlohmann::ordered_json json_of(const RunOutcome& outcome, const RunReport& report);

// where: a file, or "-" for standard output. Errors: OperationError, InputError where the file cannot be written.
void write_json(const nlohmann::ordered_json& report, const std::string& where);

}  // namespace palpate
