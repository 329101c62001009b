// The Cholesky factor of a small system whose rows come and go.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"

namespace palpate {

// A = U^T U, U upper triangular. Rows are numbered by position, 0 .. size() - 1; a new one is the last.
class UpdatedCholesky {
 public:
  static constexpr int kBatch = 12;  // rows that are removed in one pass over the factor

  bool create(SceneMemory& memory, std::int32_t capacity);
  std::int32_t size() const { return size_; }
  void clear() { size_ = 0; }

  // Where the caller writes A for `append`: [q] is the entry of position `at` and new row q, at <= size() + q.
  double* coming(std::int32_t at) { return row(at) + size_; }

  // Adds `count` rows, size() + count <= capacity, whose entries stand in coming(0 .. size() + count - 1). A pivot below
  // `least` is raised to it and what that adds to the diagonal of row q is returned in raised[q], 0 where nothing was.
  // False when a number is not finite: nothing was added. The factor is the same to the bit whether rows are added one by
  // one or together. Cost: the multiply-adds of the rows alone, count size()^2 / 2 + count^2 size() / 2 + count^3 / 6.
  bool append(std::int32_t count, double least, double* raised);

  // Removes the rows at the given positions, ascending; the positions of later rows become smaller.
  // Cost: up to 2 size()^2 multiply-adds per row that leaves, less the nearer it is to the end; twelve share a pass.
  // Source: a row that leaves is added to those below it by Householder reflections (Golub and Van Loan, 6.5).
  void remove(int count, const std::int32_t* positions);

  // x = A^-1 x. Cost: size()^2 multiply-adds.
  void solve(double* x) const;

 private:
  double* row(std::int32_t i) const { return factor_ + static_cast<std::size_t>(i) * stride_; }
  bool factor_corner(std::int32_t first, std::int32_t rows, double least, double* raised);
  void remove_batch(int count, const std::int32_t* positions);

  double* factor_ = nullptr;   // [capacity][stride]; row i is used from column i on
  double* leaving_ = nullptr;  // [kBatch][stride]
  std::size_t stride_ = 0;
  std::int32_t capacity_ = 0, size_ = 0;
};

}  // namespace palpate
