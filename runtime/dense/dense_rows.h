// Inner loops of the small dense systems, over whole rows. The order of every sum is fixed, so every instruction set gives the
// same bits.
#pragma once

#include <cstddef>

namespace palpate {

// Numbers from one row to the next, for rows of `count` numbers: an odd number of cache lines, so that the entries of a column
// do not all fall into a few sets of the cache.
constexpr std::size_t odd_lines(std::size_t count) {
  constexpr std::size_t line = 64 / sizeof(double);
  return ((count + line - 1) / line | 1) * line;
}

// x = (U^T U)^-1 x; U: upper triangle by rows, `stride` numbers from one row to the next. Cost: n^2 multiply-adds.
void solve_upper(int n, const double* u, std::size_t stride, double* x);

// The sum of x[i] y[i], accumulated in sixteen partial sums.
double dot_rows(int n, const double* x, const double* y);

// y += factor x; x and y do not overlap.
void add_rows(int n, double factor, const double* x, double* y);

// Applies one Householder reflection, with the vector [1, v_1 .. v_count], to a row and to `count` rows below it:
// s = tau (row + sum_k v_k below_k); row -= s; below_k -= v_k s. Up to kOverrun numbers after the n-th are overwritten.
constexpr int kOverrun = 31;
void reflect_rows(int n, int count, double tau, const double* v, double* row, double* const* below);

}  // namespace palpate
