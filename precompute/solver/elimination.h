// The order in which the factorisation eliminates the block rows of K or of its pressure form, and the pattern of the factor.
// Both follow from the pattern of the matrix alone, so that size and cost of the factor are known before it is computed.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "precompute/elements/pressure_form.h"
#include "precompute/elements/stiffness.h"

namespace palpate {

// The order is METIS's nested dissection of the graph of block rows, which keeps the factor sparse. The supernodes are
// CHOLMOD's: runs of columns of the factor that share one pattern. Rows and columns are counted in blocks. The rows of a
// block always have the same pattern, so an analysis of the block rows gives the supernodes of the matrix.
struct Elimination {
  int block = 3;  // rows of a block: 3 for K, 4 for its pressure form
  // The place of a block row is its position in the order.
  std::vector<std::int32_t> order;  // [block rows]: order[place] = block row
  std::vector<std::int32_t> place;  // [block rows]: place[block row]
  std::vector<std::int32_t>
      first;  // [supernodes + 1]: supernode s has the columns at places first[s] .. first[s + 1] - 1
  std::vector<std::int64_t> row_begin;  // [supernodes + 1] into rows
  std::vector<std::int32_t> rows;  // of each supernode: places of its nonzero rows below its own columns, ascending

  std::int64_t numbers() const;  // that the factor stores, with the zeros inside its supernodes
  double factor_flops() const;   // floating-point operations of the factorisation
};

// Matrices with the same pattern get the same elimination. Errors: OperationError (memory).
Elimination analyse_elimination(const BlockMatrix& matrix);
Elimination analyse_elimination(const PressureForm& form);

// Renumbers the rows of held, and of its pressure form where there is one, in the order of elimination, so that triangular
// solves and products read memory in order. Returns the elimination of the renumbered matrix, in which each place is the row
// itself.
std::shared_ptr<const Elimination> put_in_order(HeldStiffness& held, const Elimination& elimination,
                                                PressureForm* form = nullptr);

}  // namespace palpate
