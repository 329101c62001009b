#include "precompute/solver/supernodal_factor.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "formats/errors.h"
#include "precompute/solver/cholmod_session.h"
#include "precompute/solver/supernodal_kernels.h"

namespace palpate {
namespace {

using Long = SuiteSparse_long;

// The lower triangle of K in elimination order, as single numbers for CHOLMOD, column by column.
cholmod_sparse* lower_triangle(const BlockMatrix& matrix, const Elimination& elimination, cholmod_common* common) {
  const std::size_t n = 3 * static_cast<std::size_t>(matrix.rows);
  const std::size_t most = (9 * matrix.column.size() + n) / 2;
  cholmod_sparse* lower = cholmod_l_allocate_sparse(n, n, most, true, true, -1, CHOLMOD_REAL, common);
  if (!lower) return nullptr;
  auto* first = static_cast<Long*>(lower->p);
  auto* row = static_cast<Long*>(lower->i);
  auto* value = static_cast<double*>(lower->x);
  std::vector<std::pair<std::int32_t, std::int64_t>> blocks;  // place of the row, index of the block
  Long count = 0;
  for (std::int32_t j = 0; j < matrix.rows; ++j) {
    const auto node = elimination.order[j];
    blocks.clear();
    for (auto at = matrix.first[node]; at < matrix.first[node + 1]; ++at)
      if (const auto place = elimination.place[matrix.column[at]]; place >= j) blocks.emplace_back(place, at);
    std::sort(blocks.begin(), blocks.end());
    for (int c = 0; c < 3; ++c) {
      first[3 * j + c] = count;
      for (const auto& [place, at] : blocks)
        for (int r = place == j ? c : 0; r < 3; ++r) {
          row[count] = 3 * static_cast<Long>(place) + r;
          value[count++] = matrix.block[at][3 * c + r];  // K is symmetric
        }
    }
  }
  first[n] = count;
  return lower;
}

Long* copied(const std::vector<Long>& from, cholmod_common* common) {
  auto* to = static_cast<Long*>(cholmod_l_malloc(from.size(), sizeof(Long), common));
  if (to) std::copy(from.begin(), from.end(), to);
  return to;
}

// The pattern of the elimination as CHOLMOD's symbolic factor, with three rows for each block row.
cholmod_factor* symbolic(const Elimination& e, cholmod_common* common) {
  const std::size_t n = 3 * e.order.size(), supernodes = e.first.size() - 1;
  std::vector<Long> super(supernodes + 1), pi(supernodes + 1, 0), px(supernodes + 1, 0), rows;
  std::vector<std::int32_t> supernode_of(e.order.size());
  for (std::size_t s = 0; s < supernodes; ++s)
    std::fill(supernode_of.begin() + e.first[s], supernode_of.begin() + e.first[s + 1], static_cast<std::int32_t>(s));
  std::size_t largest_update = 1, most_below = 1;
  for (std::size_t s = 0; s < supernodes; ++s) {
    super[s] = 3 * e.first[s];
    const auto begin = e.row_begin[s], end = e.row_begin[s + 1];
    for (Long i = super[s]; i < 3 * e.first[s + 1]; ++i) rows.push_back(i);
    for (auto at = begin; at < end; ++at)
      for (int d = 0; d < 3; ++d) rows.push_back(3 * static_cast<Long>(e.rows[at]) + d);
    pi[s + 1] = static_cast<Long>(rows.size());
    px[s + 1] = px[s] + (3 * e.first[s + 1] - super[s]) * (pi[s + 1] - pi[s]);
    most_below = std::max(most_below, static_cast<std::size_t>(3 * (end - begin)));
    for (auto at = begin; at < end;) {  // rows of one supernode update all rows from there on
      auto next = at;
      while (next < end && supernode_of[e.rows[next]] == supernode_of[e.rows[at]]) ++next;
      largest_update = std::max(largest_update, static_cast<std::size_t>(9 * (end - at) * (next - at)));
      at = next;
    }
  }
  super[supernodes] = static_cast<Long>(n);
  cholmod_factor* factor = cholmod_l_allocate_factor(n, common);
  if (!factor) return nullptr;
  factor->ordering = CHOLMOD_NATURAL;
  factor->is_ll = factor->is_super = factor->is_monotonic = true;
  factor->nsuper = supernodes;
  factor->ssize = rows.size();
  factor->xsize = static_cast<std::size_t>(px[supernodes]);
  factor->maxcsize = largest_update;
  factor->maxesize = most_below;
  factor->super = copied(super, common);
  factor->pi = copied(pi, common);
  factor->px = copied(px, common);
  factor->s = copied(rows, common);
  return factor;
}

std::string name_of(std::int32_t row, const RowNames& names) {
  const auto r = static_cast<std::size_t>(row);
  std::string name = r < names.node.size() ? fmt::format("node {}", names.node[r]) : fmt::format("block row {}", row);
  if (r < names.position.size()) {
    const auto& p = names.position[r];
    name += fmt::format(" at ({:.6g}, {:.6g}, {:.6g}) m", p[0], p[1], p[2]);
  }
  return name;
}

}  // namespace

SupernodalFactor::SupernodalFactor(const BlockMatrix& matrix, std::shared_ptr<const Elimination> elimination, int width,
                                   const RowNames& names)
    : elimination_(std::move(elimination)), width_(width) {
  const auto& e = *elimination_;
  const std::size_t supernodes = e.first.size() - 1;
  supernode_of_.resize(e.order.size());
  begin_.assign(1, 0);
  for (std::size_t s = 0; s < supernodes; ++s) {
    std::fill(supernode_of_.begin() + e.first[s], supernode_of_.begin() + e.first[s + 1], static_cast<std::int32_t>(s));
    begin_.push_back(begin_.back() +
                     supernode_numbers(e.first[s + 1] - e.first[s], e.row_begin[s + 1] - e.row_begin[s]));
  }
  for (std::size_t s = 0; s < supernodes; ++s)
    parent_.push_back(e.row_begin[s] < e.row_begin[s + 1] ? supernode_of_[e.rows[e.row_begin[s]]] : -1);
  in_order_ = std::is_sorted(e.order.begin(), e.order.end());
  touched_.resize(supernodes);
  compute(matrix, names);
  if (!in_order_) work_ = make_column_buffer(3 * static_cast<std::int64_t>(e.order.size()), width);
}

void SupernodalFactor::compute(const BlockMatrix& matrix, const RowNames& names) {
  CholmodSession session;
  cholmod_common& common = session.common;
  common.supernodal = CHOLMOD_SUPERNODAL;
  common.quick_return_if_not_posdef = true;
  session.sparse = lower_triangle(matrix, *elimination_, &common);
  if (session.sparse) session.factor = symbolic(*elimination_, &common);
  if (session.factor && common.status == CHOLMOD_OK) cholmod_l_factorize(session.sparse, session.factor, &common);
  if (common.status == CHOLMOD_NOT_POSDEF)
    throw OperationError(fmt::format(
        "the stiffness matrix is not positive definite to working precision: the Cholesky factorisation fails at {}",
        name_of(elimination_->order[session.factor->minor / 3], names)));
  if (common.status != CHOLMOD_OK || !session.factor || !session.factor->x)
    throw OperationError(fmt::format(
        "the Cholesky factor of {} degrees of freedom ({:.3g} GB) cannot be computed: {} (CHOLMOD's status {}); try "
        "\"-- -column_pc_type gamg\" or a coarser mesh",
        3 * static_cast<std::int64_t>(matrix.rows), 8e-9 * static_cast<double>(begin_.back()),
        common.status == CHOLMOD_OUT_OF_MEMORY ? "memory ran out" : "too large", common.status));
  pack(static_cast<double*>(session.factor->x));
  session.factor->x = nullptr;  // values_ owns it now
  session.factor->xsize = 0;
}

// Converts CHOLMOD's supernodes, rectangles that are stored column after column, into the panels of the kernels. Works in
// place, because the panels of a supernode take no more numbers than its rectangle.
void SupernodalFactor::pack(double* values) {
  const auto& e = *elimination_;
  double least = INFINITY, largest = 0;
  std::vector<double> rectangle;
  const double* from = values;
  for (std::size_t s = 0; s + 1 < e.first.size(); ++s) {
    const std::int64_t columns = 3 * static_cast<std::int64_t>(e.first[s + 1] - e.first[s]);
    const std::int64_t height = columns + 3 * (e.row_begin[s + 1] - e.row_begin[s]);
    rectangle.assign(from, from + columns * height);
    from += columns * height;
    double* to = values + begin_[s];
    for (std::int64_t panel = 0; panel < columns; panel += 6) {
      const std::int64_t wide = std::min<std::int64_t>(6, columns - panel);
      for (std::int64_t row = panel; row < height; ++row)
        for (std::int64_t c = panel; c < panel + wide; ++c) *to++ = c <= row ? rectangle[c * height + row] : 0.0;
      double* diagonal = to - (height - panel) * wide;
      for (std::int64_t c = 0; c < wide; ++c, diagonal += wide + 1) {
        least = std::min(least, *diagonal), largest = std::max(largest, *diagonal);
        *diagonal = 1 / *diagonal;
      }
    }
  }
  void* shrunk =
      std::realloc(values, static_cast<std::size_t>(std::max<std::int64_t>(begin_.back(), 1)) * sizeof(double));
  values_.reset(static_cast<double*>(shrunk ? shrunk : values));
  reciprocal_condition_ = largest > 0 ? (least / largest) * (least / largest) : 1;
}

void SupernodalFactor::apply(const double* r, double* z) {
  const auto run = 3 * static_cast<std::int64_t>(width_);
  const auto places = static_cast<std::int32_t>(elimination_->order.size());
  double* y = in_order_ ? z : work_.get();
  std::fill(touched_.begin(), touched_.end(), 0);
  for (std::int32_t place = 0; place < places; ++place) {
    const double* from = r + elimination_->order[place] * run;
    std::copy_n(from, run, y + place * run);
    if (!touched_[supernode_of_[place]])
      touched_[supernode_of_[place]] = std::any_of(from, from + run, [](double value) { return value != 0; });
  }
  touch_ancestors();
  solve_triangles(y);
  to_caller(y, z);
}

bool SupernodalFactor::apply_to_loads(std::span<const Load> loads, double* x) {
  const auto& e = *elimination_;
  const auto run = 3 * static_cast<std::int64_t>(width_);
  double* y = in_order_ ? x : work_.get();
  std::fill(touched_.begin(), touched_.end(), 0);
  for (const auto& load : loads) touched_[supernode_of_[e.place[load.dof / 3]]] = 1;
  touch_ancestors();
  for (std::size_t s = 0; s < touched_.size(); ++s)
    if (touched_[s]) std::fill(y + e.first[s] * run, y + e.first[s + 1] * run, 0.0);
  for (const auto& load : loads) y[e.place[load.dof / 3] * run + load.dof % 3 * width_ + load.column] += load.value;
  solve_triangles(y);
  to_caller(y, x);
  return true;
}

void SupernodalFactor::touch_ancestors() {
  for (std::size_t s = 0; s < touched_.size(); ++s)
    if (touched_[s] && parent_[s] >= 0) touched_[parent_[s]] = 1;
}

// y: in elimination order. Forward, then backward substitution; the rows of supernodes that are not touched count as zero and
// are not read before they are written.
void SupernodalFactor::solve_triangles(double* y) const {
  const auto& e = *elimination_;
  const SupernodalKernels kernels = supernodal_kernels();
  const auto part = [&](std::size_t s) {
    return Supernode{e.first[s], e.first[s + 1] - e.first[s],
                     static_cast<std::int32_t>(e.row_begin[s + 1] - e.row_begin[s]), e.rows.data() + e.row_begin[s],
                     values_.get() + begin_[s]};
  };
  for (std::size_t s = 0; s < touched_.size(); ++s)
    if (touched_[s]) kernels.forward(part(s), y, width_);
  for (std::size_t s = touched_.size(); s-- > 0;) kernels.backward(part(s), !touched_[s], y, width_);
}

void SupernodalFactor::to_caller(const double* y, double* x) const {
  const auto run = 3 * static_cast<std::int64_t>(width_);
  if (in_order_) return;
  for (std::size_t place = 0; place < elimination_->order.size(); ++place)
    std::copy_n(y + static_cast<std::int64_t>(place) * run, run, x + elimination_->order[place] * run);
}

}  // namespace palpate
