// The inner loops of the small dense systems: whole rows at a time, in an order of sums that no instruction set changes.
#pragma once

namespace palpate {

// y += a x
void add_row(int n, double a, const double* x, double* y);

// The same with three y and three a in one pass over x.
void add_row_to_three(int n, const double* a, const double* x, double* y0, double* y1, double* y2);

// sum of x[i] y[i], in eight running sums
double dot_rows(int n, const double* x, const double* y);

// One Householder reflection of a row and `count` rows below it, vector [1, v_1 .. v_count]:
// s = tau (row + sum v_k below_k); row -= s; below_k -= v_k s.
void reflect_rows(int n, int count, double tau, const double* v, double* row, double* const* below);

}  // namespace palpate
