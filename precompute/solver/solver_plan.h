// Predicts the memory and the time of a run before it starts, and from them chooses the preconditioner.
#pragma once

#include <cstdint>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>

#include "precompute/elements/stiffness.h"
#include "precompute/solver/elimination.h"
#include "precompute/solver/memory_left.h"
#include "precompute/solver/solver_estimate.h"

namespace palpate {

struct PlanRequest {
  const BlockMatrix& matrix;
  std::span<const std::int32_t> column_rows;  // the block row of each node that has columns; three each
  std::int64_t stored_rows = 0;               // nodes whose displacement is written for each column
  int columns_at_a_time = 0;                  // 0: the plan chooses
  double available_bytes = 0;                 // what this process may take beyond what it holds: memory_left_bytes()
  double bundle_bytes = 0;                    // of the file
  int ranks = 1;                              // they share the columns
  int cores = 1;                              // cores of this machine, for useful_ranks
  double all_available_bytes = 0;             // what all processes on this machine may take, for useful_ranks
  const PressureForm* form = nullptr;         // of the matrix: what the factor would be made of; null: the matrix
  int ranks_here = 1;                         // on this machine
  double sharable_bytes = 0;                  // sharable_bytes() of machine_memory.h
};

struct SolverPlan {
  bool cholesky = true;
  bool single = false;         // the factor in single precision
  bool shares_factor = false;  // the ranks of a machine hold one factor and compute it together
  std::string why;
  SolveSize size;
  SolverEstimate factor, single_factor, multigrid;
  double available_bytes = 0;
  double bundle_bytes = 0;
  std::int64_t rows = 0, blocks = 0;  // of K: nodes, and 3 x 3 blocks that are not zero
  std::int64_t form_blocks = 0;       // 4 x 4 blocks of its pressure form, where that is factored
  std::int64_t columns = 0;           // to solve
  int ranks = 1, ranks_here = 1;
  double sharable_bytes = 0;
  int ranks_per_operator = 1;                      // more than one: no time is predicted, and there is no elimination
  int useful_ranks = 1;                            // on this machine: the fewest that are within a tenth of the fastest
  double order_seconds = 0;                        // taken, not predicted
  double flops_per_second = 0;                     // of the triangular solves' kernel, measured when planning
  std::shared_ptr<const Elimination> elimination;  // exact: the factor's pattern

  const SolverEstimate& chosen() const { return !cholesky ? multigrid : single ? single_factor : factor; }
  int width() const { return chosen().width; }
  // Whether `here` ranks of a machine can share the factor of this estimate; what each of them then takes of the machine's memory.
  bool can_share(const SolverEstimate& estimate, int here) const;
  double bytes_of_rank(const SolverEstimate& estimate, int here) const;
  double seconds() const;                // setup and columns of one rank
  double seconds_with(int ranks) const;  // the same with that many ranks on this machine
};

// Orders the rows (which counts the factor's numbers and operations exactly), times the kernel for some hundredths of a
// second, and chooses the first that fits into the memory: the factor, the factor in single precision, multigrid. Errors: OperationError (memory).
SolverPlan make_plan(const PlanRequest& request);

// Operations per second of the triangular solves' kernel on this machine; block: 3, or 4 for the pressure form. Takes some
// hundredths of a second.
double kernel_rate(int block);

// Processor cores that this process may use.
int usable_cores();

// The plan as a screen of text, and as JSON.
std::string plan_text(const SolverPlan& plan);
nlohmann::json plan_json(const SolverPlan& plan);

// What the run took, to be compared with the plan. bytes: from the process's size at the time of the plan to its peak.
struct PlanOutcome {
  double seconds = 0;  // setup and columns, the slowest rank
  double bytes = 0;
  double bundle_bytes = 0;
};
std::string outcome_text(const SolverPlan& plan, const PlanOutcome& outcome);
nlohmann::json outcome_json(const SolverPlan& plan, const PlanOutcome& outcome);

}  // namespace palpate
