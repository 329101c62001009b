// The dense part of the factorisation (block_factor.h): products, Cholesky factor and inverse of panels in double precision.
//
// A panel is column-major, with `stride` numbers from one column to the next. Results are the same to the bit with any instructions
// (runtime/base/instructions.h): each number is a sum in a fixed order, whose products and sums are rounded one by one.
#pragma once

#include <cstddef>
#include <cstdint>

#include "runtime/base/instructions.h"

namespace palpate {

// Columns that are factored or inverted together: 48 of 600 rows in double precision fill half of a core's second cache.
constexpr std::int32_t kBlockColumns = 48;
// Numbers behind the end of a panel that a product may read.
constexpr std::int32_t kPanelMargin = 32;

// c -= a b^T. a: [k][m], b: [k][n], c: [n][m], columns first. Reads up to kPanelMargin numbers behind each column of a.
void subtract_product(Instructions instructions, std::int32_t m, std::int32_t n, std::int32_t k, const double* a,
                      std::int32_t a_stride, const double* b, std::int32_t b_stride, double* c, std::int32_t c_stride);
// c = -a b^T, the same bits as from c = 0.
void negative_product(Instructions instructions, std::int32_t m, std::int32_t n, std::int32_t k, const double* a,
                      std::int32_t a_stride, const double* b, std::int32_t b_stride, double* c, std::int32_t c_stride);

// The Cholesky factor of a panel whose upper part is square: `rows` rows, of which the first `columns` are the square's. Below the
// diagonal alone. False where a pivot is not positive.
bool factorise_panel(Instructions instructions, std::int32_t rows, std::int32_t columns, double* panel,
                     std::int32_t stride);

// Numbers of scratch that invert_triangle takes, kPanelMargin included.
constexpr std::size_t inverse_scratch(std::int32_t size) {
  return static_cast<std::size_t>(kBlockColumns) * (2 * static_cast<std::size_t>(size) + kBlockColumns) + kPanelMargin;
}
// Turns the lower triangle of the panel's first `size` rows and columns into its inverse, and clears what is above the diagonal.
void invert_triangle(Instructions instructions, std::int32_t size, double* panel, std::int32_t stride, double* scratch);

}  // namespace palpate
