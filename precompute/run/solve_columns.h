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
  const ReciprocitySample& sample;
  const std::vector<DisplacementSection>& sections;
  std::filesystem::path part, journal;  // begun or resumed
};

// Collective: of every block whether its slot and its rows hold. Each rank reads its share.
std::vector<char> find_safe_blocks(const ColumnJob& job, const Ranks& ranks);

struct SolveSeconds {
  double solve = 0;
  double wait = 0;  // for the disk
};

// The blocks that are not safe are divided among the groups in turn; stops early when another rank has failed. Errors:
// OperationError; InputError when PETSc did not use some of its options.
void solve_columns(const ColumnJob& job, const std::vector<char>& safe, Ranks& ranks, const RankGroup& group,
                   BlockSolver& solver, SolveSeconds* seconds);

}  // namespace palpate
