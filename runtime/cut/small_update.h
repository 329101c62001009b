// The small matrices of one change of a compliance: C' = C - C G X G^T C for K' = K + G S G^T.
#pragma once

#include <algorithm>
#include <cmath>

namespace palpate {

inline constexpr int kMostColumns = 30;  // of G: a tetrahedron of p1-ang is removed

struct SmallMatrix {
  double m[kMostColumns][kMostColumns] = {};
};

// l l^T = a, of n rows. A pivot below its share of the diagonal is rounding, as of a compliance in single precision, and gets a column of zeros.
// False where a number is not finite.
inline bool factor_semidefinite(int n, const SmallMatrix& a, double share_of_rounding, SmallMatrix* l) {
  for (int j = 0; j < n; ++j) {
    double pivot = a.m[j][j];
    for (int k = 0; k < j; ++k) pivot -= l->m[j][k] * l->m[j][k];
    if (!std::isfinite(pivot)) return false;
    const bool zero = pivot <= share_of_rounding * a.m[j][j] || pivot <= 0;
    const double root = zero ? 0 : std::sqrt(pivot);
    for (int i = 0; i < n; ++i) {
      if (i < j || zero) {
        l->m[i][j] = 0;
        continue;
      }
      double sum = a.m[i][j];
      for (int k = 0; k < j; ++k) sum -= l->m[i][k] * l->m[j][k];
      l->m[i][j] = sum / root;
    }
  }
  return true;
}

// The inverse of a symmetric matrix of n rows that is positive definite; false where it is not.
inline bool invert_definite(int n, const SmallMatrix& a, SmallMatrix* inverse) {
  SmallMatrix l, back;
  if (!factor_semidefinite(n, a, 0, &l)) return false;
  for (int j = 0; j < n; ++j)
    if (!(l.m[j][j] > 0)) return false;
  for (int c = 0; c < n; ++c)  // back: the inverse of l
    for (int i = c; i < n; ++i) {
      double sum = i == c;
      for (int k = c; k < i; ++k) sum -= l.m[i][k] * back.m[k][c];
      back.m[i][c] = sum / l.m[i][i];
    }
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      double sum = 0;
      for (int k = std::max(i, j); k < n; ++k) sum += back.m[k][i] * back.m[k][j];
      inverse->m[i][j] = sum;
    }
  return true;
}

// t: G^T C G, positive semi-definite. x gets S (I + t S)^-1, and least a bound from below for the smallest eigenvalue of I + t S, up to the
// factor of the square root of n: how little of its stiffness the softest motion keeps. False where K' is not positive definite.
inline bool solve_small(int n, const SmallMatrix& t, const SmallMatrix& s, SmallMatrix* x, double* least) {
  SmallMatrix l, sl, inner, inverse;
  *least = 0;
  if (!factor_semidefinite(n, t, 1e-13, &l)) return false;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      for (int k = j; k < n; ++k) sl.m[i][j] += s.m[i][k] * l.m[k][j];
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      inner.m[i][j] = i == j;
      for (int k = i; k < n; ++k) inner.m[i][j] += l.m[k][i] * sl.m[k][j];
    }
  if (!invert_definite(n, inner, &inverse)) return false;
  double squares = 0;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) squares += inverse.m[i][j] * inverse.m[i][j];
  *least = 1 / std::sqrt(squares);
  SmallMatrix half;  // s l inner^-1
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      for (int k = 0; k < n; ++k) half.m[i][j] += sl.m[i][k] * inverse.m[k][j];
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      x->m[i][j] = s.m[i][j];
      for (int k = 0; k < n; ++k) x->m[i][j] -= half.m[i][k] * sl.m[j][k];
    }
  return true;
}

// x = (own - t)^-1 for a jump of three axes with the stiffness `own`, of which t = B^T C B is what the body gives way. least as above.
inline bool solve_jump(const SmallMatrix& own, const SmallMatrix& t, SmallMatrix* x, double* least) {
  SmallMatrix l, back, scaled, minus, inner;
  *least = 0;
  if (!factor_semidefinite(3, own, 1e-13, &l)) return false;
  for (int c = 0; c < 3; ++c) {  // back: the inverse of l
    if (!(l.m[c][c] > 0)) return false;
    for (int i = c; i < 3; ++i) {
      double sum = i == c;
      for (int k = c; k < i; ++k) sum -= l.m[i][k] * back.m[k][c];
      back.m[i][c] = sum / l.m[i][i];
    }
  }
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k <= i; ++k)
        for (int m = 0; m <= j; ++m) scaled.m[i][j] += back.m[i][k] * t.m[k][m] * back.m[j][m];
  for (int i = 0; i < 3; ++i) minus.m[i][i] = -1;
  if (!solve_small(3, scaled, minus, &inner, least)) return false;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      x->m[i][j] = 0;
      for (int k = i; k < 3; ++k)
        for (int m = j; m < 3; ++m) x->m[i][j] -= back.m[k][i] * inner.m[k][m] * back.m[m][j];
    }
  return true;
}

}  // namespace palpate
