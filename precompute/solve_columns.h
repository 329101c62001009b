// The columns of one rank: solve a block, write its rows, keep its record.
#pragma once

#include <filesystem>
#include <map>
#include <vector>

#include "precompute/displacement_sections.h"
#include "precompute/ranks.h"

namespace palpate {

struct ColumnJob {
  const HeldStiffness& held;
  const ElasticBody& body;
  const std::vector<ColumnBlock>& blocks;
  const ReciprocitySample& sample;
  const std::vector<DisplacementSection>& sections;
  std::filesystem::path part;  // the laid-out file
};

struct SolveSeconds {
  double solve = 0, write = 0;
};

// Rank r takes blocks r, r + count, ... Returns the records of this rank's blocks; stops early when another rank has
// failed. Errors: OperationError; InputError when PETSc did not use some of its options.
std::map<std::size_t, BlockRecord> solve_columns(const ColumnJob& job, const Ranks& ranks, ColumnSolver& solver,
                                                 SolveSeconds* seconds);

}  // namespace palpate
