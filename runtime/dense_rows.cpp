#include "runtime/dense_rows.h"

// Compiled once for AVX2 and once for the baseline, chosen when the library is loaded; the sums are the same to the bit,
// since no product is contracted into its sum. Only where the loader can choose.
#if defined(__x86_64__) && defined(__linux__) && defined(__GLIBC__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) &&                                             \
    (!defined(PALPATE_MOST_INSTRUCTIONS) || PALPATE_MOST_INSTRUCTIONS > 0)
#define PALPATE_CLONES __attribute__((target_clones("avx2", "default")))
#else
#define PALPATE_CLONES
#endif

namespace palpate {

PALPATE_CLONES void add_row(int n, double a, const double* __restrict x, double* __restrict y) {
  for (int i = 0; i < n; ++i) y[i] += a * x[i];
}

PALPATE_CLONES double dot_rows(int n, const double* __restrict x, const double* __restrict y) {
  constexpr int kLanes = 8;
  double lane[kLanes] = {};
  int i = 0;
  for (; i + kLanes <= n; i += kLanes)
    for (int l = 0; l < kLanes; ++l) lane[l] += x[i + l] * y[i + l];
  double rest = 0;
  for (; i < n; ++i) rest += x[i] * y[i];
  return ((lane[0] + lane[4]) + (lane[1] + lane[5])) + ((lane[2] + lane[6]) + (lane[3] + lane[7])) + rest;
}

PALPATE_CLONES void reflect_rows(int n, int count, double tau, const double* __restrict v, double* __restrict row,
                                 double* const* __restrict below) {
  constexpr int kBlock = 64;
  double sum[kBlock];
  for (int begin = 0; begin < n; begin += kBlock) {
    const int size = n - begin < kBlock ? n - begin : kBlock;
    double* __restrict top = row + begin;
    for (int i = 0; i < size; ++i) sum[i] = top[i];
    int k = 0;
    for (; k + 3 <= count; k += 3) {
      const double* __restrict x0 = below[k] + begin, * __restrict x1 = below[k + 1] + begin, * __restrict x2 = below[k + 2] + begin;
      const double c0 = v[k], c1 = v[k + 1], c2 = v[k + 2];
      for (int i = 0; i < size; ++i) sum[i] += c0 * x0[i] + c1 * x1[i] + c2 * x2[i];
    }
    for (; k < count; ++k) {
      const double* __restrict x = below[k] + begin;
      const double c = v[k];
      for (int i = 0; i < size; ++i) sum[i] += c * x[i];
    }
    for (int i = 0; i < size; ++i) {
      sum[i] *= tau;
      top[i] -= sum[i];
    }
    for (k = 0; k + 3 <= count; k += 3) {
      double* __restrict x0 = below[k] + begin, * __restrict x1 = below[k + 1] + begin, * __restrict x2 = below[k + 2] + begin;
      const double c0 = v[k], c1 = v[k + 1], c2 = v[k + 2];
      for (int i = 0; i < size; ++i) {
        x0[i] -= c0 * sum[i];
        x1[i] -= c1 * sum[i];
        x2[i] -= c2 * sum[i];
      }
    }
    for (; k < count; ++k) {
      double* __restrict x = below[k] + begin;
      const double c = v[k];
      for (int i = 0; i < size; ++i) x[i] -= c * sum[i];
    }
  }
}

}  // namespace palpate
