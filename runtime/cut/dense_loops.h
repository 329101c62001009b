// The inner loops of a cut organ's compliance, over rows of doubles. Same bits with any instructions.
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

// Patterns of forces at slots, as cut_basis.h has them: pattern i has the forces first[i] .. first[i + 1] - 1.
struct PatternForces {
  const std::int32_t *first, *slot;
  const double* force;  // [3] of each
};
// out[i][lane] = sum of pattern i's forces . field[3 slot ..][lane], for kRowStep fields side by side.
void weigh_fields(const PatternForces& patterns, std::int32_t count, const double* field, double* out);

}  // namespace palpate
