// Solved columns of the compliance -> the rows of T^u that the bundle stores, and the error of storing them, in one
// pass.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace palpate {

// For each row of a batch: the sum of its squares, and the sum of squares of the errors that rounding to float made.
struct CastLoss {
  std::vector<double> whole, lost;

  // The largest relative error of a row, in the 2-norm.
  double worst() const;
};

// Writes T^u = C C_kk^-1 as out[3 nodes][vertices][3]. columns: C as [3 rows][width], where column 3 i + j is dof j of
// the i-th node of the batch; width is a multiple of 8. rows: the row of each vertex that is wanted, -1 where the
// vertex is held. stiffness: C_kk^-1 of each node of the batch. Where loss is given, adds the error of rounding to
// float. Value: float or double.
template <class Value>
void displacement_rows(const double* columns, int width, std::span<const std::int32_t> rows,
                       std::span<const std::array<double, 9>> stiffness, Value* out, CastLoss* loss);

}  // namespace palpate
