#include "precompute/solver/sparse_blocks.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cstddef>

#include "precompute/solver/wide.h"

namespace palpate {
namespace {

// What becomes of a block row's product, sum: [height][lanes in hand]. row: block row; lane: the first lane in hand. A branch a
// row costs nothing measurable; four copies of every kernel took three times as long to compile.
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
  int lanes = 0;
};

// The sums of one block row stay in registers: kHeight x kLanes numbers.
template <int kHeight, int kWidth, int kLanes>
PALPATE_INLINE void one_row(const Pass& p, std::int32_t row, int lane) {
  float sum[kHeight][kLanes] = {};
  for (auto at = p.a.first[row]; at < p.a.first[row + 1]; ++at) {
    const float* x = p.x + static_cast<std::int64_t>(p.a.column[at]) * kWidth * p.lanes + lane;
    const float* value = &p.a.value[at * (kHeight * kWidth)];
#pragma GCC unroll 6
    for (int j = 0; j < kWidth; ++j)
#pragma GCC unroll 6
      for (int i = 0; i < kHeight; ++i)
        for (int c = 0; c < kLanes; ++c) sum[i][c] += value[i * kWidth + j] * x[j * p.lanes + c];
  }
  const std::int64_t place = static_cast<std::int64_t>(row) * kHeight * p.lanes + lane;
  float* y = p.y + place;
  if (p.then == Then::store) {
    for (int i = 0; i < kHeight; ++i)
      for (int c = 0; c < kLanes; ++c) y[i * p.lanes + c] = sum[i][c];
    return;
  }
  if (p.then == Then::add) {
    for (int i = 0; i < kHeight; ++i)
      for (int c = 0; c < kLanes; ++c) y[i * p.lanes + c] += sum[i][c];
    return;
  }
  const float* b = p.b + place;
  for (int i = 0; i < kHeight; ++i)
    for (int c = 0; c < kLanes; ++c) sum[i][c] = b[i * p.lanes + c] - sum[i][c];
  if (p.then == Then::subtract_from) {
    for (int i = 0; i < kHeight; ++i)
      for (int c = 0; c < kLanes; ++c) y[i * p.lanes + c] = sum[i][c];
    return;
  }
  if constexpr (kHeight == kWidth) {
    const float* inverse = p.inverse_diagonal + static_cast<std::int64_t>(row) * kHeight * kHeight;
    const float* x = p.x + place;
    float* d = p.d + place;
    for (int i = 0; i < kHeight; ++i) {
      float z[kLanes] = {};
      for (int j = 0; j < kHeight; ++j)
        for (int c = 0; c < kLanes; ++c) z[c] += inverse[i * kHeight + j] * sum[j][c];
      if (p.step.keep != 0)
        for (int c = 0; c < kLanes; ++c) z[c] = p.step.keep * d[i * p.lanes + c] + p.step.take * z[c];
      else
        for (int c = 0; c < kLanes; ++c) z[c] *= p.step.take;
      for (int c = 0; c < kLanes; ++c) d[i * p.lanes + c] = z[c];
      for (int c = 0; c < kLanes; ++c) y[i * p.lanes + c] = x[i * p.lanes + c] + z[c];
    }
  }
}

template <int kHeight, int kWidth>
PALPATE_WIDE void all_rows(const Pass& p) {
  for (std::int32_t row = 0; row < p.a.rows; ++row) {
    int lane = 0;
    for (; lane + 32 <= p.lanes; lane += 32) one_row<kHeight, kWidth, 32>(p, row, lane);
    for (; lane + 16 <= p.lanes; lane += 16) one_row<kHeight, kWidth, 16>(p, row, lane);
    for (; lane < p.lanes; lane += 8) one_row<kHeight, kWidth, 8>(p, row, lane);
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
    // An f32 matrix knows its eigenvalues to 1e-7 of the largest.
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

void multiply(const SparseBlocks& a, const float* x, float* y, int lanes) {
  pass({.then = Then::store, .a = a, .x = x, .y = y, .lanes = lanes});
}

void multiply_add(const SparseBlocks& a, const float* x, float* y, int lanes) {
  pass({.then = Then::add, .a = a, .x = x, .y = y, .lanes = lanes});
}

void residual(const SparseBlocks& a, const float* b, const float* x, float* r, int lanes) {
  pass({.then = Then::subtract_from, .a = a, .x = x, .y = r, .b = b, .lanes = lanes});
}

void smooth(const SparseBlocks& a, const std::vector<float>& inverse_diagonal, SmootherStep step, const float* b,
            const float* x, float* d, float* x_next, int lanes) {
  pass({.then = Then::smooth,
        .a = a,
        .x = x,
        .y = x_next,
        .b = b,
        .d = d,
        .inverse_diagonal = inverse_diagonal.data(),
        .step = step,
        .lanes = lanes});
}

PALPATE_WIDE void smooth_zero(const SparseBlocks& a, const std::vector<float>& inverse_diagonal, float take,
                              const float* b, float* d, float* x_next, int lanes) {
  const int n = a.height;
  for (std::int32_t row = 0; row < a.rows; ++row) {
    const std::int64_t place = static_cast<std::int64_t>(row) * n * lanes;
    const float* inverse = &inverse_diagonal[static_cast<std::size_t>(row) * n * n];
    for (int i = 0; i < n; ++i) {
      float* z = d + place + i * lanes;
      std::fill_n(z, lanes, 0.0f);
      for (int j = 0; j < n; ++j)
        for (int c = 0; c < lanes; ++c) z[c] += take * inverse[i * n + j] * b[place + j * lanes + c];
      std::copy_n(z, lanes, x_next + place + i * lanes);
    }
  }
}

}  // namespace palpate
