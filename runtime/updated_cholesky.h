// The Cholesky factor of a small system whose rows come and go.
#pragma once

#include <cstdint>

#include "runtime/scene_memory.h"

namespace palpate {

// A = U^T U, U upper triangular. Rows are numbered by position, 0 .. size() - 1; a new one is the last.
class UpdatedCholesky {
 public:
  static constexpr int kBatch = 12;  // rows that are added or removed in one pass over the factor

  bool create(SceneMemory& memory, std::int32_t capacity);
  std::int32_t size() const { return size_; }
  void clear() { size_ = 0; }

  // Adds `count` (1 .. kBatch) rows. entries[q]: A of new row q against positions 0 .. size() + q, its own diagonal last;
  // overwritten. A pivot below `least` is raised to it and what that adds to the diagonal of row q is returned in
  // raised[q], 0 where nothing was. False when a number is not finite: nothing was added.
  // Cost: count size()^2 / 2 multiply-adds.
  bool append(int count, double* const* entries, double least, double* raised);

  // Removes the rows at the given positions, ascending; the positions of later rows become smaller.
  // Cost: up to 2 size()^2 multiply-adds per row that leaves, less the nearer it is to the end; twelve share a pass.
  // Source: a row that leaves is added to those below it by Householder reflections (Golub and Van Loan, 6.5).
  void remove(int count, const std::int32_t* positions);

  // x = A^-1 x. Cost: size()^2 multiply-adds.
  void solve(double* x) const;

 private:
  double* row(std::int32_t i) const { return factor_ + static_cast<std::size_t>(i) * capacity_; }
  void remove_batch(int count, const std::int32_t* positions);

  double* factor_ = nullptr;   // [capacity][capacity]; row i is used from column i on
  double* leaving_ = nullptr;  // [kBatch][capacity]
  std::int32_t capacity_ = 0, size_ = 0;
};

}  // namespace palpate
