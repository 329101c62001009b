// A sparse Cholesky factor of the stiffness at rest: made in double precision, kept and applied in single precision.
//
// Columns with nearly the same pattern form a supernode: one dense panel, so that each of the two triangular solves reads the factor
// once, in order, without indices. Making it has a symbolic part, the patterns, and a numeric one, which other matrices of the same pattern
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

  // From so many numbers on the factor has a rough copy too: smaller ones stay in a core's caches, where they are read as fast.
  static constexpr std::int64_t kFewestForRough = 5'000'000;

  // matrix: postordered. Memory in the end: 4 bytes a number, 6 with a rough copy; while it is made 8 more.
  Outcome create(SceneMemory& memory, const BlockRows& matrix, std::int64_t fewest_for_rough = kFewestForRough);

  // x: [rows][3] the right-hand side, then K^-1 of it. Cost: reads the factor twice. Not for two threads at once.
  void solve(float* x) const { solve(&x, 1); }
  // The same for `count` right-hand sides, whose bits do not depend on one another. Cost: reads the factor from memory twice in all.
  void solve(float* const* x, int count) const;

  // Where there is a rough copy, the same of one right-hand side with the factor's numbers rounded to 16 bits, by 1.5e-5 of the largest one
  // in their column: about K^-1, symmetric and positive definite as K^-1 is, for half of the memory's traffic. Serves as a metric. Else
  // solve(x).
  void solve_roughly(float* x) const;

  std::int64_t numbers() const { return numbers_; }
  bool has_rough_copy() const { return rough_tiles_ != nullptr; }

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
    std::int64_t tiles;  // its first number in tiles_
  };
  bool find_supernodes(SceneMemory& memory, SceneMemory& scratch, const BlockRows& matrix);
  bool create_tiles(SceneMemory& memory);
  void round_tiles(const Supernode& node);
  float* rough_scale(const Supernode& node, bool below) const {
    return rough_scale_ + 3 * (static_cast<std::int64_t>(below ? rows_ : 0) + node.first);
  }
  template <class Visit>
  void for_each_tile(const Supernode& node, Visit visit) const;
  Outcome factorise(SceneMemory& scratch, const BlockRows& matrix);
  double* begin_supernode(Work& work, std::int32_t s) const;
  bool end_supernode(Work& work, std::int32_t s) const;
  template <class Stored>
  friend struct SolveWith;

  std::int32_t rows_ = 0, count_ = 0;
  std::int64_t numbers_ = 0, panel_numbers_ = 0, operations_ = 0, fewest_for_rough_ = kFewestForRough;
  Supernode* supernodes_ = nullptr;
  std::int32_t* row_lists_ = nullptr;
  // Tiles of sixteen rows of three columns, in the order in which a solve reads them: for each supernode the lower triangle of the inverse
  // of its diagonal block, then the rows below it.
  float* tiles_ = nullptr;               // [numbers_]
  std::int32_t* rough_tiles_ = nullptr;  // [numbers_ / 2] the same in pairs of 16 bits; nullptr: none
  float* rough_scale_ = nullptr;         // [2][rows_][3] what multiplies these: in the triangles; below them
  float* gathered_ = nullptr;
};

}  // namespace palpate
