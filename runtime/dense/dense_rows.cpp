#include "runtime/dense/dense_rows.h"

#include <cstring>

#include "runtime/base/instructions.h"

namespace palpate {
namespace {

template <int Lanes>
PALPATE_INLINE double sum_of_lanes(double* lane) {
  for (int half = Lanes / 2; half > 0; half /= 2)
    for (int l = 0; l < half; ++l) lane[l] += lane[l + half];
  return lane[0];
}

PALPATE_INLINE double dot(int n, const double* __restrict x, const double* __restrict y) {
  constexpr int kLanes = 16;
  double rest = 0;
  if (n < kLanes) {  // the sum of the lanes would be zero
    for (int i = 0; i < n; ++i) rest += x[i] * y[i];
    return 0.0 + rest;
  }
  double lane[kLanes] = {};
  int i = 0;
  for (; i + kLanes <= n; i += kLanes)
    for (int l = 0; l < kLanes; ++l) lane[l] += x[i + l] * y[i + l];
  for (; i < n; ++i) rest += x[i] * y[i];
  return sum_of_lanes<kLanes>(lane) + rest;
}

// The same sums as solve() for fewer rows than it takes at a time.
void solve_few(int n, const double* __restrict u, std::size_t stride, double* __restrict x) {
  const auto at = [&](int i, int j) { return u[static_cast<std::size_t>(i) * stride + static_cast<std::size_t>(j)]; };
  for (int i = 0; i < n; ++i) {
    x[i] *= 1 / at(i, i);
    for (int j = i + 1; j < n; ++j) x[j] -= x[i] * at(i, j);
  }
  for (int i = n - 1; i >= 0; --i) {
    double sum = 0;
    for (int j = i + 1; j < n; ++j) sum += at(i, j) * x[j];
    x[i] = (x[i] - sum) * (1 / at(i, i));
  }
}

// Forward and backward substitution, four rows at a time: each part of x is read once for four rows, and the eight partial sums
// of a row do not wait for one another. The divisions do not wait for x: they are of the diagonal alone.
template <class Vector>
PALPATE_INLINE void solve(int n, const double* __restrict u, std::size_t stride, double* __restrict x) {
  constexpr int kRows = 4, kLanes = 8, kVectors = kLanes * sizeof(double) / sizeof(Vector);
  const auto row = [&](int i) { return u + static_cast<std::size_t>(i) * stride; };
  int i = 0;
  for (; i + kRows <= n; i += kRows) {
    const double *u0 = row(i), *u1 = row(i + 1), *u2 = row(i + 2), *u3 = row(i + 3);
    const double inverse0 = 1 / u0[i], inverse1 = 1 / u1[i + 1], inverse2 = 1 / u2[i + 2], inverse3 = 1 / u3[i + 3];
    const double x0 = x[i] * inverse0;
    const double x1 = (x[i + 1] - x0 * u0[i + 1]) * inverse1;
    const double x2 = (x[i + 2] - x0 * u0[i + 2] - x1 * u1[i + 2]) * inverse2;
    const double x3 = (x[i + 3] - x0 * u0[i + 3] - x1 * u1[i + 3] - x2 * u2[i + 3]) * inverse3;
    x[i] = x0, x[i + 1] = x1, x[i + 2] = x2, x[i + 3] = x3;
    for (int j = i + kRows; j < n; ++j) x[j] = x[j] - x0 * u0[j] - x1 * u1[j] - x2 * u2[j] - x3 * u3[j];
  }
  for (; i < n; ++i) {
    x[i] *= 1 / row(i)[i];
    for (int j = i + 1; j < n; ++j) x[j] -= x[i] * row(i)[j];
  }

  for (i = n - 1; i >= n / kRows * kRows; --i) {
    double sum = 0;
    for (int j = i + 1; j < n; ++j) sum += row(i)[j] * x[j];
    x[i] = (x[i] - sum) * (1 / row(i)[i]);
  }
  for (i -= kRows - 1; i >= 0; i -= kRows) {
    Vector lanes[kRows][kVectors] = {}, left, right;
    double inverse[kRows];
    for (int r = 0; r < kRows; ++r) inverse[r] = 1 / row(i + r)[i + r];
    double sum[kRows] = {};
    int j = i + kRows;
    for (; j + kLanes <= n; j += kLanes)
      for (int w = 0; w < kVectors; ++w) {
        const int at = j + w * (kLanes / kVectors);
        std::memcpy(&right, x + at, sizeof right);
        for (int r = 0; r < kRows; ++r) {
          std::memcpy(&left, row(i + r) + at, sizeof left);
          lanes[r][w] += left * right;
        }
      }
    for (; j < n; ++j)
      for (int r = 0; r < kRows; ++r) sum[r] += row(i + r)[j] * x[j];
    for (int r = kRows - 1; r >= 0; --r) {
      double lane[kLanes];
      std::memcpy(lane, lanes[r], sizeof lane);
      sum[r] += sum_of_lanes<kLanes>(lane);
      for (int s = r + 1; s < kRows; ++s) sum[r] += row(i + r)[i + s] * x[i + s];
      x[i + r] = (x[i + r] - sum[r]) * inverse[r];
    }
  }
}

// Four vectors side by side, so that their sums stay in registers.
template <class Vector>
PALPATE_INLINE void reflect(int n, int count, double tau, const double* v, double* row, double* const* below) {
  constexpr int kLanes = sizeof(Vector) / sizeof(double), kSide = 4;
  static_assert(kSide * kLanes <= kOverrun + 1);
  for (int begin = 0; begin < n; begin += kSide * kLanes) {
    Vector sum[kSide], x;
    for (int w = 0; w < kSide; ++w) std::memcpy(&sum[w], row + begin + w * kLanes, sizeof x);
    for (int k = 0; k < count; ++k)
      for (int w = 0; w < kSide; ++w) {
        std::memcpy(&x, below[k] + begin + w * kLanes, sizeof x);
        sum[w] += v[k] * x;
      }
    for (int w = 0; w < kSide; ++w) {
      sum[w] *= tau;
      std::memcpy(&x, row + begin + w * kLanes, sizeof x);
      x -= sum[w];
      std::memcpy(row + begin + w * kLanes, &x, sizeof x);
    }
    for (int k = 0; k < count; ++k)
      for (int w = 0; w < kSide; ++w) {
        double* at = below[k] + begin + w * kLanes;
        std::memcpy(&x, at, sizeof x);
        x -= v[k] * sum[w];
        std::memcpy(at, &x, sizeof x);
      }
  }
}

PALPATE_INLINE void add(int n, double factor, const double* x, double* __restrict y) {
  for (int i = 0; i < n; ++i) y[i] += factor * x[i];
}

#ifdef PALPATE_DISPATCHES
#define PALPATE_WITH_AVX2 __attribute__((target(PALPATE_AVX2)))
#define PALPATE_WITH_AVX512 __attribute__((target(PALPATE_AVX512)))
PALPATE_WITH_AVX2 void solve_avx2(int n, const double* u, std::size_t stride, double* x) {
  solve<Four>(n, u, stride, x);
}
PALPATE_WITH_AVX512 void solve_avx512(int n, const double* u, std::size_t stride, double* x) {
  solve<Eight>(n, u, stride, x);
}
PALPATE_WITH_AVX2 double dot_avx2(int n, const double* x, const double* y) {
  return dot(n, x, y);
}
PALPATE_WITH_AVX512 double dot_avx512(int n, const double* x, const double* y) {
  return dot(n, x, y);
}
PALPATE_WITH_AVX2 void add_avx2(int n, double factor, const double* x, double* y) {
  add(n, factor, x, y);
}
PALPATE_WITH_AVX512 void add_avx512(int n, double factor, const double* x, double* y) {
  add(n, factor, x, y);
}
PALPATE_WITH_AVX2 void reflect_avx2(int n, int count, double tau, const double* v, double* row, double* const* below) {
  reflect<Four>(n, count, tau, v, row, below);
}
PALPATE_WITH_AVX512 void reflect_avx512(int n, int count, double tau, const double* v, double* row,
                                        double* const* below) {
  reflect<Eight>(n, count, tau, v, row, below);
}
#endif

void solve_baseline(int n, const double* u, std::size_t stride, double* x) {
  solve<Two>(n, u, stride, x);
}
double dot_baseline(int n, const double* x, const double* y) {
  return dot(n, x, y);
}
void add_baseline(int n, double factor, const double* x, double* y) {
  add(n, factor, x, y);
}
void reflect_baseline(int n, int count, double tau, const double* v, double* row, double* const* below) {
  reflect<Two>(n, count, tau, v, row, below);
}

#ifdef PALPATE_DISPATCHES
// Short rows gain nothing from wide registers: the remainder is then most of the work.
Instructions best_for(int n) {
  constexpr int kShort = 40;
  return n < kShort ? Instructions::baseline : best_instructions();
}

#define PALPATE_DISPATCH(function, n, ...)      \
  switch (best_for(n)) {                        \
    case Instructions::avx512:                  \
      return function##_avx512(n, __VA_ARGS__); \
    case Instructions::avx2:                    \
      return function##_avx2(n, __VA_ARGS__);   \
    case Instructions::baseline:                \
      break;                                    \
  }                                             \
  return function##_baseline(n, __VA_ARGS__)
#else
#define PALPATE_DISPATCH(function, n, ...) return function##_baseline(n, __VA_ARGS__)
#endif

}  // namespace

void solve_upper(int n, const double* u, std::size_t stride, double* x) {
  if (n < 4) return solve_few(n, u, stride, x);
  PALPATE_DISPATCH(solve, n, u, stride, x);
}

double dot_rows(int n, const double* x, const double* y) {
  PALPATE_DISPATCH(dot, n, x, y);
}

void add_rows(int n, double factor, const double* x, double* y) {
  PALPATE_DISPATCH(add, n, factor, x, y);
}

void reflect_rows(int n, int count, double tau, const double* v, double* row, double* const* below) {
  PALPATE_DISPATCH(reflect, n, count, tau, v, row, below);
}

}  // namespace palpate
