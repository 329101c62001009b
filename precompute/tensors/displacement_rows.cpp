#include "precompute/tensors/displacement_rows.h"

#include <algorithm>
#include <cmath>

#include "precompute/solver/vector_registers.h"

namespace palpate {
namespace {

// T(3 i + j) = sum over k of C(3 i + k) F_i(k, j), where F_i is the stiffness of node i, is written as a sum over the
// distance k - j from -2 to 2, so that one instruction serves neighbouring columns: factor[distance + 2][column], zero
// where k is not 0, 1 or 2.
constexpr int kDistances = 5;

std::vector<double> factors_of(std::span<const std::array<double, 9>> stiffness, int width) {
  std::vector<double> factor(static_cast<std::size_t>(kDistances * width), 0.0);
  for (std::size_t i = 0; i < stiffness.size(); ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k)
        factor[static_cast<std::size_t>((k - j + 2) * width) + 3 * i + static_cast<std::size_t>(j)] =
            stiffness[i][static_cast<std::size_t>(3 * k + j)];
  return factor;
}

// One dof of one vertex, all columns. padded: memory of width + 4 numbers whose first and last two are zero.
PALPATE_VECTOR_VERSIONS void times_stiffness(const double* from, const double* factor, int width, double* padded,
                                             double* to) {
  std::copy_n(from, width, padded + 2);
  for (int c = 0; c < width; ++c) {
    double sum = 0;
    for (int d = 0; d < kDistances; ++d) sum += padded[c + d] * factor[d * width + c];
    to[c] = sum;
  }
}

template <class Value>
PALPATE_INLINE void cast_row(const double* from, int width, Value* to) {
  for (int c = 0; c < width; ++c) to[c] = static_cast<Value>(from[c]);
}

PALPATE_VECTOR_VERSIONS void add_loss(const double* row, int width, double* whole, double* lost) {
  for (int c = 0; c < width; ++c) {
    const double error = row[c] - static_cast<double>(static_cast<float>(row[c]));
    whole[c] += row[c] * row[c];
    lost[c] += error * error;
  }
}

}  // namespace

double CastLoss::worst() const {
  double worst = 0;
  for (std::size_t c = 0; c < whole.size(); ++c)
    if (whole[c] > 0) worst = std::max(worst, std::sqrt(lost[c] / whole[c]));
  return worst;
}

template <class Value>
void displacement_rows(const double* columns, int width, std::span<const std::int32_t> rows,
                       std::span<const std::array<double, 9>> stiffness, Value* out, CastLoss* loss) {
  constexpr std::size_t kTile = 16;  // vertices at a time: each row of out then gets three whole cache lines of floats
  const std::vector<double> factor = factors_of(stiffness, width);
  const std::size_t wide = static_cast<std::size_t>(width), run = 3 * rows.size(), filled = 3 * stiffness.size();
  std::vector<double> row(wide), padded(wide + 4, 0.0);
  std::vector<Value> tile(3 * kTile * wide);
  if (loss) loss->whole.resize(wide), loss->lost.resize(wide);
  for (std::size_t first = 0; first < rows.size(); first += kTile) {
    const std::size_t count = std::min(kTile, rows.size() - first);
    for (std::size_t n = 0; n < count; ++n)
      for (std::size_t d = 0; d < 3; ++d) {
        Value* to = &tile[(3 * n + d) * wide];
        if (rows[first + n] < 0) {
          std::fill_n(to, wide, Value{0});
          continue;
        }
        const double* from = columns + (3 * static_cast<std::size_t>(rows[first + n]) + d) * wide;
        times_stiffness(from, factor.data(), width, padded.data(), row.data());
        if (loss) add_loss(row.data(), width, loss->whole.data(), loss->lost.data());
        cast_row(row.data(), width, to);
      }
    for (std::size_t c = 0; c < filled; ++c)
      for (std::size_t i = 0; i < 3 * count; ++i) out[c * run + 3 * first + i] = tile[i * wide + c];
  }
}

template void displacement_rows(const double*, int, std::span<const std::int32_t>,
                                std::span<const std::array<double, 9>>, float*, CastLoss*);
template void displacement_rows(const double*, int, std::span<const std::int32_t>,
                                std::span<const std::array<double, 9>>, double*, CastLoss*);

}  // namespace palpate
