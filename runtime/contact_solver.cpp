#include "runtime/contact_solver.h"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

// A = U^T U in place of factor's upper rows; rows apart by stride. Returns the least pivot, or -1 when one is not
// positive. Four rows of U are applied at a time; every inner loop is a sum of whole rows, which compilers vectorise.
double cholesky(const double* matrix, double shift, int n, int stride, double* factor) {
  for (int i = 0; i < n; ++i) {
    std::copy(matrix + i * stride + i, matrix + i * stride + n, factor + i * stride + i);
    factor[i * stride + i] += shift;
  }
  double least = n > 0 ? INFINITY : 1;
  for (int k = 0; k < n; k += 4) {
    const int panel = std::min(4, n - k);
    for (int p = 0; p < panel; ++p) {  // the panel's own rows
      double* row = factor + (k + p) * stride;
      for (int q = 0; q < p; ++q) {
        const double* above = factor + (k + q) * stride;
        const double c = above[k + p];
        for (int j = k + p; j < n; ++j) row[j] -= c * above[j];
      }
      const double pivot = row[k + p];
      if (!(pivot > 0) || !std::isfinite(pivot)) return -1;
      least = std::min(least, pivot);
      const double inverse = 1 / std::sqrt(pivot);
      for (int j = k + p; j < n; ++j) row[j] *= inverse;
    }
    if (panel < 4) break;
    const double *u0 = factor + k * stride, *u1 = u0 + stride, *u2 = u1 + stride, *u3 = u2 + stride;
    for (int i = k + 4; i < n; ++i) {
      double* __restrict row = factor + i * stride;
      const double c0 = u0[i], c1 = u1[i], c2 = u2[i], c3 = u3[i];
      for (int j = i; j < n; ++j) row[j] -= c0 * u0[j] + c1 * u1[j] + c2 * u2[j] + c3 * u3[j];
    }
  }
  return least;
}

// Solves U^T U x = b in place.
void solve_factored(const double* factor, int n, int stride, double* x) {
  for (int i = 0; i < n; ++i) {
    const double* row = factor + i * stride;
    x[i] /= row[i];
    for (int j = i + 1; j < n; ++j) x[j] -= row[j] * x[i];
  }
  for (int i = n - 1; i >= 0; --i) {
    const double* row = factor + i * stride;
    double sum = x[i];
    for (int j = i + 1; j < n; ++j) sum -= row[j] * x[j];
    x[i] = sum / row[i];
  }
}

// trace((U^T U)^-1) = sum of squares of U^-T, one column at a time.
double trace_of_inverse(const double* factor, int n, int stride, double* column) {
  double trace = 0;
  for (int c = 0; c < n; ++c) {
    std::fill(column + c, column + n, 0.0);
    column[c] = 1;
    for (int i = c; i < n; ++i) {
      const double* row = factor + i * stride;
      column[i] /= row[i];
      trace += column[i] * column[i];
      for (int j = i + 1; j < n; ++j) column[j] -= row[j] * column[i];
    }
  }
  return trace;
}

}  // namespace

bool self_compliance(const double force[9], Mat3* compliance) {
  double m[3][3];
  bool moves[3];
  for (int i = 0; i < 3; ++i) moves[i] = force[4 * i] != 0;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      m[i][j] = 0.5 * (force[3 * i + j] + force[3 * j + i]);
      if (!moves[i] || !moves[j]) m[i][j] = i == j ? 1 : 0;
    }
  // Adjugate over determinant; positive leading minors make it positive definite.
  const double c00 = m[1][1] * m[2][2] - m[1][2] * m[1][2], c01 = m[0][2] * m[1][2] - m[0][1] * m[2][2],
               c02 = m[0][1] * m[1][2] - m[0][2] * m[1][1], c11 = m[0][0] * m[2][2] - m[0][2] * m[0][2],
               c12 = m[0][1] * m[0][2] - m[0][0] * m[1][2], c22 = m[0][0] * m[1][1] - m[0][1] * m[0][1];
  const double determinant = m[0][0] * c00 + m[0][1] * c01 + m[0][2] * c02;
  const double inverse[3][3] = {{c00, c01, c02}, {c01, c11, c12}, {c02, c12, c22}};
  if (!(m[0][0] > 0 && c22 > 0 && determinant > 0 && std::isfinite(determinant))) return false;
  bool finite = true;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      compliance->m[i][j] = moves[i] && moves[j] ? inverse[i][j] / determinant : 0;
      finite = finite && std::isfinite(compliance->m[i][j]);
    }
  return finite;
}

bool ContactSolver::create(SceneMemory& memory, std::int32_t entry_capacity) {
  capacity_ = entry_capacity;
  const std::size_t rows = 3 * static_cast<std::size_t>(entry_capacity), entries = rows / 3;
  matrix_ = memory.array<double>(rows * rows);
  factor_ = memory.array<double>(rows * rows);
  scale_ = memory.array<double>(rows);
  right_ = memory.array<double>(rows);
  self_ = memory.array<Mat3>(entries);
  row_of_ = memory.array<std::int32_t>(rows);
  kept_entry_ = memory.array<ContactEntry>(entries);
  kept_block_ = memory.array<ContactBlock>(entries);
  return !memory.failed();
}

// C_ab = T^u_ab C_bb, the mean of both ways of reading it: Betti's symmetry holds only as well as the store.
Mat3 ContactSolver::node_compliance(const Tensors& tensors, const ContactEntry& a, int a_index, const ContactEntry& b,
                                    int b_index) const {
  if (a.column == b.column) return self_[a_index];
  const Mat3 one = tensors.displacement(a.node, b.column) * self_[b_index],
             other = tensors.displacement(b.node, a.column) * self_[a_index];
  Mat3 mean;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) mean.m[i][j] = 0.5 * (one.m[i][j] + other.m[j][i]);
  return mean;
}

Mat3 ContactSolver::block_compliance(const Tensors& tensors, const ContactSet& set, int p, int q) const {
  const ContactBlock &bp = set.blocks[p], &bq = set.blocks[q];
  Mat3 sum;
  for (int v = 0; v < bp.entry_count; ++v)
    for (int w = 0; w < bq.entry_count; ++w) {
      const int a = bp.first_entry + v, b = bq.first_entry + w;
      const Mat3 c = node_compliance(tensors, set.entries[a], a, set.entries[b], b);
      const double factor = bp.weight[v] * bq.weight[w];
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) sum.m[i][j] += factor * c.m[i][j];
    }
  return sum;
}

// H W H^T, upper part, scaled to a unit diagonal. False when a number is not finite.
bool ContactSolver::assemble(const Tensors& tensors, const ContactSet& set) {
  for (int e = 0; e < set.entry_count; ++e)
    if (!self_compliance(tensors.force + 9 * static_cast<std::size_t>(set.entries[e].column), &self_[e])) return false;
  rows_ = 0;
  for (int p = 0; p < set.block_count; ++p)
    for (int i = 0; i < 3; ++i) row_of_[3 * p + i] = set.blocks[p].axes >> i & 1u ? rows_++ : -1;
  const int stride = 3 * capacity_;
  for (int p = 0; p < set.block_count; ++p)
    for (int q = p; q < set.block_count; ++q) {
      const Mat3 c = block_compliance(tensors, set, p, q);
      for (int i = 0; i < 3; ++i)
        for (int j = p == q ? i : 0; j < 3; ++j) {
          const int row = row_of_[3 * p + i], column = row_of_[3 * q + j];
          if (row < 0 || column < 0) continue;
          if (!std::isfinite(c.m[i][j])) return false;
          matrix_[row * stride + column] = c.m[i][j];
        }
    }
  // A row without compliance (all its dofs are fixed) cannot move: it carries no force.
  for (int r = 0; r < rows_; ++r) {
    const double diagonal = matrix_[r * stride + r];
    scale_[r] = diagonal > 0 ? 1 / std::sqrt(diagonal) : 0;
  }
  for (int r = 0; r < rows_; ++r) {
    for (int c = r; c < rows_; ++c) matrix_[r * stride + c] *= scale_[r] * scale_[c];
    matrix_[r * stride + r] = 1;
  }
  return true;
}

ContactSolver::Outcome ContactSolver::factorise(const Tensors& tensors, const ContactSet& set) {
  if (!assemble(tensors, set)) return Outcome::unsolved;
  const int stride = 3 * capacity_;
  // The least pivot bounds the least eigenvalue from above, far from tightly only in contrived cases; the exact bound
  // is computed when the pivots come near it.
  const double least = cholesky(matrix_, 1e-14, rows_, stride, factor_);
  if (least > 1e3 * kLeastEigenvalue) return Outcome::solved;
  const double bound = least > 0 ? 1 / trace_of_inverse(factor_, rows_, stride, right_) : 0;
  if (bound >= kLeastEigenvalue) return Outcome::solved;
  // Rounding of the stored tensors may have pushed an eigenvalue below zero: then the shift grows until it is not.
  double shift = kLeastEigenvalue - std::max(0.0, bound);
  for (int attempt = 0; attempt < 12; ++attempt, shift *= 4)
    if (cholesky(matrix_, shift, rows_, stride, factor_) >= 0.1 * kLeastEigenvalue) return Outcome::regularised;
  return Outcome::unsolved;
}

bool ContactSolver::structure_is_kept(const ContactSet& set) const {
  if (set.block_count != kept_blocks_ || set.entry_count != kept_entries_) return false;
  for (int e = 0; e < set.entry_count; ++e)
    if (set.entries[e].column != kept_entry_[e].column) return false;
  for (int p = 0; p < set.block_count; ++p) {
    const ContactBlock &a = set.blocks[p], &b = kept_block_[p];
    if (a.first_entry != b.first_entry || a.entry_count != b.entry_count || a.axes != b.axes) return false;
    for (int v = 0; v < a.entry_count; ++v)
      if (a.weight[v] != b.weight[v]) return false;
  }
  return true;
}

void ContactSolver::keep_structure(const ContactSet& set) {
  std::copy(set.entries, set.entries + set.entry_count, kept_entry_);
  std::copy(set.blocks, set.blocks + set.block_count, kept_block_);
  kept_entries_ = set.entry_count, kept_blocks_ = set.block_count;
}

ContactSolver::Outcome ContactSolver::solve(const Tensors& tensors, const ContactSet& set, Vec3* force,
                                            Vec3* modified) {
  for (int e = 0; e < set.entry_count; ++e) force[e] = modified[e] = Vec3{};
  if (set.block_count == 0) return Outcome::solved;
  if (!structure_is_kept(set)) {
    keep_structure(set);
    kept_outcome_ = factorise(tensors, set);
  }
  if (kept_outcome_ == Outcome::unsolved) return kept_outcome_;

  for (int p = 0; p < set.block_count; ++p)
    for (int i = 0; i < 3; ++i)
      if (const int row = row_of_[3 * p + i]; row >= 0) right_[row] = scale_[row] * set.target[p][i];
  solve_factored(factor_, rows_, 3 * capacity_, right_);

  for (int p = 0; p < set.block_count; ++p) {
    const ContactBlock& block = set.blocks[p];
    Vec3 reaction;
    for (int i = 0; i < 3; ++i)
      if (const int row = row_of_[3 * p + i]; row >= 0) reaction[i] = scale_[row] * right_[row];
    for (int v = 0; v < block.entry_count; ++v) force[block.first_entry + v] += block.weight[v] * reaction;
  }
  bool finite = true;
  for (int e = 0; e < set.entry_count; ++e) {
    modified[e] = self_[e] * force[e];
    finite = finite && is_finite(force[e]) && is_finite(modified[e]);
  }
  if (finite) return kept_outcome_;
  for (int e = 0; e < set.entry_count; ++e) force[e] = modified[e] = Vec3{};
  return Outcome::unsolved;
}

}  // namespace palpate
