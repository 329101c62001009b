#include "precompute/solver/supernodal_factorisation.h"

#include <algorithm>
#include <cmath>

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

template <class Number, int kBlock>
class Factorisation {
 public:
  Factorisation(const BlockMatrixOf<kBlock>& matrix, const Elimination& elimination, Number* values)
      : matrix_(matrix), e_(elimination), values_(values), begin_(rectangle_begins(elimination)) {
    const auto supernodes = static_cast<std::int32_t>(e_.first.size() - 1);
    supernode_of_.resize(e_.order.size());
    for (std::int32_t s = 0; s < supernodes; ++s)
      std::fill(supernode_of_.begin() + e_.first[s], supernode_of_.begin() + e_.first[s + 1], s);
    local_.resize(e_.order.size());
    position_.assign(e_.row_begin.begin(), e_.row_begin.end() - 1);
    waiting_.assign(static_cast<std::size_t>(supernodes), -1);
    next_ = waiting_;
    const std::size_t most = static_cast<std::size_t>(factoring_numbers(e_).work);
    product_.resize(most), signed_.resize(most);
  }

  void run() {
    for (std::int32_t s = 0; s + 1 < static_cast<std::int32_t>(e_.first.size()); ++s) {
      number_rows(s);
      assemble(s);
      for (std::int32_t d = waiting_[s]; d >= 0;) {
        const auto after = next_[d];
        subtract_product(d, s);
        wait_for_next(d);
        d = after;
      }
      factor_own(s);
      wait_for_next(s);
    }
  }

 private:
  int columns(std::int32_t s) const { return kBlock * (e_.first[s + 1] - e_.first[s]); }
  int height(std::int32_t s) const {
    return columns(s) + kBlock * static_cast<int>(e_.row_begin[s + 1] - e_.row_begin[s]);
  }

  // local_: of each block row of the supernode its number within the rectangle.
  void number_rows(std::int32_t s) {
    std::int32_t count = 0;
    for (auto place = e_.first[s]; place < e_.first[s + 1]; ++place) local_[place] = count++;
    for (auto at = e_.row_begin[s]; at < e_.row_begin[s + 1]; ++at) local_[e_.rows[at]] = count++;
  }

  // The columns of the matrix that belong to the supernode.
  void assemble(std::int32_t s) {
    Number* rectangle = values_ + begin_[s];
    const std::int64_t high = height(s);
    std::fill(rectangle, values_ + begin_[s + 1], Number(0));
    for (auto place = e_.first[s]; place < e_.first[s + 1]; ++place) {
      const auto row = e_.order[place];
      Number* column = rectangle + kBlock * (place - e_.first[s]) * high;
      for (auto at = matrix_.first[row]; at < matrix_.first[row + 1]; ++at) {
        const auto other = e_.place[matrix_.column[at]];
        if (other < place) continue;
        Number* to = column + kBlock * local_[other];
        for (int c = 0; c < kBlock; ++c)  // the matrix is symmetric
          for (int r = 0; r < kBlock; ++r) to[c * high + r] = static_cast<Number>(matrix_.block[at][kBlock * c + r]);
      }
    }
  }

  // Copies the rows `from` .. `from + rows` of the columns of a, with S applied; returns the copy and its leading dimension.
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

  // rectangle of s -= L_d S L_d^T, for the rows of d that are columns of s and all rows of d from there on.
  void subtract_product(std::int32_t d, std::int32_t s) {
    const std::int32_t* rows = e_.rows.data();
    const auto begin = position_[d], end = e_.row_begin[d + 1];
    auto inside = begin;
    while (inside < end && rows[inside] < e_.first[s + 1]) ++inside;
    position_[d] = inside;
    const int high = height(d), wide = columns(d);
    const Number* l = values_ + begin_[d] + wide;  // the rows below
    for (auto at = begin; at < inside; at += kAtOnce) {
      const int count = static_cast<int>(std::min<std::int64_t>(kAtOnce, inside - at));
      const int m = kBlock * static_cast<int>(end - at), n = kBlock * count;
      const Number* a = l + kBlock * (at - e_.row_begin[d]);
      const auto [b, ldb] = with_signs(a, high, n, wide);
      multiply_transposed(m, n, wide, Number(1), a, high, b, ldb, Number(0), product_.data(), m);
      scatter(s, rows + at, count, static_cast<int>(end - at));
    }
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

  // Factors the supernode's triangle and solves for its rows below, kPanel columns at a time.
  void factor_own(std::int32_t s) {
    Number* a = values_ + begin_[s];
    const int high = height(s), wide = columns(s);
    for (int from = 0; from < wide; from += kPanel) {
      const int n = std::min(kPanel, wide - from), m = high - from;
      Number* panel = a + static_cast<std::int64_t>(from) * high + from;
      if (from > 0) {
        const auto [b, ldb] = with_signs(a + from, high, n, from);
        multiply_transposed(m, n, from, Number(-1), a + from, high, b, ldb, Number(1), panel, high);
      }
      if (const int bad = factor_triangle<kBlock>(n, panel, high); bad < n)
        throw WrongPivot{e_.order[e_.first[s] + (from + bad) / kBlock]};
      if (m == n) continue;
      solve_right(m - n, n, panel, high, panel + n, high);
      for (int c = 0; c < n; ++c)
        if (is_negative<kBlock>(c))
          for (int r = n; r < m; ++r) panel[static_cast<std::int64_t>(c) * high + r] *= -1;
    }
  }

  // Puts the supernode into the list of the supernode to which its next row belongs.
  void wait_for_next(std::int32_t s) {
    if (position_[s] >= e_.row_begin[s + 1]) return;
    const auto owner = supernode_of_[e_.rows[position_[s]]];
    next_[s] = waiting_[owner];
    waiting_[owner] = s;
  }

  const BlockMatrixOf<kBlock>& matrix_;
  const Elimination& e_;
  Number* values_;
  std::vector<std::int64_t> begin_;         // [supernodes + 1] into values_
  std::vector<std::int32_t> supernode_of_;  // [block rows], by place
  std::vector<std::int32_t> local_;         // [block rows], by place
  std::vector<std::int64_t> position_;  // [supernodes] into rows: the first one whose product was not subtracted yet
  std::vector<std::int32_t> waiting_, next_;  // [supernodes]: lists of those that are to be subtracted, -1 at the end
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
    result.largest = std::max(result.largest, columns * (columns + below));
  }
  return result;
}

template <class Number, int kBlock>
void factorise(const BlockMatrixOf<kBlock>& matrix, const Elimination& elimination, Number* rectangles) {
  Factorisation<Number, kBlock>(matrix, elimination, rectangles).run();
}

template void factorise(const BlockMatrixOf<3>&, const Elimination&, double*);
template void factorise(const BlockMatrixOf<4>&, const Elimination&, double*);
template void factorise(const BlockMatrixOf<3>&, const Elimination&, float*);
template void factorise(const BlockMatrixOf<4>&, const Elimination&, float*);

}  // namespace palpate
