// The columns of one rank: solve a block, hand it to the disk, solve the next.
#pragma once

#include <filesystem>
#include <vector>

#include "precompute/journal/block_writer.h"
#include "precompute/ranks/rank_group.h"

namespace palpate {

struct ColumnJob {
  const Discretisation& discretisation;
  const HeldStiffness& held;
  const std::vector<ColumnBlock>& blocks;
  ReciprocitySample& sample;  // filled by the certificate, in the end
  const std::vector<DisplacementSection>& sections;
  std::filesystem::path part, journal;  // begun or resumed
};

// For every block: 1 where an earlier run solved it, and its record and rows on the disk are whole.
using SafeBlocks = std::vector<std::uint8_t>;

// Of the blocks that this rank checks: each rank reads its share of the files.
SafeBlocks find_safe_blocks(const ColumnJob& job, const Ranks& ranks);

// Collective: what any rank has found.
SafeBlocks agree_on_safe_blocks(SafeBlocks found, const Ranks& ranks);

struct SolveSeconds {
  double solve = 0;
  double wait = 0;  // for the disk
};

// The blocks that are not safe are divided among the groups in turn; stops early when another rank has failed. Errors:
// OperationError; InputError when PETSc did not use some of its options.
SolveSeconds solve_columns(const ColumnJob& job, const SafeBlocks& safe, Ranks& ranks, const RankGroup& group,
                           BlockSolver& solver);

}  // namespace palpate
