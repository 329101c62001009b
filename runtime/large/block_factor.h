// A sparse Cholesky factor of the stiffness at rest: made in double precision, kept and applied in single precision.
//
// Columns with nearly the same pattern form a supernode: one dense panel, so that the two triangular solves read the factor once,
// in order, without indices.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/large/block_rows.h"

namespace palpate {

// Reorders an elimination so that each subtree of its elimination tree stands together, which fills in nothing more.
// matrix: in the order to improve. [rows] new_place[old place]. False where memory ends.
bool postorder(SceneMemory& memory, const BlockRows& matrix, std::int32_t* new_place);

class BlockFactor {
 public:
  enum class Outcome { made, no_memory, not_definite };

  // matrix: postordered. Memory in the end: 4 bytes a number; while it is made three times as much.
  Outcome create(SceneMemory& memory, const BlockRows& matrix);

  // x: [rows][3] the right-hand side, then K^-1 of it. Cost: reads the factor twice. Not for two threads at once.
  void solve(float* x) const { solve(&x, 1); }
  // The same for `count` right-hand sides, whose bits do not depend on one another. Cost: reads the factor from memory twice in all.
  void solve(float* const* x, int count) const;

  std::int64_t numbers() const { return numbers_; }

 private:
  struct Supernode {
    std::int32_t first, columns;  // block columns first .. first + columns - 1
    std::int32_t rows;            // block rows below them
    std::int32_t stride;          // numbers from one column of the panel to the next
    std::int64_t panel, row_list;
  };
  bool find_supernodes(SceneMemory& memory, SceneMemory& scratch, const BlockRows& matrix);
  Outcome factorise(SceneMemory& scratch, const BlockRows& matrix);
  friend struct SolveWith;

  std::int32_t rows_ = 0, count_ = 0;
  std::int64_t numbers_ = 0;
  Supernode* supernodes_ = nullptr;
  std::int32_t* row_lists_ = nullptr;
  float* panels_ = nullptr;  // columns one after the other: the inverse of the diagonal's triangle, then the rows below
  float* gathered_ = nullptr;
};

}  // namespace palpate
