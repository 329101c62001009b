// The matrix of a system of rows, which come and go.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/dense/dense_rows.h"

namespace palpate {

constexpr int kMostRowsOfAContact = 9;  // a triangle's

struct RowMatrix {
  double* numbers = nullptr;  // [capacity][stride] m/N, symmetric
  double* scale = nullptr;    // [capacity] 1 / sqrt of the diagonal; 0: the row is not in use
  std::size_t stride = 0;     // numbers per row
  std::int32_t capacity = 0;
  std::int32_t rows_end = 0;  // all rows in use are below this number

  bool create(SceneMemory& memory, std::int32_t rows) {
    capacity = rows, stride = odd_lines(static_cast<std::size_t>(rows));
    numbers = memory.array<double>(static_cast<std::size_t>(rows) * stride);
    scale = memory.array<double>(static_cast<std::size_t>(rows));
    return !memory.failed();
  }
  double* row(std::int32_t i) const { return numbers + static_cast<std::size_t>(i) * stride; }
  double& entry(std::int32_t i, std::int32_t j) const { return row(i)[j]; }
};

}  // namespace palpate
