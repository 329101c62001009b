#include "runtime/large/block_factor.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <type_traits>

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

// Rows of a vector and of a tile.
constexpr int kStep = kLanesOf<EightFloats>, kTileRows = 2 * kStep;

// The first row of the tile that holds a row.
constexpr std::int32_t tile_of(std::int32_t row) {
  return row / kTileRows * kTileRows;
}

// What a column of a tile is stored as: kTileRows floats, or kStep words with row i in the lower half and row i + kStep in the upper one, as
// integers of 16 bits that a scale for each column and part of the supernode multiplies.
constexpr float kLargest = 32767;
#if defined(__GNUC__)
typedef std::int32_t EightWords __attribute__((vector_size(32)));
#else
using EightWords = std::int32_t;
#endif
struct TileColumn {
  EightFloats upper, lower;  // the rows 0 .. kStep - 1, and the others
};
PALPATE_INLINE EightFloats eight_of(const float* x) {
  EightFloats all;
  std::memcpy(&all, x, sizeof all);
  return all;
}
PALPATE_INLINE TileColumn column_of(const float* tile, int column) {
  return {eight_of(tile + column * kTileRows), eight_of(tile + column * kTileRows + kStep)};
}
PALPATE_INLINE EightFloats floats_of(EightWords words) {
#if defined(__GNUC__)
  return __builtin_convertvector(words, EightFloats);
#else
  return static_cast<float>(words);
#endif
}
PALPATE_INLINE TileColumn column_of(const std::int32_t* tile, int column) {
  EightWords words;
  std::memcpy(&words, tile + column * kStep, sizeof words);
  return {floats_of(words << 16 >> 16), floats_of(words >> 16)};
}

std::int32_t word_of(float lower, float upper) {
  const auto rounded = [](float x) { return static_cast<std::int32_t>(std::lround(x)) & 0xffff; };
  return static_cast<std::int32_t>(static_cast<std::int32_t>(rounded(lower)) | static_cast<std::int32_t>(rounded(upper))
                                                                                   << 16);
}

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

// Calls visit(column, row, end): the tile's first column and row, and where the rows end that it holds of the block. A tile with rows of
// the triangle and rows below it is in both parts.
template <class Visit>
void BlockFactor::for_each_tile(const Supernode& node, Visit visit) const {
  const std::int32_t size = 3 * node.columns, end = size + 3 * node.rows;
  for (std::int32_t c = 0; c < size; c += 3)
    for (std::int32_t i = tile_of(c); i < size; i += kTileRows) visit(c, i, size);
  for (std::int32_t c = 0; c < size && node.rows > 0; c += 3)
    for (std::int32_t i = tile_of(size); i < end; i += kTileRows) visit(c, i, end);
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
      supernodes_[count_++] = {j, 1, 0, 0, 0, 0, 0}, zeros = 0;
    }
    supernode_of[j] = count_ - 1;
  }
  std::int64_t listed = 0;
  std::int32_t longest = 0;
  for (std::int32_t s = 0; s < count_; ++s) {
    Supernode& node = supernodes_[s];
    node.rows = below[node.first + node.columns - 1];
    node.stride = tile_of(3 * (node.columns + node.rows) + kTileRows - 1);
    node.panel = panel_numbers_, panel_numbers_ += 3 * static_cast<std::int64_t>(node.columns) * node.stride;
    node.tiles = numbers_;
    for_each_tile(node, [&](std::int32_t, std::int32_t, std::int32_t) { numbers_ += 3 * kTileRows; });
    node.row_list = listed, listed += node.rows;
    longest = std::max(longest, node.stride);
  }
  row_lists_ = memory.array<std::int32_t>(static_cast<std::size_t>(listed));
  if (!create_tiles(memory)) return false;
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

bool BlockFactor::create_tiles(SceneMemory& memory) {
  tiles_ = memory.array<float>(static_cast<std::size_t>(numbers_));
  if (numbers_ < fewest_for_rough_) return tiles_ != nullptr;
  rough_tiles_ = memory.array<std::int32_t>(static_cast<std::size_t>(numbers_) / 2);
  rough_scale_ = memory.array<float>(6 * static_cast<std::size_t>(rows_));
  return tiles_ && rough_tiles_ && rough_scale_;
}

bool BlockFactor::Work::create(SceneMemory& memory, const BlockFactor& factor) {
  std::int32_t longest = 0, widest = 1;
  for (std::int32_t s = 0; s < factor.count_; ++s) {
    longest = std::max(longest, factor.supernodes_[s].stride);
    widest = std::max(widest, 3 * factor.supernodes_[s].columns);
  }
  const auto rows = static_cast<std::size_t>(factor.rows_), count = static_cast<std::size_t>(factor.count_);
  panels = memory.array<double>(static_cast<std::size_t>(factor.panel_numbers_) + kPanelMargin);
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
    const std::int32_t size = 3 * node.columns;
    const double* const panel = work.panels + node.panel;
    std::int64_t at = node.tiles;
    for_each_tile(node, [&](std::int32_t column, std::int32_t row, std::int32_t end) {
      const std::int32_t first = end > size ? size : 0;
      for (std::int32_t c = column; c < column + 3; ++c)
        for (std::int32_t i = row; i < row + kTileRows; ++i, ++at)
          // What is above the diagonal is zero.
          tiles_[at] =
              i >= first && i < end ? static_cast<float>(panel[static_cast<std::int64_t>(c) * node.stride + i]) : 0;
    });
    if (rough_tiles_) round_tiles(node);
  }
}

void BlockFactor::round_tiles(const Supernode& node) {
  const std::int32_t size = 3 * node.columns;
  for (const bool below : {false, true}) std::fill(rough_scale(node, below), rough_scale(node, below) + size, 0.0f);
  // Visits the columns of all tiles with their numbers and their scale.
  const auto for_each_column = [&](auto visit) {
    std::int64_t at = node.tiles;
    for_each_tile(node, [&](std::int32_t column, std::int32_t, std::int32_t end) {
      for (std::int32_t c = column; c < column + 3; ++c, at += kTileRows) visit(at, rough_scale(node, end > size)[c]);
    });
  };
  for_each_column([&](std::int64_t at, float& scale) {
    for (std::int32_t i = 0; i < kTileRows; ++i) scale = std::max(scale, std::abs(tiles_[at + i]) / kLargest);
  });
  for_each_column([&](std::int64_t at, float& scale) {
    const float share = scale > 0 ? 1 / scale : 0;
    for (std::int32_t i = 0; i < kStep; ++i)
      rough_tiles_[at / 2 + i] = word_of(share * tiles_[at + i], share * tiles_[at + i + kStep]);
  });
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

BlockFactor::Outcome BlockFactor::create(SceneMemory& memory, const BlockRows& matrix, std::int64_t fewest_for_rough) {
  rows_ = matrix.rows, fewest_for_rough_ = fewest_for_rough;
  SceneMemory scratch = memory.of_same_host();
  Outcome outcome = Outcome::no_memory;
  if (find_supernodes(memory, scratch, matrix)) outcome = factorise(scratch, matrix);
  scratch.release_all();
  return outcome;
}

bool BlockFactor::create_like(SceneMemory& memory, const BlockFactor& other) {
  *this = other;
  return create_tiles(memory);
}

// The inner loops, once for each instruction set. Stored: float, or std::int32_t for two integers.
template <class Stored>
struct SolveWith {
  static constexpr int kTile = 3 * (std::is_same_v<Stored, float> ? kTileRows : kStep);

  static PALPATE_INLINE const Stored* tiles(const BlockFactor& factor, const BlockFactor::Supernode& node) {
    if constexpr (std::is_same_v<Stored, float>)
      return factor.tiles_ + node.tiles;
    else
      return factor.rough_tiles_ + node.tiles / 2;
  }
  // What multiplies three columns of a part of a supernode. Floats are stored as they are.
  struct Scales {
    float of[3];
  };
  static PALPATE_INLINE Scales scales(const BlockFactor& factor, const BlockFactor::Supernode& node, bool below,
                                      std::int32_t column) {
    if constexpr (std::is_same_v<Stored, float>) {
      return {{1, 1, 1}};
    } else {
      const float* const scale = factor.rough_scale(node, below) + column;
      return {{scale[0], scale[1], scale[2]}};
    }
  }
  // out[i] += the tiles' rows times x, rows begin .. end - 1 of three columns. Returns the next tile.
  static PALPATE_INLINE const Stored* add_columns(const Stored* tile, const Scales& scale, std::int32_t begin,
                                                  std::int32_t end, const float* x, float* out) {
    const float x0 = scale.of[0] * x[0], x1 = scale.of[1] * x[1], x2 = scale.of[2] * x[2];
    for (std::int32_t i = begin; i < end; i += kTileRows, tile += kTile) {
      const TileColumn a = column_of(tile, 0), b = column_of(tile, 1), c = column_of(tile, 2);
      const EightFloats upper = eight_of(out + i) + (a.upper * x0 + (b.upper * x1 + c.upper * x2));
      const EightFloats lower = eight_of(out + i + kStep) + (a.lower * x0 + (b.lower * x1 + c.lower * x2));
      std::memcpy(out + i, &upper, sizeof upper);
      std::memcpy(out + i + kStep, &lower, sizeof lower);
    }
    return tile;
  }
  // out[c] = sum over rows begin .. end - 1 of x[i] times the tiles' column c, of three. Returns the next tile.
  static PALPATE_INLINE const Stored* dot_columns(const Stored* tile, const Scales& scale, std::int32_t begin,
                                                  std::int32_t end, const float* x, float* out) {
    EightFloats sum[3] = {};
    for (std::int32_t i = begin; i < end; i += kTileRows, tile += kTile) {
      const EightFloats upper = eight_of(x + i), lower = eight_of(x + i + kStep);
      for (int d = 0; d < 3; ++d) {
        const TileColumn column = column_of(tile, d);
        sum[d] = sum[d] + (column.upper * upper + column.lower * lower);
      }
    }
    for (int d = 0; d < 3; ++d) {
      float part[kStep];
      std::memcpy(part, &sum[d], sizeof part);
      for (int k = 1; k < kStep; ++k) part[0] += part[k];
      out[d] = scale.of[d] * part[0];
    }
    return tile;
  }

  // x <- L^-1 x on the rows of a supernode, and what it takes out of the rows below. scratch: [2][longest]
  static PALPATE_INLINE void forward(const BlockFactor& factor, const BlockFactor::Supernode& node,
                                     std::int32_t longest, float* x) {
    float *const below = factor.gathered_, *const own = below + longest;
    const Stored* tile = tiles(factor, node);
    const std::int32_t size = 3 * node.columns, end = size + 3 * node.rows;
    float* const at = x + 3 * static_cast<std::int64_t>(node.first);
    // Where forces act on few nodes, x is still zero at most supernodes.
    if (std::all_of(at, at + size, [](float f) { return f == 0; })) return;
    std::fill(own, own + node.stride, 0.0f);
    for (std::int32_t c = 0; c < size; c += 3)
      tile = add_columns(tile, scales(factor, node, false, c), tile_of(c), size, at + c, own);
    std::copy(own, own + size, at);
    if (node.rows == 0) return;
    std::fill(below, below + node.stride, 0.0f);
    for (std::int32_t c = 0; c < size; c += 3)
      tile = add_columns(tile, scales(factor, node, true, c), tile_of(size), end, at + c, below);
    const std::int32_t* const list = factor.row_lists_ + node.row_list;
    for (std::int32_t i = 0; i < node.rows; ++i)
      for (int r = 0; r < 3; ++r) x[3 * static_cast<std::int64_t>(list[i]) + r] -= below[size + 3 * i + r];
  }

  // x <- L^-T x on the rows of a supernode, from the rows below it.
  static PALPATE_INLINE void backward(const BlockFactor& factor, const BlockFactor::Supernode& node,
                                      std::int32_t longest, float* x) {
    float *const below = factor.gathered_, *const own = below + longest;
    const std::int32_t size = 3 * node.columns, end = size + 3 * node.rows;
    float* const at = x + 3 * static_cast<std::int64_t>(node.first);
    const std::int32_t* const list = factor.row_lists_ + node.row_list;
    const Stored* const triangle = tiles(factor, node);
    const Stored* tile = triangle;
    for (std::int32_t c = 0; c < size; c += 3) tile += kTile * ((size - tile_of(c) + kTileRows - 1) / kTileRows);
    std::fill(below, below + node.stride, 0.0f);
    for (std::int32_t i = 0; i < node.rows; ++i)
      for (int r = 0; r < 3; ++r) below[size + 3 * i + r] = x[3 * static_cast<std::int64_t>(list[i]) + r];
    for (std::int32_t c = 0; c < size && node.rows > 0; c += 3) {
      tile = dot_columns(tile, scales(factor, node, true, c), tile_of(size), end, below, own);
      for (int d = 0; d < 3; ++d) at[c + d] -= own[d];
    }
    std::fill(own, own + node.stride, 0.0f);
    std::copy(at, at + size, own);
    tile = triangle;
    for (std::int32_t c = 0; c < size; c += 3)
      tile = dot_columns(tile, scales(factor, node, false, c), tile_of(c), size, own, at + c);
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

template <class Stored>
void solve_plainly(const BlockFactor& factor, float* const* x, int count) {
  SolveWith<Stored>::solve(factor, x, count);
}
#ifdef PALPATE_DISPATCHES
template <class Stored>
__attribute__((target(PALPATE_AVX2))) void solve_with_avx2(const BlockFactor& factor, float* const* x, int count) {
  SolveWith<Stored>::solve(factor, x, count);
}
#endif

template <class Stored>
void solve_with(const BlockFactor& factor, float* const* x, int count) {
#ifdef PALPATE_DISPATCHES
  if (best_instructions() != Instructions::baseline) return solve_with_avx2<Stored>(factor, x, count);
#endif
  solve_plainly<Stored>(factor, x, count);
}

}  // namespace

void BlockFactor::solve(float* const* x, int count) const {
  solve_with<float>(*this, x, count);
}
void BlockFactor::solve_roughly(float* x) const {
  if (!rough_tiles_) return solve(x);
  solve_with<std::int32_t>(*this, &x, 1);
}

}  // namespace palpate
