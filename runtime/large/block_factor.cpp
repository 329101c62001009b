#include "runtime/large/block_factor.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "runtime/base/instructions.h"
#include "runtime/large/factor_panels.h"
#include "runtime/large/lanes.h"

namespace palpate {
namespace {

// The parent of each column: its first nonzero row below the diagonal in the factor; -1: none.
// Source: Liu 1990, The role of elimination trees in sparse factorization, SIAM J. Matrix Anal. Appl. 11(1).
void find_parents(const BlockRows& matrix, std::int32_t* ancestor, std::int32_t* parent) {
  for (std::int32_t row = 0; row < matrix.rows; ++row) {
    parent[row] = ancestor[row] = -1;
    for (std::int64_t at = matrix.first[row]; at < matrix.first[row + 1] && matrix.column[at] < row; ++at)
      for (std::int32_t k = matrix.column[at]; k != -1 && k < row;) {
        const std::int32_t next = ancestor[k];
        ancestor[k] = row;
        if (next == -1) parent[k] = row;
        k = next;
      }
  }
}

// Calls visit(row, column) for each block of the factor below the diagonal, rows ascending.
template <class Visit>
void for_each_block(const BlockRows& matrix, const std::int32_t* parent, std::int32_t* seen, Visit visit) {
  std::fill(seen, seen + matrix.rows, -1);
  for (std::int32_t row = 0; row < matrix.rows; ++row) {
    seen[row] = row;
    for (std::int64_t at = matrix.first[row]; at < matrix.first[row + 1] && matrix.column[at] < row; ++at)
      for (std::int32_t k = matrix.column[at]; seen[k] != row; k = parent[k]) {
        visit(row, k);
        seen[k] = row;
      }
  }
}

// The share of zeros that a supernode may store so that it becomes wider.
double allowed_zeros(std::int32_t columns) {
  return columns <= 4 ? 0.5 : columns <= 16 ? 0.2 : 0.05;
}

constexpr int kStep = kLanesOf<EightFloats>;

}  // namespace

bool postorder(SceneMemory& memory, const BlockRows& matrix, std::int32_t* new_place) {
  SceneMemory scratch = memory.of_same_host();
  const auto rows = static_cast<std::size_t>(matrix.rows);
  std::int32_t* const parent = scratch.array<std::int32_t>(rows);
  std::int32_t* const work = scratch.array<std::int32_t>(rows);
  std::int32_t* const child = scratch.array<std::int32_t>(rows + 1);
  std::int32_t* const sibling = scratch.array<std::int32_t>(rows);
  const bool made = !scratch.failed();
  if (made) {
    find_parents(matrix, work, parent);
    std::fill(child, child + rows + 1, -1);
    for (std::int32_t j = matrix.rows - 1; j >= 0; --j) {
      const std::int32_t p = parent[j] < 0 ? matrix.rows : parent[j];
      sibling[j] = child[p], child[p] = j;
    }
    // Depth first from the roots; work: the path.
    std::int32_t depth = 0, place = 0, next = child[matrix.rows];
    while (next != -1 || depth > 0) {
      if (next != -1) {
        work[depth++] = next, next = child[next];
      } else {
        const std::int32_t done = work[--depth];
        new_place[done] = place++, next = sibling[done];
      }
    }
  }
  scratch.release_all();
  return made;
}

bool BlockFactor::find_supernodes(SceneMemory& memory, SceneMemory& scratch, const BlockRows& matrix) {
  const auto rows = static_cast<std::size_t>(rows_);
  std::int32_t* const parent = scratch.array<std::int32_t>(rows);
  std::int32_t* const seen = scratch.array<std::int32_t>(rows);
  std::int32_t* const below = scratch.array<std::int32_t>(rows);  // rows of each column below the diagonal
  std::int32_t* const supernode_of = scratch.array<std::int32_t>(rows);
  supernodes_ = memory.array<Supernode>(rows);
  if (scratch.failed() || memory.failed()) return false;
  find_parents(matrix, seen, parent);
  for_each_block(matrix, parent, seen, [&](std::int32_t, std::int32_t column) { ++below[column]; });
  double zeros = 0;
  for (std::int32_t j = 0; j < rows_; ++j) {
    Supernode* const last = count_ > 0 ? supernodes_ + count_ - 1 : nullptr;
    const bool follows = last && parent[j - 1] == j;
    const double more = follows ? zeros + static_cast<double>(last->columns) * (below[j] + 1 - below[j - 1]) : 0;
    const double columns = follows ? last->columns + 1 : 1;
    if (follows && more <= allowed_zeros(last->columns + 1) * columns * (0.5 * columns + below[j])) {
      ++last->columns, zeros = more;
    } else {
      supernodes_[count_++] = {j, 1, 0, 0, 0, 0}, zeros = 0;
    }
    supernode_of[j] = count_ - 1;
  }
  std::int64_t listed = 0;
  std::int32_t longest = 0;
  for (std::int32_t s = 0; s < count_; ++s) {
    Supernode& node = supernodes_[s];
    node.rows = below[node.first + node.columns - 1];
    node.stride = (3 * (node.columns + node.rows) + kStep - 1) / kStep * kStep;
    node.panel = numbers_, numbers_ += 3 * static_cast<std::int64_t>(node.columns) * node.stride;
    node.row_list = listed, listed += node.rows;
    longest = std::max(longest, node.stride);
  }
  row_lists_ = memory.array<std::int32_t>(static_cast<std::size_t>(listed));
  panels_ = memory.array<float>(static_cast<std::size_t>(numbers_));
  gathered_ = memory.array<float>(2 * static_cast<std::size_t>(longest));
  std::int32_t* const filled = scratch.array<std::int32_t>(static_cast<std::size_t>(count_));
  if (scratch.failed() || memory.failed()) return false;
  for_each_block(matrix, parent, seen, [&](std::int32_t row, std::int32_t column) {
    const std::int32_t s = supernode_of[column];
    const Supernode& node = supernodes_[s];
    if (column == node.first + node.columns - 1) row_lists_[node.row_list + filled[s]++] = row;
  });
  return true;
}

bool BlockFactor::Work::create(SceneMemory& memory, const BlockFactor& factor) {
  std::int32_t longest = 0, widest = 1;
  for (std::int32_t s = 0; s < factor.count_; ++s) {
    longest = std::max(longest, factor.supernodes_[s].stride);
    widest = std::max(widest, 3 * factor.supernodes_[s].columns);
  }
  const auto rows = static_cast<std::size_t>(factor.rows_), count = static_cast<std::size_t>(factor.count_);
  panels = memory.array<double>(static_cast<std::size_t>(factor.numbers_) + kPanelMargin);
  update = memory.array<double>(static_cast<std::size_t>(longest) * static_cast<std::size_t>(std::max(widest, 3)));
  turned = memory.array<double>(inverse_scratch(widest));
  position = memory.array<std::int32_t>(rows), supernode_of = memory.array<std::int32_t>(rows);
  waiting = memory.array<std::int32_t>(count), next = memory.array<std::int32_t>(count);
  begin = memory.array<std::int32_t>(count);
  if (memory.failed()) return false;
  for (std::int32_t s = 0; s < factor.count_; ++s)
    for (std::int32_t j = 0; j < factor.supernodes_[s].columns; ++j) supernode_of[factor.supernodes_[s].first + j] = s;
  return true;
}

void BlockFactor::Work::wait(const BlockFactor& factor, std::int32_t s) {
  const Supernode& node = factor.supernodes_[s];
  if (begin[s] == node.rows) return;
  const std::int32_t target = supernode_of[factor.row_lists_[node.row_list + begin[s]]];
  next[s] = waiting[target], waiting[target] = s + 1;
}

double* BlockFactor::begin_supernode(Work& work, std::int32_t s) const {
  const Supernode& node = supernodes_[s];
  if (s == 0) {
    std::fill(work.waiting, work.waiting + count_, 0);
    std::fill(work.begin, work.begin + count_, 0);
    work.done = 0;
    work.clears = work.used, work.used = true;
  }
  double* const panel = work.panels + node.panel;
  if (work.clears) std::fill(panel, panel + 3 * static_cast<std::int64_t>(node.columns) * node.stride, 0.0);
  for (std::int32_t j = 0; j < node.columns; ++j) work.position[node.first + j] = 3 * j;
  for (std::int32_t i = 0; i < node.rows; ++i) work.position[row_lists_[node.row_list + i]] = 3 * (node.columns + i);
  return panel;
}

// What the supernodes before it subtract; then its part of the factor, and the inverse of the triangle.
bool BlockFactor::end_supernode(Work& work, std::int32_t s) const {
  const Instructions instructions = best_instructions();
  const Supernode& node = supernodes_[s];
  double* const panel = work.panels + node.panel;
  for (std::int32_t d = work.waiting[s]; d != 0;) {
    const std::int32_t from = d - 1;
    d = work.next[from];
    const Supernode& other = supernodes_[from];
    const std::int32_t* const list = row_lists_ + other.row_list;
    const std::int32_t p = work.begin[from];
    std::int32_t q = p;
    while (q < other.rows && list[q] < node.first + node.columns) ++q;
    const std::int32_t m = 3 * (other.rows - p), n = 3 * (q - p);
    const double* const a = work.panels + other.panel + 3 * (other.columns + p);
    negative_product(instructions, m, n, 3 * other.columns, a, other.stride, a, other.stride, work.update, m);
    for (std::int32_t c = 0; c < n; ++c) {
      double* const column = panel + static_cast<std::int64_t>(work.position[list[p + c / 3]] + c % 3) * node.stride;
      for (std::int32_t i = c / 3; i < other.rows - p; ++i)
        for (int r = 0; r < 3; ++r)
          column[work.position[list[p + i]] + r] += work.update[static_cast<std::int64_t>(c) * m + 3 * i + r];
    }
    work.begin[from] = q;
    work.wait(*this, from);
    work.done += static_cast<std::int64_t>(m) * n * (other.columns + 8);
  }
  const std::int32_t rows = 3 * (node.columns + node.rows), columns = 3 * node.columns;
  if (!factorise_panel(instructions, rows, columns, panel, node.stride)) return false;
  work.wait(*this, s);
  // Later supernodes read the rows below the triangle alone.
  invert_triangle(instructions, columns, panel, node.stride, work.turned);
  work.done += static_cast<std::int64_t>(rows) * columns * (columns / 3 + 8);
  return true;
}

void BlockFactor::take_panels(const Work& work) {
  for (std::int32_t s = 0; s < count_; ++s) {
    const Supernode& node = supernodes_[s];
    for (std::int32_t c = 0; c < 3 * node.columns; ++c)
      for (std::int32_t i = c; i < 3 * (node.columns + node.rows); ++i) {
        const std::int64_t at = node.panel + static_cast<std::int64_t>(c) * node.stride + i;
        panels_[at] = static_cast<float>(work.panels[at]);
      }
  }
}

BlockFactor::Outcome BlockFactor::factorise(SceneMemory& scratch, const BlockRows& matrix) {
  Work work;
  if (!work.create(scratch, *this)) return Outcome::no_memory;
  for (std::int32_t s = 0; s < count_; ++s) {
    const Supernode& node = supernodes_[s];
    double* const panel = begin_supernode(work, s);
    for (std::int32_t j = 0; j < node.columns; ++j) {
      const std::int32_t row = node.first + j;  // K is symmetric: its row is its column
      for (std::int64_t at = matrix.first[row]; at < matrix.first[row + 1]; ++at) {
        if (matrix.column[at] < row) continue;
        const std::int32_t i0 = work.position[matrix.column[at]];
        for (int c = 0; c < 3; ++c)
          for (int r = 0; r < 3; ++r)
            panel[static_cast<std::int64_t>(3 * j + c) * node.stride + i0 + r] = matrix.block[9 * at + 3 * c + r];
      }
    }
    if (!end_supernode(work, s)) return Outcome::not_definite;
  }
  operations_ = work.done;
  take_panels(work);
  return Outcome::made;
}

BlockFactor::Outcome BlockFactor::create(SceneMemory& memory, const BlockRows& matrix) {
  rows_ = matrix.rows;
  SceneMemory scratch = memory.of_same_host();
  Outcome outcome = Outcome::no_memory;
  if (find_supernodes(memory, scratch, matrix)) outcome = factorise(scratch, matrix);
  scratch.release_all();
  return outcome;
}

bool BlockFactor::create_like(SceneMemory& memory, const BlockFactor& other) {
  *this = other;
  panels_ = memory.array<float>(static_cast<std::size_t>(numbers_));
  return panels_ != nullptr;
}

// The inner loops, once for each instruction set.
struct SolveWith {
  // out[i] += sum over the columns c of column[c][i] x[c], rows begin .. end - 1. columns: a multiple of 3.
  static PALPATE_INLINE void add_columns(const float* panel, std::int32_t end, std::int32_t stride, std::int32_t begin,
                                         std::int32_t columns, const float* x, float* out) {
    for (std::int32_t c = 0; c < columns; c += 3) {
      const float* const a0 = panel + static_cast<std::int64_t>(c) * stride;
      const float *const a1 = a0 + stride, *const a2 = a1 + stride;
      const float x0 = x[c], x1 = x[c + 1], x2 = x[c + 2];
      for (std::int32_t i = begin; i < end; ++i) out[i] += a0[i] * x0 + (a1[i] * x1 + a2[i] * x2);
    }
  }
  // out[c] = sum over rows 0 .. end - 1 of column[c][i] x[i]. end: a multiple of kStep.
  static PALPATE_INLINE void dot_columns(const float* panel, std::int32_t end, std::int32_t stride,
                                         std::int32_t columns, const float* x, float* out) {
    for (std::int32_t c = 0; c < columns; c += 3) {
      const float* const a0 = panel + static_cast<std::int64_t>(c) * stride;
      EightFloats sum[3] = {};
      for (std::int32_t i = 0; i < end; i += kStep) {
        EightFloats v, a;
        std::memcpy(&v, x + i, sizeof v);
        for (int d = 0; d < 3; ++d) {
          std::memcpy(&a, a0 + static_cast<std::int64_t>(d) * stride + i, sizeof a);
          sum[d] = sum[d] + a * v;
        }
      }
      for (int d = 0; d < 3; ++d) {
        float part[kStep];
        std::memcpy(part, &sum[d], sizeof part);
        for (int k = 1; k < kStep; ++k) part[0] += part[k];
        out[c + d] = part[0];
      }
    }
  }

  // x <- L^-1 x on the rows of a supernode, and what it takes out of the rows below. scratch: [2][longest]
  static PALPATE_INLINE void forward(const BlockFactor& factor, const BlockFactor::Supernode& node,
                                     std::int32_t longest, float* x) {
    float *const below = factor.gathered_, *const own = below + longest;
    const float* const panel = factor.panels_ + node.panel;
    const std::int32_t size = 3 * node.columns;
    float* const at = x + 3 * static_cast<std::int64_t>(node.first);
    // The rows of the inverse end at `size`; the rest of that pass is overwritten.
    std::fill(own, own + node.stride, 0.0f);
    add_columns(panel, (size + kStep - 1) / kStep * kStep, node.stride, 0, size, at, own);
    std::copy(own, own + size, at);
    if (node.rows == 0) return;
    std::fill(below, below + node.stride, 0.0f);
    add_columns(panel, node.stride, node.stride, size / kStep * kStep, size, at, below);
    const std::int32_t* const list = factor.row_lists_ + node.row_list;
    for (std::int32_t i = 0; i < node.rows; ++i)
      for (int r = 0; r < 3; ++r) x[3 * static_cast<std::int64_t>(list[i]) + r] -= below[size + 3 * i + r];
  }

  // x <- L^-T x on the rows of a supernode, from the rows below it.
  static PALPATE_INLINE void backward(const BlockFactor& factor, const BlockFactor::Supernode& node,
                                      std::int32_t longest, float* x) {
    float *const below = factor.gathered_, *const own = below + longest;
    const float* const panel = factor.panels_ + node.panel;
    const std::int32_t size = 3 * node.columns;
    float* const at = x + 3 * static_cast<std::int64_t>(node.first);
    const std::int32_t* const list = factor.row_lists_ + node.row_list;
    std::fill(below, below + node.stride, 0.0f);
    std::fill(own, own + node.stride, 0.0f);
    for (std::int32_t i = 0; i < node.rows; ++i)
      for (int r = 0; r < 3; ++r) below[size + 3 * i + r] = x[3 * static_cast<std::int64_t>(list[i]) + r];
    if (node.rows > 0) {
      dot_columns(panel, node.stride, node.stride, size, below, own);
      for (std::int32_t c = 0; c < size; ++c) at[c] -= own[c];
    }
    std::fill(below, below + (size + kStep - 1) / kStep * kStep, 0.0f);
    std::copy(at, at + size, below);
    dot_columns(panel, (size + kStep - 1) / kStep * kStep, node.stride, size, below, at);
  }

  // A supernode is read from memory once for all right-hand sides.
  static PALPATE_INLINE void solve(const BlockFactor& factor, float* const* x, int count) {
    std::int32_t longest = 0;
    for (std::int32_t s = 0; s < factor.count_; ++s) longest = std::max(longest, factor.supernodes_[s].stride);
    for (std::int32_t s = 0; s < factor.count_; ++s)
      for (int k = 0; k < count; ++k) forward(factor, factor.supernodes_[s], longest, x[k]);
    for (std::int32_t s = factor.count_ - 1; s >= 0; --s)
      for (int k = 0; k < count; ++k) backward(factor, factor.supernodes_[s], longest, x[k]);
  }
};

namespace {

void solve_plainly(const BlockFactor& factor, float* const* x, int count) {
  SolveWith::solve(factor, x, count);
}
#ifdef PALPATE_DISPATCHES
__attribute__((target(PALPATE_AVX2))) void solve_with_avx2(const BlockFactor& factor, float* const* x, int count) {
  SolveWith::solve(factor, x, count);
}
#endif

}  // namespace

void BlockFactor::solve(float* const* x, int count) const {
#ifdef PALPATE_DISPATCHES
  if (best_instructions() != Instructions::baseline) return solve_with_avx2(*this, x, count);
#endif
  solve_plainly(*this, x, count);
}

}  // namespace palpate
