// A sparse Cholesky factor of the stiffness at rest: made in double precision, kept and applied in single precision.
//
// Columns with nearly the same pattern form a supernode: one dense panel, so that the two triangular solves read the factor once,
// in order, without indices. Making it has a symbolic part, the patterns, and a numeric one, which other matrices of the same pattern
// repeat, supernode by supernode.
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

  // What a numeric factorisation works with: 8 bytes a number of the factor.
  class Work {
   public:
    bool create(SceneMemory& memory, const BlockFactor& factor);
    std::int64_t operations() const { return done; }  // so far; in all as many as BlockFactor::operations()

   private:
    friend class BlockFactor;
    void wait(const BlockFactor& factor, std::int32_t s);
    double *panels = nullptr, *update = nullptr, *turned = nullptr;
    std::int32_t* position = nullptr;                // [rows] of a row in the panel
    std::int32_t* waiting = nullptr;                 // [supernodes] 1 + first supernode that updates this one
    std::int32_t *next = nullptr, *begin = nullptr;  // [supernodes] begin: its first row that waits
    std::int32_t* supernode_of = nullptr;            // [rows]
    std::int64_t done = 0;
    bool used = false, clears = false;  // memory is clear at first
  };
  // A second factor of the pattern of `other`, whose patterns it borrows. Its numbers come from factorise_supernode() and
  // take_panels(). Not for two threads at once, `other` included.
  bool create_like(SceneMemory& memory, const BlockFactor& other);
  std::int32_t supernodes() const { return count_; }
  std::int64_t operations() const { return operations_; }
  // The supernodes 0 .. supernodes() - 1 one after the other. matrix.add_column(column, add) calls add(row, r, c, value) for the parts of
  // the column's blocks from the diagonal on down (tangent.h). False where a pivot is not positive.
  template <class Matrix>
  bool factorise_supernode(Work& work, std::int32_t s, const Matrix& matrix) const {
    const Supernode& node = supernodes_[s];
    double* const panel = begin_supernode(work, s);
    for (std::int32_t j = 0; j < node.columns; ++j)
      matrix.add_column(node.first + j, [&](std::int32_t row, int r, int c, double value) {
        panel[static_cast<std::int64_t>(3 * j + c) * node.stride + work.position[row] + r] += value;
      });
    return end_supernode(work, s);
  }
  // After the last supernode: the factor is that of the new matrix. Cost: a pass over the numbers.
  void take_panels(const Work& work);

 private:
  struct Supernode {
    std::int32_t first, columns;  // block columns first .. first + columns - 1
    std::int32_t rows;            // block rows below them
    std::int32_t stride;          // numbers from one column of the panel to the next
    std::int64_t panel, row_list;
  };
  bool find_supernodes(SceneMemory& memory, SceneMemory& scratch, const BlockRows& matrix);
  Outcome factorise(SceneMemory& scratch, const BlockRows& matrix);
  double* begin_supernode(Work& work, std::int32_t s) const;
  bool end_supernode(Work& work, std::int32_t s) const;
  friend struct SolveWith;

  std::int32_t rows_ = 0, count_ = 0;
  std::int64_t numbers_ = 0, operations_ = 0;
  Supernode* supernodes_ = nullptr;
  std::int32_t* row_lists_ = nullptr;
  float* panels_ = nullptr;  // columns one after the other: the inverse of the diagonal's triangle, then the rows below
  float* gathered_ = nullptr;
};

}  // namespace palpate
