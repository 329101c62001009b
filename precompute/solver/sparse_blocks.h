// Sparse matrices of small dense blocks in f32, times many columns at once: what a multigrid level is made of.
#pragma once

#include <cstdint>
#include <vector>

namespace palpate {

// Blocks of height x width numbers, (3 or 6) x (3 or 6) or 1 x 1; block columns ascending in each block row.
struct SparseBlocks {
  int height = 1, width = 1;
  std::int32_t rows = 0, columns = 0;  // in blocks
  std::vector<std::int64_t> first;     // [rows + 1] into column
  std::vector<std::int32_t> column;
  std::vector<float> value;  // [blocks][height][width]

  std::int64_t bytes() const;
};

SparseBlocks transposed(const SparseBlocks& matrix);

// The inverse of each diagonal block of a square matrix, as one block per row: [rows][height][height]. A block that has
// no inverse (a dof that no fine dof feeds) gets the inverse of its positive diagonal entries, and 1 for the others.
std::vector<float> inverse_diagonal_blocks(const SparseBlocks& matrix);

// Columns: [dofs][lanes], the columns of one dof side by side; lanes a multiple of 8. Arrays must not overlap.
void multiply(const SparseBlocks& a, const float* x, float* y, int lanes);                  // y = A x
void multiply_add(const SparseBlocks& a, const float* x, float* y, int lanes);              // y += A x
void residual(const SparseBlocks& a, const float* b, const float* x, float* r, int lanes);  // r = b - A x

// One step of a polynomial smoother, in one pass over A: d = keep d + take D^-1 (b - A x), x_next = x + d. keep 0: d is
// not read. D^-1: inverse_diagonal_blocks.
struct SmootherStep {
  float keep, take;
};
void smooth(const SparseBlocks& a, const std::vector<float>& inverse_diagonal, SmootherStep step, const float* b,
            const float* x, float* d, float* x_next, int lanes);

// The same for x = 0, without A: d = x_next = take D^-1 b.
void smooth_zero(const SparseBlocks& a, const std::vector<float>& inverse_diagonal, float take, const float* b,
                 float* d, float* x_next, int lanes);

}  // namespace palpate
