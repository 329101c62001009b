#include "precompute/solver/supernodal_factorisation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <queue>

#include "precompute/solver/machine_memory.h"
#include "precompute/solver/vector_registers.h"

// BLAS, by its Fortran names.
extern "C" {
void dgemm_(const char*, const char*, const int*, const int*, const int*, const double*, const double*, const int*,
            const double*, const int*, const double*, double*, const int*);
void sgemm_(const char*, const char*, const int*, const int*, const int*, const float*, const float*, const int*,
            const float*, const int*, const float*, float*, const int*);
void dtrsm_(const char*, const char*, const char*, const char*, const int*, const int*, const double*, const double*,
            const int*, double*, const int*);
void strsm_(const char*, const char*, const char*, const char*, const int*, const int*, const float*, const float*,
            const int*, float*, const int*);
}

namespace palpate {
namespace {

// c = beta c + alpha a b^T; a: [m][k], b: [n][k], c: [m][n], column by column.
void multiply_transposed(int m, int n, int k, double alpha, const double* a, int lda, const double* b, int ldb,
                         double beta, double* c, int ldc) {
  dgemm_("N", "T", &m, &n, &k, &alpha, a, &lda, b, &ldb, &beta, c, &ldc);
}
void multiply_transposed(int m, int n, int k, float alpha, const float* a, int lda, const float* b, int ldb, float beta,
                         float* c, int ldc) {
  sgemm_("N", "T", &m, &n, &k, &alpha, a, &lda, b, &ldb, &beta, c, &ldc);
}

// b = b l^-T; l: [n][n], its lower triangle, b: [m][n].
void solve_right(int m, int n, const double* l, int ldl, double* b, int ldb) {
  const double one = 1;
  dtrsm_("R", "L", "T", "N", &m, &n, &one, l, &ldl, b, &ldb);
}
void solve_right(int m, int n, const float* l, int ldl, float* b, int ldb) {
  const float one = 1;
  strsm_("R", "L", "T", "N", &m, &n, &one, l, &ldl, b, &ldb);
}

constexpr int kPanel = 48;        // columns of a triangle that are factored without BLAS
constexpr int kAtOnce = 32;       // block columns of a product between two supernodes that are computed at once
constexpr int kRowSlice = 512;    // rows of a panel that are computed at once
static_assert(kPanel % 12 == 0);  // whole blocks of 3 and of 4

template <int kBlock>
constexpr bool is_negative(std::int64_t column) {
  return kBlock == 4 && column % 4 == 3;
}

// Factors the lower triangle of a [n][n]; the first column stands at the begin of a block. Returns the first column with a wrong
// pivot, or n.
template <class Number, int kBlock>
PALPATE_INLINE int factor_small(int n, Number* a, std::int64_t lda) {
  for (int j = 0; j < n; ++j) {
    Number* column = a + j * lda;
    const Number sign = is_negative<kBlock>(j) ? -1 : 1;
    const Number pivot = sign * column[j];
    if (!(pivot > 0) || !std::isfinite(pivot)) return j;
    const Number root = std::sqrt(pivot), scale = sign / root;
    column[j] = root;
    for (int i = j + 1; i < n; ++i) column[i] *= scale;
    for (int k = j + 1; k < n; ++k) {
      Number* to = a + k * lda;
      const Number factor = sign * column[k];
      for (int i = k; i < n; ++i) to[i] -= factor * column[i];
    }
  }
  return n;
}

// The same for each type, in the widest registers there are.
PALPATE_VECTOR_VERSIONS int factor_small_double3(int n, double* a, std::int64_t lda) {
  return factor_small<double, 3>(n, a, lda);
}
PALPATE_VECTOR_VERSIONS int factor_small_double4(int n, double* a, std::int64_t lda) {
  return factor_small<double, 4>(n, a, lda);
}
PALPATE_VECTOR_VERSIONS int factor_small_float3(int n, float* a, std::int64_t lda) {
  return factor_small<float, 3>(n, a, lda);
}
PALPATE_VECTOR_VERSIONS int factor_small_float4(int n, float* a, std::int64_t lda) {
  return factor_small<float, 4>(n, a, lda);
}
template <int kBlock>
int factor_triangle(int n, double* a, std::int64_t lda) {
  return kBlock == 4 ? factor_small_double4(n, a, lda) : factor_small_double3(n, a, lda);
}
template <int kBlock>
int factor_triangle(int n, float* a, std::int64_t lda) {
  return kBlock == 4 ? factor_small_float4(n, a, lda) : factor_small_float3(n, a, lda);
}

// Where the rectangle of each supernode begins.
std::vector<std::int64_t> rectangle_begins(const Elimination& e) {
  std::vector<std::int64_t> begin = {0};
  for (std::size_t s = 0; s + 1 < e.first.size(); ++s) {
    const std::int64_t columns = e.first[s + 1] - e.first[s], height = columns + e.row_begin[s + 1] - e.row_begin[s];
    begin.push_back(begin.back() + e.block * columns * e.block * height);
  }
  return begin;
}

// A supernode d has rows in the columns of a later one: rows[begin .. end) of e.rows are those rows.
struct Update {
  std::int32_t d;
  std::int64_t begin, end;
};

// Of each supernode s, updates[first[s] .. first[s + 1]): those of all supernodes before it, in ascending order.
struct Updates {
  std::vector<std::int64_t> first;
  std::vector<Update> updates;
};

template <class Visit>
void for_each_update(const Elimination& e, const std::vector<std::int32_t>& supernode_of, const Visit& visit) {
  for (std::int32_t d = 0; d + 1 < static_cast<std::int32_t>(e.first.size()); ++d)
    for (auto at = e.row_begin[d]; at < e.row_begin[d + 1];) {
      const auto s = supernode_of[e.rows[at]];
      auto end = at;
      while (end < e.row_begin[d + 1] && e.rows[end] < e.first[s + 1]) ++end;
      visit(s, Update{d, at, end});
      at = end;
    }
}

Updates updates_of(const Elimination& e, const std::vector<std::int32_t>& supernode_of) {
  Updates result;
  result.first.assign(e.first.size(), 0);
  for_each_update(e, supernode_of, [&](std::int32_t s, const Update&) { ++result.first[s + 1]; });
  std::partial_sum(result.first.begin(), result.first.end(), result.first.begin());
  result.updates.resize(static_cast<std::size_t>(result.first.back()));
  std::vector<std::int64_t> next = result.first;
  for_each_update(e, supernode_of, [&](std::int32_t s, const Update& update) { result.updates[next[s]++] = update; });
  return result;
}

constexpr std::int32_t kAllRanks = -1, kFirstRankLater = -2;
constexpr double kPartsPerRank =
    8;  // a subtree is at most this part of a rank's share, so that the shares come out even
constexpr double kTogetherFlops =
    2e7;  // with fewer operations, waiting for one another takes longer than working alone

// Which rank factors each supernode: whole subtrees of the elimination tree to one rank; of the supernodes above them, the large
// ones to kAllRanks and the small ones to kFirstRankLater, rank 0 when the subtrees are done.
std::vector<std::int32_t> owners_of(const Elimination& e, const std::vector<std::int32_t>& supernode_of,
                                    const Updates& updates, int ranks) {
  const std::size_t supernodes = e.first.size() - 1;
  if (ranks == 1) return std::vector<std::int32_t>(supernodes, 0);
  std::vector<double> cost(supernodes);  // of the supernode with its subtree
  std::vector<std::int32_t> owner(supernodes);
  std::vector<std::vector<std::int32_t>> children(supernodes);
  std::priority_queue<std::pair<double, std::int32_t>> subtrees;  // by cost, then by root
  double all = 0;
  for (std::size_t s = 0; s < supernodes; ++s) {
    const double wide = e.first[s + 1] - e.first[s], below = static_cast<double>(e.row_begin[s + 1] - e.row_begin[s]);
    double own = wide * wide * (wide / 3 + below);
    for (auto u = updates.first[s]; u < updates.first[s + 1]; ++u) {
      const Update& update = updates.updates[u];
      own += 2.0 * (e.first[update.d + 1] - e.first[update.d]) * static_cast<double>(update.end - update.begin) *
             static_cast<double>(e.row_begin[update.d + 1] - update.begin);
    }
    all += own;
    cost[s] += own;
    owner[s] = own * std::pow(e.block, 3) > kTogetherFlops ? kAllRanks : kFirstRankLater;
    if (below == 0) {
      subtrees.emplace(cost[s], static_cast<std::int32_t>(s));
    } else {
      const auto parent = supernode_of[e.rows[e.row_begin[s]]];
      cost[parent] += cost[s];
      children[parent].push_back(static_cast<std::int32_t>(s));
    }
  }
  std::vector<double> load(static_cast<std::size_t>(ranks), 0.0);
  while (!subtrees.empty()) {
    const auto [subtree_cost, root] = subtrees.top();
    subtrees.pop();
    if (subtree_cost > all / (kPartsPerRank * ranks)) {
      for (const auto child : children[root]) subtrees.emplace(cost[child], child);
      continue;
    }
    const auto least = std::min_element(load.begin(), load.end());
    *least += subtree_cost;
    owner[root] = static_cast<std::int32_t>(least - load.begin());
  }
  for (std::size_t s = supernodes; s-- > 0;)
    for (const auto child : children[s])
      if (owner[s] >= 0) owner[child] = owner[s];
  return owner;
}

constexpr std::int32_t kNoRow = std::numeric_limits<std::int32_t>::max();

template <class Number, int kBlock>
class Factorisation {
 public:
  Factorisation(const BlockMatrixOf<kBlock>& matrix, const Elimination& elimination, Number* values,
                MachineMemory* machine)
      : matrix_(matrix),
        e_(elimination),
        values_(values),
        machine_(machine),
        rank_(machine ? machine->rank() : 0),
        ranks_(machine ? machine->count() : 1),
        begin_(rectangle_begins(elimination)) {
    supernode_of_.resize(e_.order.size());
    for (std::int32_t s = 0; s + 1 < static_cast<std::int32_t>(e_.first.size()); ++s)
      std::fill(supernode_of_.begin() + e_.first[s], supernode_of_.begin() + e_.first[s + 1], s);
    updates_ = updates_of(e_, supernode_of_);
    owner_ = owners_of(e_, supernode_of_, updates_, ranks_);
    local_.resize(e_.order.size());
    const std::size_t most = static_cast<std::size_t>(factoring_numbers(e_).work);
    product_.resize(most), signed_.resize(most);
  }

  void run() {
    std::int32_t bad = kNoRow;  // the place of the first wrong pivot
    for (std::int32_t s = 0; s < supernodes() && bad == kNoRow; ++s)
      if (owner_[s] == rank_) bad = factor<false>(s);
    if (machine_) bad = above_subtrees(machine_->least(bad));
    if (bad != kNoRow) throw WrongPivot{e_.order[bad]};
  }

 private:
  std::int32_t supernodes() const { return static_cast<std::int32_t>(e_.first.size()) - 1; }
  int columns(std::int32_t s) const { return kBlock * (e_.first[s + 1] - e_.first[s]); }
  int height(std::int32_t s) const {
    return columns(s) + kBlock * static_cast<int>(e_.row_begin[s + 1] - e_.row_begin[s]);
  }

  // bad and the result: the same on every rank.
  std::int32_t above_subtrees(std::int32_t bad) {
    bool agreed = true;
    for (std::int32_t s = 0; s < supernodes(); ++s) {
      if (owner_[s] == kFirstRankLater) {
        if (rank_ == 0 && bad == kNoRow) bad = factor<false>(s);
        agreed = false;
      } else if (owner_[s] == kAllRanks) {
        if (!agreed) bad = machine_->least(bad);
        agreed = true;
        if (bad != kNoRow) return bad;
        bad = factor<true>(s);
      }
    }
    return agreed ? bad : machine_->least(bad);
  }

  // Slices of columns or of rows; those of one supernode have the same bounds for any number of ranks.
  template <bool kTogether>
  bool is_mine(std::int64_t slice) const {
    return !kTogether || slice % ranks_ == rank_;
  }

  // Returns the place of a wrong pivot, or kNoRow. kTogether: all ranks call it for the same supernode.
  template <bool kTogether>
  std::int32_t factor(std::int32_t s) {
    number_rows(s);
    for (auto from = e_.first[s]; from < e_.first[s + 1]; from += kAtOnce) {
      if (!is_mine<kTogether>((from - e_.first[s]) / kAtOnce)) continue;
      const auto end = std::min(e_.first[s + 1], from + kAtOnce);
      assemble(s, from, end);
      for (auto u = updates_.first[s]; u < updates_.first[s + 1]; ++u)
        subtract_product(updates_.updates[u], s, from, end);
    }
    if (kTogether) machine_->meet();
    return factor_own<kTogether>(s);
  }

  // local_: of each block row of the supernode its number within the rectangle.
  void number_rows(std::int32_t s) {
    std::int32_t count = 0;
    for (auto place = e_.first[s]; place < e_.first[s + 1]; ++place) local_[place] = count++;
    for (auto at = e_.row_begin[s]; at < e_.row_begin[s + 1]; ++at) local_[e_.rows[at]] = count++;
  }

  // The columns from .. end of the matrix, which belong to the supernode.
  void assemble(std::int32_t s, std::int32_t from, std::int32_t end) {
    const std::int64_t high = height(s);
    Number* first = values_ + begin_[s] + kBlock * (from - e_.first[s]) * high;
    std::fill_n(first, kBlock * (end - from) * high, Number(0));
    for (auto place = from; place < end; ++place) {
      const auto row = e_.order[place];
      Number* column = first + kBlock * (place - from) * high;
      for (auto at = matrix_.first[row]; at < matrix_.first[row + 1]; ++at) {
        const auto other = e_.place[matrix_.column[at]];
        if (other < place) continue;
        Number* to = column + kBlock * local_[other];
        for (int c = 0; c < kBlock; ++c)  // the matrix is symmetric
          for (int r = 0; r < kBlock; ++r) to[c * high + r] = static_cast<Number>(matrix_.block[at][kBlock * c + r]);
      }
    }
  }

  // Copies the first `rows` rows of the columns of a, with S applied; returns the copy and its leading dimension.
  std::pair<const Number*, int> with_signs(const Number* a, int lda, int rows, int k) {
    if (kBlock == 3) return {a, lda};
    for (int c = 0; c < k; ++c)
      for (int r = 0; r < rows; ++r) {
        const Number value = a[static_cast<std::int64_t>(c) * lda + r];
        signed_[static_cast<std::size_t>(c) * static_cast<std::size_t>(rows) + static_cast<std::size_t>(r)] =
            is_negative<kBlock>(c) ? -value : value;
      }
    return {signed_.data(), rows};
  }

  // The columns from .. to of s -= L_d S L_d^T.
  void subtract_product(const Update& update, std::int32_t s, std::int32_t from, std::int32_t to) {
    const auto d = update.d;
    const std::int32_t* rows = e_.rows.data();
    const auto at = std::lower_bound(rows + update.begin, rows + update.end, from) - rows;
    const auto end = std::lower_bound(rows + at, rows + update.end, to) - rows;
    if (at == end) return;
    const int high = height(d), wide = columns(d), count = static_cast<int>(end - at);
    const int all = static_cast<int>(e_.row_begin[d + 1] - at), m = kBlock * all, n = kBlock * count;
    const Number* a = values_ + begin_[d] + wide + kBlock * (at - e_.row_begin[d]);
    const auto [b, ldb] = with_signs(a, high, n, wide);
    multiply_transposed(m, n, wide, Number(1), a, high, b, ldb, Number(0), product_.data(), m);
    scatter(s, rows + at, count, all);
  }

  // product_: [rows][count] blocks; its rows are rows[0] .., its columns the first `count` of them.
  void scatter(std::int32_t s, const std::int32_t* rows, int count, int all) {
    const std::int64_t high = height(s), m = kBlock * static_cast<std::int64_t>(all);
    for (int j = 0; j < count; ++j)
      for (int c = 0; c < kBlock; ++c) {
        Number* to = values_ + begin_[s] + (kBlock * static_cast<std::int64_t>(local_[rows[j]]) + c) * high;
        const Number* from = product_.data() + (kBlock * j + c) * m;
        for (int i = j; i < all; ++i) {
          Number* target = to + kBlock * local_[rows[i]];
          for (int r = 0; r < kBlock; ++r) target[r] -= from[kBlock * i + r];
        }
      }
  }

  // Factors the supernode's triangle and solves for its rows below, kPanel columns at a time, in slices of rows: the first slice
  // has the triangle of the panel.
  template <bool kTogether>
  std::int32_t factor_own(std::int32_t s) {
    Number* a = values_ + begin_[s];
    const int high = height(s), wide = columns(s);
    for (int from = 0; from < wide; from += kPanel) {
      const int n = std::min(kPanel, wide - from);
      Number* panel = a + static_cast<std::int64_t>(from) * high;  // its row r is row r of the rectangle
      if (from > 0) subtract_columns_before<kTogether>(a, high, from, n);
      std::int32_t bad = kNoRow;
      if (is_mine<kTogether>(0)) {
        const int column = factor_triangle<kBlock>(n, panel + from, high);
        if (column < n) bad = e_.first[s] + (from + column) / kBlock;
      }
      if (kTogether) bad = machine_->least(bad);
      if (bad != kNoRow) return bad;
      for (int row = from; row < high; row += kRowSlice) {
        const int begin = std::max(row, from + n), rows = std::min(row + kRowSlice, high) - begin;
        if (is_mine<kTogether>((row - from) / kRowSlice) && rows > 0)
          solve_rows(rows, n, panel + from, high, panel + begin);
      }
      if (kTogether) machine_->meet();
    }
    return kNoRow;
  }

  // The panel's columns from .. from + n -= what the columns before them contribute.
  template <bool kTogether>
  void subtract_columns_before(Number* a, int high, int from, int n) {
    const auto [b, ldb] = with_signs(a + from, high, n, from);
    for (int row = from; row < high; row += kRowSlice) {
      if (!is_mine<kTogether>((row - from) / kRowSlice)) continue;
      const int rows = std::min(kRowSlice, high - row);
      multiply_transposed(rows, n, from, Number(-1), a + row, high, b, ldb, Number(1),
                          a + static_cast<std::int64_t>(from) * high + row, high);
    }
  }

  // rows of the panel = rows l^-T S
  void solve_rows(int rows, int n, const Number* triangle, int high, Number* panel) {
    solve_right(rows, n, triangle, high, panel, high);
    for (int c = 0; c < n; ++c)
      if (is_negative<kBlock>(c))
        for (int r = 0; r < rows; ++r) panel[static_cast<std::int64_t>(c) * high + r] *= -1;
  }

  const BlockMatrixOf<kBlock>& matrix_;
  const Elimination& e_;
  Number* values_;
  MachineMemory* machine_;
  int rank_, ranks_;
  std::vector<std::int64_t> begin_;         // [supernodes + 1] into values_
  std::vector<std::int32_t> supernode_of_;  // [block rows], by place
  Updates updates_;
  std::vector<std::int32_t> owner_;  // [supernodes]: a rank, or kAllRanks
  std::vector<std::int32_t> local_;  // [block rows], by place
  std::vector<Number> product_, signed_;
};

}  // namespace

FactoringNumbers factoring_numbers(const Elimination& e) {
  FactoringNumbers result;
  result.rectangles = rectangle_begins(e).back();
  for (std::size_t s = 0; s + 1 < e.first.size(); ++s) {
    const std::int64_t columns = e.block * static_cast<std::int64_t>(e.first[s + 1] - e.first[s]);
    const std::int64_t below = e.block * (e.row_begin[s + 1] - e.row_begin[s]);
    const std::int64_t product = below * std::min<std::int64_t>(below, e.block * kAtOnce);
    const std::int64_t copy =
        columns * std::max<std::int64_t>(kPanel, std::min<std::int64_t>(below, e.block * kAtOnce));
    result.work = std::max({result.work, product, copy});
  }
  return result;
}

template <class Number, int kBlock>
void factorise(const BlockMatrixOf<kBlock>& matrix, const Elimination& elimination, Number* rectangles,
               MachineMemory* machine) {
  std::optional<Factorisation<Number, kBlock>> factorisation;
  const auto prepare = [&] { factorisation.emplace(matrix, elimination, rectangles, machine); };
  if (machine)
    machine->allocate_together(prepare);
  else
    prepare();
  factorisation->run();
}

template void factorise(const BlockMatrixOf<3>&, const Elimination&, double*, MachineMemory*);
template void factorise(const BlockMatrixOf<4>&, const Elimination&, double*, MachineMemory*);
template void factorise(const BlockMatrixOf<3>&, const Elimination&, float*, MachineMemory*);
template void factorise(const BlockMatrixOf<4>&, const Elimination&, float*, MachineMemory*);

}  // namespace palpate
