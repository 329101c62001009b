#include "precompute/solver/elimination.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "formats/errors.h"
#include "precompute/solver/cholmod_session.h"

namespace palpate {
namespace {

// The lower triangle of the pattern, column by column.
template <int kSize>
cholmod_sparse* lower_pattern(const BlockMatrixOf<kSize>& matrix, cholmod_common* common) {
  const auto n = static_cast<std::size_t>(matrix.rows);
  const std::size_t most = (matrix.column.size() + n) / 2 + 1;
  cholmod_sparse* lower = cholmod_l_allocate_sparse(n, n, most, true, true, -1, CHOLMOD_PATTERN, common);
  if (!lower) return nullptr;
  auto* first = static_cast<SuiteSparse_long*>(lower->p);
  auto* row = static_cast<SuiteSparse_long*>(lower->i);
  SuiteSparse_long count = 0;
  for (std::int32_t j = 0; j < matrix.rows; ++j) {
    first[j] = count;
    for (auto at = matrix.first[j]; at < matrix.first[j + 1]; ++at)
      if (matrix.column[at] >= j) row[count++] = matrix.column[at];
  }
  first[n] = count;
  return lower;
}

template <int kSize>
Elimination analyse(const BlockMatrixOf<kSize>& matrix) {
  CholmodSession session;
  cholmod_common& common = session.common;
  common.nmethods = 1;
  common.method[0].ordering = CHOLMOD_METIS;
  common.postorder = true;
  common.supernodal = CHOLMOD_SUPERNODAL;
  session.sparse = lower_pattern(matrix, &common);
  if (session.sparse) session.factor = cholmod_l_analyze(session.sparse, &common);
  const cholmod_factor* factor = session.factor;
  if (!factor || common.status != CHOLMOD_OK)
    throw OperationError(fmt::format("the elimination of {} nodes cannot be analysed (CHOLMOD's status {}); {}",
                                     matrix.rows, common.status,
                                     common.status == CHOLMOD_OUT_OF_MEMORY ? "memory ran out" : "this is a defect"));
  Elimination result;
  result.block = kSize;
  const auto* permutation = static_cast<const SuiteSparse_long*>(factor->Perm);
  const auto* super = static_cast<const SuiteSparse_long*>(factor->super);
  const auto* pi = static_cast<const SuiteSparse_long*>(factor->pi);
  const auto* rows = static_cast<const SuiteSparse_long*>(factor->s);
  result.order.assign(permutation, permutation + matrix.rows);
  result.place.resize(result.order.size());
  for (std::int32_t i = 0; i < matrix.rows; ++i) result.place[result.order[i]] = i;
  result.first.assign(super, super + factor->nsuper + 1);
  result.row_begin.assign(1, 0);
  for (std::size_t s = 0; s < factor->nsuper; ++s) {
    result.rows.insert(result.rows.end(), rows + pi[s] + (super[s + 1] - super[s]), rows + pi[s + 1]);
    result.row_begin.push_back(static_cast<std::int64_t>(result.rows.size()));
  }
  return result;
}

// The matrix with its rows in the order of elimination.
template <int kSize>
BlockMatrixOf<kSize> ordered(const BlockMatrixOf<kSize>& old, const Elimination& elimination) {
  BlockMatrixOf<kSize> matrix;
  matrix.rows = old.rows;
  matrix.first.assign(1, 0);
  matrix.column.reserve(old.column.size());
  matrix.block.reserve(old.block.size());
  std::vector<std::pair<std::int32_t, std::int64_t>> blocks;  // place of the column, index of the block
  for (const auto row : elimination.order) {
    blocks.clear();
    for (auto at = old.first[row]; at < old.first[row + 1]; ++at)
      blocks.emplace_back(elimination.place[old.column[at]], at);
    std::sort(blocks.begin(), blocks.end());
    for (const auto& [place, at] : blocks) matrix.column.push_back(place), matrix.block.push_back(old.block[at]);
    matrix.first.push_back(static_cast<std::int64_t>(matrix.column.size()));
  }
  return matrix;
}

}  // namespace

std::int64_t Elimination::numbers() const {
  std::int64_t sum = 0;
  for (std::size_t s = 0; s + 1 < first.size(); ++s) {
    const std::int64_t columns = block * static_cast<std::int64_t>(first[s + 1] - first[s]);
    sum += columns * (columns + 1) / 2 + columns * block * (row_begin[s + 1] - row_begin[s]);
  }
  return sum;
}

double Elimination::factor_flops() const {
  double sum = 0;
  for (std::size_t s = 0; s + 1 < first.size(); ++s) {
    const double c = static_cast<double>(block) * (first[s + 1] - first[s]);
    const double r = static_cast<double>(block) * static_cast<double>(row_begin[s + 1] - row_begin[s]);
    sum += c * c * c / 3 + c * c * r + c * r * r;
  }
  return sum;
}

Elimination analyse_elimination(const BlockMatrix& matrix) {
  return analyse(matrix);
}

Elimination analyse_elimination(const PressureForm& form) {
  return analyse(form);
}

std::shared_ptr<const Elimination> put_in_order(HeldStiffness& held, const Elimination& elimination,
                                                PressureForm* form) {
  held.matrix = ordered(held.matrix, elimination);
  if (form) *form = ordered(*form, elimination);
  std::vector<std::int32_t> node_of_row;
  for (const auto row : elimination.order) node_of_row.push_back(held.node_of_row[row]);
  held.node_of_row = std::move(node_of_row);
  for (std::size_t row = 0; row < held.node_of_row.size(); ++row)
    held.row_of_node[held.node_of_row[row]] = static_cast<std::int32_t>(row);
  auto result = std::make_shared<Elimination>(elimination);
  std::iota(result->order.begin(), result->order.end(), 0);
  result->place = result->order;
  return result;
}

}  // namespace palpate
