#include "precompute/solver/sparse_blocks.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cstddef>

#include "precompute/solver/vector_registers.h"

namespace palpate {
namespace {

// What is done with the product of one block row. The kernel tests this for each row, which costs no measurable time; four
// copies of every kernel, one for each case, took three times as long to compile.
enum class Then { store, add, subtract_from, smooth };

struct Pass {
  Then then;
  const SparseBlocks& a;
  const float* x;
  float* y;  // store, add: the result; subtract_from: the residual; smooth: the next x
  const float* b = nullptr;
  float* d = nullptr;
  const float* inverse_diagonal = nullptr;
  SmootherStep step{};
  int batch_width = 0;
};

// One block row, for the columns first_column .. first_column + kColumns - 1 of the batch. Their sums, kHeight x kColumns
// numbers, stay in registers.
template <int kHeight, int kWidth, int kColumns>
PALPATE_INLINE void one_row(const Pass& p, std::int32_t row, int first_column) {
  float sum[kHeight][kColumns] = {};
  for (auto at = p.a.first[row]; at < p.a.first[row + 1]; ++at) {
    const float* x = p.x + static_cast<std::int64_t>(p.a.column[at]) * kWidth * p.batch_width + first_column;
    const float* value = &p.a.value[at * (kHeight * kWidth)];
#pragma GCC unroll 6
    for (int j = 0; j < kWidth; ++j)
#pragma GCC unroll 6
      for (int i = 0; i < kHeight; ++i)
        for (int c = 0; c < kColumns; ++c) sum[i][c] += value[i * kWidth + j] * x[j * p.batch_width + c];
  }
  const std::int64_t place = static_cast<std::int64_t>(row) * kHeight * p.batch_width + first_column;
  float* y = p.y + place;
  if (p.then == Then::store) {
    for (int i = 0; i < kHeight; ++i)
      for (int c = 0; c < kColumns; ++c) y[i * p.batch_width + c] = sum[i][c];
    return;
  }
  if (p.then == Then::add) {
    for (int i = 0; i < kHeight; ++i)
      for (int c = 0; c < kColumns; ++c) y[i * p.batch_width + c] += sum[i][c];
    return;
  }
  const float* b = p.b + place;
  for (int i = 0; i < kHeight; ++i)
    for (int c = 0; c < kColumns; ++c) sum[i][c] = b[i * p.batch_width + c] - sum[i][c];
  if (p.then == Then::subtract_from) {
    for (int i = 0; i < kHeight; ++i)
      for (int c = 0; c < kColumns; ++c) y[i * p.batch_width + c] = sum[i][c];
    return;
  }
  if constexpr (kHeight == kWidth) {
    const float* inverse = p.inverse_diagonal + static_cast<std::int64_t>(row) * kHeight * kHeight;
    const float* x = p.x + place;
    float* d = p.d + place;
    for (int i = 0; i < kHeight; ++i) {
      float z[kColumns] = {};
      for (int j = 0; j < kHeight; ++j)
        for (int c = 0; c < kColumns; ++c) z[c] += inverse[i * kHeight + j] * sum[j][c];
      if (p.step.keep != 0)
        for (int c = 0; c < kColumns; ++c) z[c] = p.step.keep * d[i * p.batch_width + c] + p.step.take * z[c];
      else
        for (int c = 0; c < kColumns; ++c) z[c] *= p.step.take;
      for (int c = 0; c < kColumns; ++c) d[i * p.batch_width + c] = z[c];
      for (int c = 0; c < kColumns; ++c) y[i * p.batch_width + c] = x[i * p.batch_width + c] + z[c];
    }
  }
}

template <int kHeight, int kWidth>
PALPATE_VECTOR_VERSIONS void all_rows(const Pass& p) {
  for (std::int32_t row = 0; row < p.a.rows; ++row) {
    int first_column = 0;
    for (; first_column + 32 <= p.batch_width; first_column += 32) one_row<kHeight, kWidth, 32>(p, row, first_column);
    for (; first_column + 16 <= p.batch_width; first_column += 16) one_row<kHeight, kWidth, 16>(p, row, first_column);
    for (; first_column < p.batch_width; first_column += 8) one_row<kHeight, kWidth, 8>(p, row, first_column);
  }
}

void pass(const Pass& p) {
  switch (10 * p.a.height + p.a.width) {
    case 33:
      return all_rows<3, 3>(p);
    case 66:
      return all_rows<6, 6>(p);
    case 36:
      return all_rows<3, 6>(p);
    case 63:
      return all_rows<6, 3>(p);
    default:
      return all_rows<1, 1>(p);
  }
}

}  // namespace

std::int64_t SparseBlocks::bytes() const {
  return static_cast<std::int64_t>(first.size() * sizeof first[0] + column.size() * sizeof column[0] +
                                   value.size() * sizeof value[0]);
}

SparseBlocks transposed(const SparseBlocks& matrix) {
  SparseBlocks result{matrix.width, matrix.height, matrix.columns, matrix.rows, {}, {}, {}};
  result.first.assign(static_cast<std::size_t>(result.rows) + 1, 0);
  for (const auto c : matrix.column) ++result.first[c + 1];
  for (std::int32_t r = 0; r < result.rows; ++r) result.first[r + 1] += result.first[r];
  result.column.resize(matrix.column.size());
  result.value.resize(matrix.value.size());
  std::vector<std::int64_t> next(result.first.begin(), result.first.end() - 1);
  const int h = matrix.height, w = matrix.width;
  for (std::int32_t row = 0; row < matrix.rows; ++row)
    for (auto at = matrix.first[row]; at < matrix.first[row + 1]; ++at) {
      const auto to = next[matrix.column[at]]++;
      result.column[to] = row;
      for (int i = 0; i < h; ++i)
        for (int j = 0; j < w; ++j) result.value[(to * w + j) * h + i] = matrix.value[(at * h + i) * w + j];
    }
  return result;
}

std::vector<float> inverse_diagonal_blocks(const SparseBlocks& matrix) {
  const int n = matrix.height;
  std::vector<float> result(static_cast<std::size_t>(matrix.rows) * n * n, 0.0f);
  for (std::int32_t row = 0; row < matrix.rows; ++row) {
    Eigen::MatrixXd block = Eigen::MatrixXd::Zero(n, n);
    for (auto at = matrix.first[row]; at < matrix.first[row + 1]; ++at)
      if (matrix.column[at] == row)
        for (int i = 0; i < n; ++i)
          for (int j = 0; j < n; ++j) block(i, j) = matrix.value[(at * n + i) * n + j];
    block = (0.5 * (block + block.transpose())).eval();
    const Eigen::LDLT<Eigen::MatrixXd> factor(block);
    // In f32 an eigenvalue is wrong by up to 1e-7 of the largest one; below 1e-6 of it the block counts as singular.
    const bool regular = factor.info() == Eigen::Success &&
                         factor.vectorD().minCoeff() > 1e-6 * std::max(factor.vectorD().maxCoeff(), 0.0);
    Eigen::MatrixXd inverse = Eigen::MatrixXd::Identity(n, n);
    if (regular)
      inverse = factor.solve(inverse);
    else
      for (int i = 0; i < n; ++i)
        if (block(i, i) > 0) inverse(i, i) = 1 / block(i, i);
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j)
        result[(static_cast<std::size_t>(row) * n + i) * n + j] =
            static_cast<float>(0.5 * (inverse(i, j) + inverse(j, i)));
  }
  return result;
}

void multiply(const SparseBlocks& a, const float* x, float* y, int batch_width) {
  pass({.then = Then::store, .a = a, .x = x, .y = y, .batch_width = batch_width});
}

void multiply_add(const SparseBlocks& a, const float* x, float* y, int batch_width) {
  pass({.then = Then::add, .a = a, .x = x, .y = y, .batch_width = batch_width});
}

void residual(const SparseBlocks& a, const float* b, const float* x, float* r, int batch_width) {
  pass({.then = Then::subtract_from, .a = a, .x = x, .y = r, .b = b, .batch_width = batch_width});
}

void smooth(const SparseBlocks& a, const std::vector<float>& inverse_diagonal, SmootherStep step, const float* b,
            const float* x, float* d, float* x_next, int batch_width) {
  pass({.then = Then::smooth,
        .a = a,
        .x = x,
        .y = x_next,
        .b = b,
        .d = d,
        .inverse_diagonal = inverse_diagonal.data(),
        .step = step,
        .batch_width = batch_width});
}

PALPATE_VECTOR_VERSIONS void smooth_zero(const SparseBlocks& a, const std::vector<float>& inverse_diagonal, float take,
                                         const float* b, float* d, float* x_next, int batch_width) {
  const int n = a.height;
  for (std::int32_t row = 0; row < a.rows; ++row) {
    const std::int64_t place = static_cast<std::int64_t>(row) * n * batch_width;
    const float* inverse = &inverse_diagonal[static_cast<std::size_t>(row) * n * n];
    for (int i = 0; i < n; ++i) {
      float* z = d + place + i * batch_width;
      std::fill_n(z, batch_width, 0.0f);
      for (int j = 0; j < n; ++j)
        for (int c = 0; c < batch_width; ++c) z[c] += take * inverse[i * n + j] * b[place + j * batch_width + c];
      std::copy_n(z, batch_width, x_next + place + i * batch_width);
    }
  }
}

}  // namespace palpate
