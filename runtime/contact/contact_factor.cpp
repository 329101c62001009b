#include "runtime/contact/contact_factor.h"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

// Refinement ends where the next one would change the scaled forces by less than this share.
constexpr double kRefined = 1e-9;

}  // namespace

bool ContactFactor::create(SceneMemory& memory, const RowMatrix* matrix, Operations operations, bool lasts) {
  matrix_ = matrix, most_operations_ = operations;
  const auto rows = static_cast<std::size_t>(matrix->capacity);
  shift_ = memory.array<double>(rows);
  soft_ = memory.array<double>(rows);
  work_ = memory.array<double>(2 * rows);
  row_at_ = memory.array<std::int32_t>(rows);
  list_ = memory.array<std::int32_t>(rows);
  if (!lasts) return !memory.failed();
  memory.keep(used_);
  for (double** array : {&shift_, &soft_}) memory.keep_array(*array, rows, matrix->rows_end);
  memory.keep_array(row_at_, rows);
  return factor_.create(memory, matrix->capacity) && soft_factor_.create(memory, matrix->capacity);
}

void ContactFactor::shift_rows() {
  for (std::int32_t row = 0; row < matrix_->rows_end; ++row) soft_[row] = kShift * matrix_->entry(row, row);
}

void ContactFactor::forget() {
  factor_.clear();
  soft_factor_.clear();
  used_ = 0;
}

// ---- rows that leave and come ----------------------------------------------------------------------------------------

// Rows without a scale leave the order of the factor. Returns their number, and their positions in list_.
std::int32_t ContactFactor::close_up() {
  std::int32_t stay = 0, positions = 0;
  for (std::int32_t at = 0; at < used_; ++at) {
    const std::int32_t row = row_at_[at];
    if (matrix_->scale[row] == 0)
      list_[positions++] = at;
    else
      row_at_[stay++] = row;
  }
  used_ = stay;
  return positions;
}

void ContactFactor::drop_rows() {
  const bool has_factor = exists();
  const std::int32_t positions = close_up();
  if (!has_factor || positions == 0) return;
  // Where more than a sixth of the rows leave, a new factor costs less than removing them.
  if (6 * positions > factor_.size())
    renew();
  else
    factor_.remove(positions, list_);
}

void ContactFactor::remove_rows() {
  factor_.remove(close_up(), list_);
  soft_factor_.clear();
}

bool ContactFactor::renew() {
  const std::int32_t rows = used_;
  factor_.clear();
  std::copy(row_at_, row_at_ + rows, list_);
  used_ = 0;
  return append(list_, rows);
}

// Writes A + shift I to where the factor takes its next `count` rows. order: the rows of all positions.
void ContactFactor::write_scaled(const std::int32_t* order, const std::int32_t* rows, std::int32_t count, double shift,
                                 UpdatedCholesky* factor) const {
  const std::int32_t size = factor->size();
  for (std::int32_t at = 0; at < size + count; ++at) {
    const std::int32_t row = order[at];
    const double* from = matrix_->row(row);
    double* to = factor->coming(at);
    for (std::int32_t q = std::max(0, at - size); q < count; ++q)
      to[q] = matrix_->scale[row] * matrix_->scale[rows[q]] * from[rows[q]];
    if (at >= size) to[at - size] = 1 + shift;
  }
}

// Adds rows of the matrix to the factor. False where the system is not definite.
bool ContactFactor::append(const std::int32_t* rows, std::int32_t count) {
  const bool has_factor = exists();
  std::copy(rows, rows + count, row_at_ + used_);
  used_ += count;
  for (std::int32_t q = 0; q < count && !has_factor; ++q) {
    const std::int32_t row = rows[q];
    shift_[row] = kShift, soft_[row] = kShift / (matrix_->scale[row] * matrix_->scale[row]);
  }
  if (!has_factor || count == 0) return true;
  write_scaled(row_at_, rows, count, kShift, &factor_);
  // Rounding of the stored tensors may make a pivot smaller than the shift guarantees; the factor then raises it. A pivot that
  // needs more than another kShift (hundreds of contacts in half precision) means that A is not definite and no force is bounded.
  double* const raised = work_;
  if (!factor_.append(count, 0.5 * kShift, raised)) return false;
  for (std::int32_t q = 0; q < count; ++q) {
    const std::int32_t row = rows[q];
    if (raised[q] > kShift) return false;
    shift_[row] = kShift + raised[q];
    soft_[row] = shift_[row] / (matrix_->scale[row] * matrix_->scale[row]);
  }
  return true;
}

// ---- solving ---------------------------------------------------------------------------------------------------------

// reaction: [rows_end] N, from target_ by a factor of A with something on its diagonal, and by iterative refinement. shift(at): what
// stands on the diagonal. Returns by how much another refinement would change the scaled reactions, a share of them.
template <class Shift>
double ContactFactor::refine(const UpdatedCholesky& factor, Shift shift, int most_solves, const double* target,
                             double* reaction) const {
  const std::int32_t rows = factor.size();
  double *change = work_, *sum = work_ + matrix_->capacity;
  for (std::int32_t at = 0; at < rows; ++at)
    change[at] = matrix_->scale[row_at_[at]] * target[row_at_[at]], sum[at] = 0;
  double part = 1, next = 0;  // share of the last change in the sum; that expected of the next one
  for (int solve = 0; solve < most_solves; ++solve) {
    factor.solve(change);
    double most = 0, changed = 0;
    for (std::int32_t at = 0; at < rows; ++at) {
      sum[at] += change[at];
      most = std::max(most, std::fabs(sum[at]));
      changed = std::max(changed, std::fabs(change[at]));
      change[at] *= shift(at);  // the residual of A is the shift times the last change
    }
    // The first change is all of the sum.
    const double before = part;
    part = solve == 0 ? (most > 0 ? 1 : 0) : most > 0 ? changed / most : 0;
    next = solve == 0 ? part : before > 0 ? part * part / before : 0;
    if (solve > 0 && next <= kRefined) break;
  }
  for (std::int32_t at = 0; at < rows; ++at) reaction[row_at_[at]] = matrix_->scale[row_at_[at]] * sum[at];
  return next;
}

double ContactFactor::solve(const double* target, double* reaction) const {
  return refine(
      factor_, [&](std::int32_t at) { return shift_[row_at_[at]]; }, kMostSolves, target, reaction);
}

bool ContactFactor::solve_soft(const double* target, double* reaction) {
  if (!has_soft()) {
    write_scaled(row_at_, row_at_, used_, kSoftShift, &soft_factor_);
    if (!soft_factor_.append(used_, 0.5 * kSoftShift, work_)) return false;
  }
  refine(
      soft_factor_, [](std::int32_t) { return kSoftShift; }, kSoftSolves, target, reaction);
  return true;
}

bool ContactFactor::hold_rows(const std::int32_t* rows, std::int32_t count) {
  soft_factor_.clear();
  write_scaled(rows, rows, count, kShift, &soft_factor_);
  return soft_factor_.append(count, 0.5 * kShift, work_);
}

// Sets the reactions of the `gone` rows to zero while all other rows keep their targets: with Z the columns of the inverse for
// those rows, left = r - Z (Z_gone)^-1 r_gone.
bool ContactFactor::take_out(const std::int32_t* gone, int count, double* removal, double* left) const {
  const std::int32_t size = factor_.size();
  std::int32_t position[kMostRowsOfAContact] = {};
  double* z[kMostRowsOfAContact];  // [size] each, by position
  for (int k = 0; k < count; ++k) {
    z[k] = removal + static_cast<std::size_t>(k) * static_cast<std::size_t>(matrix_->capacity);
    for (std::int32_t at = 0; at < size; ++at) {
      z[k][at] = row_at_[at] == gone[k] ? matrix_->scale[gone[k]] : 0;
      if (row_at_[at] == gone[k]) position[k] = at;
    }
    factor_.solve(z[k]);
    for (std::int32_t at = 0; at < size; ++at) z[k][at] *= matrix_->scale[row_at_[at]];
  }
  double system[kMostRowsOfAContact][kMostRowsOfAContact + 1];
  for (int i = 0; i < count; ++i) {
    for (int k = 0; k < count; ++k) system[i][k] = z[k][position[i]];
    system[i][count] = left[gone[i]];
  }
  // Z_gone is positive definite, so Gauss-Jordan needs no pivoting.
  for (int i = 0; i < count; ++i) {
    if (!(system[i][i] > 0)) return false;
    for (int r = 0; r < count; ++r) {
      const double factor = r == i ? 0 : system[r][i] / system[i][i];
      for (int k = i; k <= count && factor != 0; ++k) system[r][k] -= factor * system[i][k];
    }
  }
  double share[kMostRowsOfAContact];
  for (int k = 0; k < count; ++k) share[k] = system[k][count] / system[k][k];
  for (std::int32_t at = 0; at < size; ++at)
    for (int k = 0; k < count; ++k) left[row_at_[at]] -= share[k] * z[k][at];
  return true;
}

}  // namespace palpate
