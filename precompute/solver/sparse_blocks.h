// Sparse matrices in f32 whose entries are small dense blocks, and their products with a batch of columns. The levels of the
// multigrid (batch_multigrid) consist of such matrices.
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

// The inverse of each diagonal block of a square matrix, one block for each row: [rows][height][height]. A block may be
// singular, if no fine dof contributes to one of its dofs; its result is then diagonal, with the inverse of each positive
// diagonal entry and 1 for the others.
std::vector<float> inverse_diagonal_blocks(const SparseBlocks& matrix);

// x, y, b, r and d are batches of columns: [dofs][batch_width], the numbers of one dof side by side, one for each column.
// batch_width is a multiple of 8. The arrays must not overlap.
void multiply(const SparseBlocks& a, const float* x, float* y, int batch_width);                  // y = A x
void multiply_add(const SparseBlocks& a, const float* x, float* y, int batch_width);              // y += A x
void residual(const SparseBlocks& a, const float* b, const float* x, float* r, int batch_width);  // r = b - A x

// One step of a polynomial smoother, in one pass over A: d = keep d + take D^-1 (b - A x), then x_next = x + d. Where keep is
// 0, d is not read. D^-1 comes from inverse_diagonal_blocks().
struct SmootherStep {
  float keep, take;
};
void smooth(const SparseBlocks& a, const std::vector<float>& inverse_diagonal, SmootherStep step, const float* b,
            const float* x, float* d, float* x_next, int batch_width);

// The first step, from x = 0, which needs no product with A: d = x_next = take D^-1 b.
void smooth_zero(const SparseBlocks& a, const std::vector<float>& inverse_diagonal, float take, const float* b,
                 float* d, float* x_next, int batch_width);

}  // namespace palpate
