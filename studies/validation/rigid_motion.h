// Checks that a stiffness matrix gives no force for rigid motions.
#pragma once

#include <algorithm>
#include <cmath>

#include "precompute/elements/discretisation.h"

namespace palpate::validation {

// The largest force under the six rigid motions of unit size, over the largest row sum of |K|: of the size of rounding if K
// is right.
inline double rigid_motion_residual(const Discretisation& discretisation) {
  const BlockMatrix& k = discretisation.stiffness;
  double row_sum = 0, size = 1, worst = 0;
  for (std::int32_t row = 0; row < k.rows; ++row)
    for (std::size_t i = 0; i < 3; ++i) {
      double sum = 0;
      for (auto at = k.first[row]; at < k.first[row + 1]; ++at)
        for (std::size_t j = 0; j < 3; ++j) sum += std::abs(k.block[at][3 * i + j]);
      row_sum = std::max(row_sum, sum);
    }
  const auto& points = discretisation.coordinates;
  for (const auto& p : points)
    for (const double x : p) size = std::max(size, std::abs(x));
  for (std::size_t motion = 0; motion < 6; ++motion) {
    std::vector<double> u(3 * points.size(), 0.0);
    const std::size_t a = motion % 3, b = (a + 1) % 3, c = (a + 2) % 3;
    for (std::size_t n = 0; n < points.size(); ++n)
      if (motion < 3)
        u[3 * n + a] = size;
      else
        u[3 * n + b] = -points[n][c], u[3 * n + c] = points[n][b];
    for (const double f : multiply(k, u)) worst = std::max(worst, std::abs(f));
  }
  return worst / (row_sum * size);
}

}  // namespace palpate::validation
