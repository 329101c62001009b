// Columns of the compliance -> rows of T^u as they are stored, and what storing them loses, in one pass.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace palpate {

// Sums of squares of each row of a block, and of what a cast to float took from them.
struct CastLoss {
  std::vector<double> whole, lost;

  // The largest relative error of a row, in the 2-norm.
  double worst() const;
};

// columns: C, [3 rows][width], width a multiple of 8; column 3 i + j is dof j of the block's i-th node. rows: of each
// vertex wanted, -1 where it does not move. force: C_kk^-1 of each node of the block. Writes T^u = C C_kk^-1 as
// out[3 nodes][vertices][3] and, where loss is given, adds to it. Value: float or double.
template <class Value>
void displacement_rows(const double* columns, int width, std::span<const std::int32_t> rows,
                       std::span<const std::array<double, 9>> force, Value* out, CastLoss* loss);

}  // namespace palpate
