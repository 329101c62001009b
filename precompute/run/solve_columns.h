// Solves all columns: each group of ranks takes its share of the batches, and a thread writes one batch while the next
// is solved.
#pragma once

#include <filesystem>
#include <vector>

#include "precompute/journal/batch_writer.h"
#include "precompute/ranks/rank_group.h"

namespace palpate {

struct ColumnJob {
  const Discretisation& discretisation;
  const HeldStiffness& held;
  const std::vector<ColumnBatch>& batches;
  ReciprocitySample& sample;  // filled in when the certificate is made
  const std::vector<DisplacementSection>& sections;
  std::filesystem::path part, journal;  // laid out by rank 0
};

// For each batch: 1 where an earlier run solved it and its record and rows on the disk are whole, else 0.
using SafeBatches = std::vector<std::uint8_t>;

// Checks the batches of this rank's share against the disk; 0 for all others. Errors: OperationError where the files
// cannot be read.
SafeBatches find_safe_batches(const ColumnJob& job, const Ranks& ranks);

// The batches that are safe according to any rank, from what each rank has found. Collective.
SafeBatches agree_on_safe_batches(SafeBatches found, const Ranks& ranks);

struct SolveSeconds {
  double solve = 0;
  double wait = 0;  // of the solver, for the thread that writes
};

// Collective. The groups of ranks take the batches that are not safe in turn. Stops early where another rank has
// failed. Errors: OperationError; InputError where PETSc did not use an option that the user gave.
SolveSeconds solve_columns(const ColumnJob& job, const SafeBatches& safe, Ranks& ranks, const RankGroup& group,
                           ColumnSolver& solver);

}  // namespace palpate
