// The inner loops of the small dense systems: whole rows at a time, in an order of sums that no instruction set changes.
#pragma once

#include <cstddef>

namespace palpate {

// So many numbers to a row hold `count` of them and fill an odd number of cache lines: then the entries of a column do not
// all fall into the same few places of the cache.
constexpr std::size_t odd_lines(std::size_t count) {
  constexpr std::size_t line = 64 / sizeof(double);
  return ((count + line - 1) / line | 1) * line;
}

// x = (U^T U)^-1 x, U upper triangular by rows of `stride` numbers. Cost: n^2 multiply-adds.
void solve_upper(int n, const double* u, std::size_t stride, double* x);

// sum of x[i] y[i], in sixteen running sums
double dot_rows(int n, const double* x, const double* y);

// One Householder reflection of a row and `count` rows below it, vector [1, v_1 .. v_count]:
// s = tau (row + sum v_k below_k); row -= s; below_k -= v_k s. Up to kOverrun numbers after the n-th are overwritten.
constexpr int kOverrun = 31;
void reflect_rows(int n, int count, double tau, const double* v, double* row, double* const* below);

}  // namespace palpate
