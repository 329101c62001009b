// The order in which block rows are eliminated, and what the factor will hold: from the pattern alone, before a number
// is computed.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "precompute/elements/stiffness.h"

namespace palpate {

// Fill-reducing nested dissection (METIS through CHOLMOD) of the graph of block rows, and CHOLMOD's supernodes in that
// order: runs of columns that share one pattern. All counts in block rows; a block row is three dofs. The 3 x 3 blocks
// make the three dofs of a row inseparable, so that the supernodes of the graph are those of the matrix.
struct Elimination {
  std::vector<std::int32_t> order;      // order[place] = block row
  std::vector<std::int32_t> place;      // place[block row]
  std::vector<std::int32_t> first;      // [supernodes + 1]: its columns are places first[s] .. first[s + 1] - 1
  std::vector<std::int64_t> row_begin;  // [supernodes + 1] into rows
  std::vector<std::int32_t> rows;       // places below its own columns, ascending

  std::int64_t numbers() const;  // in the factor, explicit zeros of the supernodes included
  double factor_flops() const;
  double solve_flops() const { return 4.0 * static_cast<double>(numbers()); }  // of one column, both triangles
};

// Same pattern, same order. Errors: OperationError (memory).
Elimination analyse_elimination(const BlockMatrix& matrix);

// Renumbers the rows of held in the order of elimination, so that its solves and products go through memory in order;
// returns the elimination of the renumbered matrix.
std::shared_ptr<const Elimination> put_in_order(HeldStiffness& held, const Elimination& elimination);

}  // namespace palpate
