// The two inner loops of a cut organ's compliance, over rows of doubles. Same bits with any instructions.
#pragma once

#include <cstddef>
#include <cstdint>

namespace palpate {

inline constexpr std::int32_t kRowStep = 8;  // rows have a multiple of it of numbers
constexpr std::int32_t padded_row(std::int32_t count) {
  return (count + kRowStep - 1) / kRowStep * kRowStep;
}

// out[r][c] = row r of `left` . row c of `right`, over `count` numbers, a multiple of kRowStep. The rows of each are `stride` numbers apart,
// those of out `out_stride`.
void row_products(const double* left, std::int32_t rows, const double* right, std::int32_t columns, std::size_t stride,
                  std::int32_t count, double* out, std::size_t out_stride);

// Row r of `to` += sum over s of coefficient[r][s] source[s], over `count` numbers, a multiple of kRowStep; coefficients of a row are one
// after the other. to: `stride` numbers from one row to the next.
void add_row_sums(double* to, std::int32_t rows, std::size_t stride, std::int32_t count, const double* const* source,
                  std::int32_t sources, const double* coefficient);

}  // namespace palpate
