#include "runtime/dense/updated_cholesky.h"

#include <algorithm>
#include <cmath>

#include "runtime/dense/dense_panels.h"
#include "runtime/dense/dense_rows.h"

namespace palpate {

bool UpdatedCholesky::create(SceneMemory& memory, std::int32_t capacity) {
  capacity_ = capacity;
  const std::size_t rows = static_cast<std::size_t>(capacity);
  stride_ = odd_lines(rows + 1 + kOverrun);  // room for the numbers that inner loops overwrite after a row's end
  factor_ = memory.array<double>(rows * stride_);
  leaving_ = memory.array<double>(kBatch * stride_);
  memory.keep(size_);
  memory.keep_array(factor_, rows * stride_, size_, stride_);
  return !memory.failed();
}

bool UpdatedCholesky::append(std::int32_t count, double least, double* raised) {
  const std::int32_t end = size_ + count;
  for (std::int32_t first = 0, rows = 0; first < end; first += rows) {
    // Old rows: only their new columns are eliminated. New rows: first their corner is factored, then all columns right of it.
    const bool old = first < size_;
    rows = std::min(kPanelRows, (old ? size_ : end) - first);
    if (!old) {
      eliminate_rows(factor_, stride_, first, rows, first, first + rows, false);
      if (!factor_corner(first, rows, least, raised + (first - size_))) return false;
    }
    eliminate_rows(factor_, stride_, first, rows, old ? size_ : first + rows, end, true);
  }
  size_ = end;
  return true;
}

bool UpdatedCholesky::factor_corner(std::int32_t first, std::int32_t rows, double least, double* raised) {
  for (std::int32_t r = 0; r < rows; ++r) {
    double* u = row(first + r) + first;
    if (!std::isfinite(u[r])) return false;
    raised[r] = std::max(0.0, least - u[r]);
    u[r] = std::sqrt(std::max(least, u[r]));
    const double inverse = 1 / u[r];
    for (std::int32_t j = r + 1; j < rows; ++j) u[j] *= inverse;
    double* below = u;
    for (std::int32_t i = r + 1; i < rows; ++i) {
      below += stride_;
      const double head = u[i];
      for (std::int32_t j = i; j < rows; ++j) below[j] -= head * u[j];
    }
  }
  return true;
}

void UpdatedCholesky::remove(int count, const std::int32_t* positions) {
  // The last positions first, because removing a row changes the positions after it.
  while (count > 0) {
    const int batch = std::min(count, kBatch);
    count -= batch;
    remove_batch(batch, positions + count);
  }
}

// One pass over the factor: moves every row that stays to its new position without the columns that leave, and eliminates from
// it the removed rows above it.
void UpdatedCholesky::remove_batch(int count, const std::int32_t* positions) {
  double* below[kBatch];
  int left = 0;  // rows removed so far
  for (std::int32_t i = positions[0]; i < size_; ++i) {
    const bool leaves = left < count && positions[left] == i;
    const double* from = row(i);
    double* to = leaves ? leaving_ + static_cast<std::size_t>(left) * stride_ : row(i - left);
    // Copies columns i and later of the old numbering, without those that leave, to their new numbers.
    std::int32_t column = leaves ? i + 1 : i, to_column = i - left;
    for (int k = leaves ? left + 1 : left; k <= count; ++k) {
      const std::int32_t end = k < count ? positions[k] : size_;
      std::copy(from + column, from + end, to + to_column);
      to_column += end - column;
      column = end + 1;
    }
    if (leaves) {
      below[left++] = to;
      continue;
    }
    const std::int32_t pivot = i - left;
    double tail = 0, v[kBatch];
    for (int k = 0; k < left; ++k) tail += below[k][pivot] * below[k][pivot];
    if (!(tail > 0)) continue;
    // The reflection that makes the entries below the pivot zero and the pivot positive.
    const double head = to[pivot], size = std::sqrt(head * head + tail), v0 = -tail / (head + size);
    for (int k = 0; k < left; ++k) v[k] = below[k][pivot] / v0;
    const double tau = 2 * v0 * v0 / (v0 * v0 + tail);
    to[pivot] = size;
    double* rest[kBatch];
    for (int k = 0; k < left; ++k) rest[k] = below[k] + pivot + 1;
    reflect_rows(size_ - count - pivot - 1, left, tau, v, to + pivot + 1, rest);
  }
  // Rows above the first removed one only lose columns.
  for (std::int32_t i = 0; i < positions[0]; ++i) {
    double* u = row(i);
    for (int k = 0; k < count; ++k) {
      const std::int32_t end = k + 1 < count ? positions[k + 1] : size_;
      std::copy(u + positions[k] + 1, u + end, u + positions[k] - k);
    }
  }
  size_ -= count;
}

void UpdatedCholesky::solve(double* x) const {
  solve_upper(size_, factor_, stride_, x);
}

}  // namespace palpate
