// The Cholesky factor of a small symmetric positive definite system whose rows are added and removed.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"

namespace palpate {

// A = U^T U with U upper triangular. A row is named by its position, 0 .. size() - 1; a new row is the last one.
class UpdatedCholesky {
 public:
  static constexpr int kBatch = 12;  // rows that one pass over the factor removes

  bool create(SceneMemory& memory, std::int32_t capacity);
  std::int32_t size() const { return size_; }
  void clear() { size_ = 0; }

  // Where the caller writes A before `append`: coming(at)[q] is the entry of position `at` and new row q, at <= size() + q.
  double* coming(std::int32_t at) { return row(at) + size_; }

  // Adds `count` rows whose entries the caller has written to coming(0 .. size() + count - 1); size() + count <= capacity. A
  // pivot below `least` is raised to it, and raised[q] is what that adds to the diagonal of row q (0 where nothing was raised).
  // False, with nothing added, where a number is not finite. The factor has the same bits whether rows are added one by one or
  // together. Cost: count size()^2 / 2 + count^2 size() / 2 + count^3 / 6 multiply-adds.
  bool append(std::int32_t count, double least, double* raised);

  // Removes the rows at the given positions, which ascend; later rows move up. Each removed row is added to the rows below it by
  // Householder reflections. Cost: up to 2 size()^2 multiply-adds per row, less the nearer the row is to the end; kBatch rows
  // share a pass. Source: Golub and Van Loan, Matrix Computations, section 6.5.
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
