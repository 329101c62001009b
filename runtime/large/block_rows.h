// The stiffness matrix at rest as sparse 3 x 3 blocks in the order of elimination.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/large/hyperelastic_body.h"

namespace palpate {

// Symmetric, both triangles. In each row the columns ascend.
struct BlockRows {
  std::int32_t rows = 0;
  std::int64_t* first = nullptr;  // [rows + 1] into column
  std::int32_t* column = nullptr;
  double* block = nullptr;  // [blocks][9] row-major, N/m

  std::int64_t index_of(std::int32_t row, std::int32_t at_column) const {
    std::int64_t low = first[row], high = first[row + 1];
    while (high - low > 1) {
      const std::int64_t middle = (low + high) / 2;
      (column[middle] <= at_column ? low : high) = middle;
    }
    return low;
  }
};

// The tangent of hyperelastic_body.h's energy at rest, which is K of docs/method.md, section 1. place: [node_count] row of each
// node; nodes with places from `rows` on are left out. Rows of single held dofs are zero but for the diagonal, which is the mean of
// K's. False where memory ends.
bool assemble_stiffness(SceneMemory& memory, const HyperelasticBody& body, const std::int32_t* place, std::int32_t rows,
                        BlockRows* stiffness);

// out: [3 rows] N, the first rows of the stiffness times a displacement by places, m.
void multiply(const BlockRows& stiffness, const double* moved, std::int32_t rows, float* out);

}  // namespace palpate
