// The end of a run: what was written, how good it is, what it took. In words, and as JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "precompute/journal/certificate.h"
#include "precompute/run/run_inputs.h"
#include "precompute/run/run_report.h"
#include "precompute/run/solve_columns.h"
#include "precompute/solver/solver_plan.h"
#include "precompute/tensors/locking_estimate.h"

namespace palpate {

struct RunOutcome {
  const PrecomputeOptions& options;
  const RunInputs& inputs;
  const Certificate& certificate;
  const LockingEstimate& locking;
  std::string solver;  // what solved
  const SolverPlan& plan;
  PlanOutcome took;
  SolveSeconds columns;     // of the slowest rank
  std::size_t blocks = 0;   // of columns
  std::size_t resumed = 0;  // of them, solved by an earlier run
};

void tell(const RunOutcome& outcome, const RunReport& report);
nlohmann::ordered_json json_of(const RunOutcome& outcome, const RunReport& report);

// "-": standard output. Errors: OperationError, InputError where it cannot be written.
void write_json(const nlohmann::ordered_json& report, const std::string& where);

}  // namespace palpate
