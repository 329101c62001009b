// 3 x 3 matrices, as blocks of K, of its inverse and of T^f. The one inverse of such a block stands here.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace palpate {

using Matrix3 = std::array<double, 9>;  // row-major

inline Matrix3 multiply(const Matrix3& a, const Matrix3& b) {
  Matrix3 product{};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int m = 0; m < 3; ++m) product[3 * i + j] += a[3 * i + m] * b[3 * m + j];
  return product;
}

inline Matrix3 absolute(Matrix3 a) {
  for (double& x : a) x = std::abs(x);
  return a;
}

inline double largest(const Matrix3& a) {
  double found = 0;
  for (const double x : a) found = std::max(found, std::abs(x));
  return found;
}

// The inverse of a symmetric block on the dofs that are free (fixed: [3], 1 where a dof is held), zero on the others.
// By Cholesky's factors, symmetric to the last bit. False where the block is not positive definite on the free dofs.
// Only the lower triangle of a is read.
inline bool invert_on_free(const Matrix3& a, const std::uint8_t* fixed, Matrix3* inverse) {
  int dofs[3], count = 0;
  for (int d = 0; d < 3; ++d)
    if (!fixed[d]) dofs[count++] = d;
  *inverse = Matrix3{};
  double factor[3][3] = {}, inverse_factor[3][3] = {};
  for (int i = 0; i < count; ++i)
    for (int j = 0; j <= i; ++j) {
      double sum = a[3 * dofs[i] + dofs[j]];
      for (int m = 0; m < j; ++m) sum -= factor[i][m] * factor[j][m];
      if (i == j && !(sum > 0)) return false;
      factor[i][j] = i == j ? std::sqrt(sum) : sum / factor[j][j];
    }
  for (int j = 0; j < count; ++j)
    for (int i = j; i < count; ++i) {
      double sum = i == j ? 1.0 : 0.0;
      for (int m = j; m < i; ++m) sum -= factor[i][m] * inverse_factor[m][j];
      inverse_factor[i][j] = sum / factor[i][i];
    }
  for (int i = 0; i < count; ++i)
    for (int j = 0; j < count; ++j)
      for (int m = 0; m < count; ++m) (*inverse)[3 * dofs[i] + dofs[j]] += inverse_factor[m][i] * inverse_factor[m][j];
  return true;
}

}  // namespace palpate
