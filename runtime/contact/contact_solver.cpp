#include "runtime/contact/contact_solver.h"

#include <algorithm>
#include <cmath>

#include "runtime/dense/dense_rows.h"

namespace palpate {
namespace {

// Refinement ends when the next one would change the scaled forces by less than this part of them.
constexpr double kMet = 1e-9;
// The targets conflict where one more refinement would still change the scaled forces by more than this part of them.
constexpr double kConflict = 1e-6;
// Gauss-Seidel ends when a sweep moves nothing by more than this part of the largest target, after kMostSweeps, or when
// it has spent kMostWork multiply-adds (about a millisecond).
constexpr double kSettled = 1e-10;
constexpr std::int32_t kMostSweeps = 200, kFewestSweeps = 10;
constexpr std::int64_t kMostWork = 4'000'000;

double largest(const double* x, std::int32_t count) {
  double most = 0;
  for (std::int32_t i = 0; i < count; ++i) most = std::max(most, std::fabs(x[i]));
  return most;
}

bool comes_before(const ContactBlock& a, const ContactBlock& b) {
  if (a.tool != b.tool) return a.tool < b.tool;
  if (a.point != b.point) return a.point < b.point;
  return a.part < b.part;
}

}  // namespace

bool ContactSolver::create(SceneMemory& memory, std::int32_t entry_capacity, std::int32_t block_capacity,
                           std::int32_t columns, bool lets_go) {
  capacity_ = 3 * block_capacity;
  const std::size_t rows = static_cast<std::size_t>(capacity_), entries = static_cast<std::size_t>(entry_capacity),
                    blocks = static_cast<std::size_t>(block_capacity);
  stride_ = odd_lines(rows);
  matrix_ = memory.array<double>(rows * stride_);
  scale_ = memory.array<double>(rows);
  shift_ = memory.array<double>(rows);
  soft_ = memory.array<double>(rows);
  last_ = memory.array<double>(rows);
  target_ = memory.array<double>(rows);
  reaction_ = memory.array<double>(rows);
  work_ = memory.array<double>(2 * rows);
  if (lets_go) removal_ = memory.array<double>(kMostRowsOfAContact * rows);
  row_at_ = memory.array<std::int32_t>(rows);
  list_ = memory.array<std::int32_t>(rows);
  leaving_ = memory.array<std::int32_t>(rows);
  spread_ = memory.array<Mat3>(entries);
  rows_ = memory.array<Rows>(blocks);
  kept_rows_ = memory.array<Rows>(blocks);
  kept_entry_ = memory.array<ContactEntry>(entries);
  kept_block_ = memory.array<ContactBlock>(blocks);
  return nodes_.create(memory, entry_capacity, columns) && factor_.create(memory, capacity_) && !memory.failed();
}

void ContactSolver::forget() {
  nodes_.forget();
  factor_.clear();
  std::fill(scale_, scale_ + rows_end_, 0.0);
  rows_end_ = free_row_ = kept_blocks_ = kept_entries_ = 0;
}

// ---- rows that stay, leave and come -------------------------------------------------------------------------------

bool ContactSolver::same(const ContactSet& set, const ContactBlock& now, const ContactBlock& before) const {
  if (now.entry_count != before.entry_count || now.axes != before.axes || now.framed != before.framed) return false;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      if (now.local.m[i][j] != before.local.m[i][j]) return false;
      if (now.framed && now.frame.m[i][j] != before.frame.m[i][j]) return false;
    }
  }
  for (std::int32_t v = 0; v < now.entry_count; ++v) {
    const ContactEntry &a = set.entries[now.first_entry + v], &b = kept_entry_[before.first_entry + v];
    if (a.column != b.column || a.weight != b.weight) return false;
  }
  return true;
}

// Both sets are ascending by tool, point and part: one walk through the two. Rows of blocks that are gone are listed in
// leaving_; blocks without rows are marked by first row -2.
void ContactSolver::match(const ContactSet& set) {
  leaving_count_ = 0;
  const auto leave = [&](const Rows& rows) {
    for (const std::int32_t row : rows.at)
      if (row >= 0) leaving_[leaving_count_++] = row;
  };
  std::int32_t k = 0;
  for (std::int32_t p = 0; p < set.block_count; ++p) {
    const ContactBlock& block = set.blocks[p];
    while (k < kept_blocks_ && comes_before(kept_block_[k], block)) leave(kept_rows_[k++]);
    const bool known = k < kept_blocks_ && !comes_before(block, kept_block_[k]);
    if (known && same(set, block, kept_block_[k])) {
      rows_[p] = kept_rows_[k];
    } else {
      rows_[p] = {{-2, -1, -1}};
      if (known) leave(kept_rows_[k]);
    }
    if (known) ++k;
  }
  while (k < kept_blocks_) leave(kept_rows_[k++]);
}

void ContactSolver::drop_rows() {
  if (leaving_count_ == 0) return;
  free_row_ = 0;
  for (std::int32_t l = 0; l < leaving_count_; ++l) scale_[leaving_[l]] = 0, reaction_[leaving_[l]] = 0;
  std::int32_t stay = 0, positions = 0;
  for (std::int32_t at = 0; at < factor_.size(); ++at) {
    const std::int32_t row = row_at_[at];
    if (scale_[row] == 0)
      list_[positions++] = at;
    else
      row_at_[stay++] = row;
  }
  while (rows_end_ > 0 && scale_[rows_end_ - 1] == 0) --rows_end_;
  // Beyond a sixth of the rows, a new factor costs less than taking them out.
  if (6 * positions > factor_.size()) {
    factor_.clear();
    std::copy(row_at_, row_at_ + stay, list_);
    append_rows(list_, stay);
  } else {
    factor_.remove(positions, list_);
  }
}

std::int32_t ContactSolver::take_row() {
  while (free_row_ < rows_end_ && scale_[free_row_] != 0) ++free_row_;
  rows_end_ = std::max(rows_end_, free_row_ + 1);
  return free_row_;
}

// H C of a block against every node that is held, by slot.
const Mat3* ContactSolver::spread_of(const ContactSet& set, const ContactBlock& block) {
  const std::int32_t first = block.first_entry;
  if (block.entry_count == 1 && set.entries[first].weight == 1) return nodes_.at(nodes_.slot_of_entry(first));
  std::fill(spread_, spread_ + nodes_.slots(), Mat3{});
  for (std::int32_t e = first; e < first + block.entry_count; ++e) {
    const Mat3* c = nodes_.at(nodes_.slot_of_entry(e));
    for (std::int32_t b = 0; b < nodes_.slots(); ++b)
      if (nodes_.in_use(b)) add_scaled(spread_[b], set.entries[e].weight, c[b]);
  }
  return spread_;
}

// The rows of block p against those of all blocks that have rows. False when a number is not finite.
bool ContactSolver::fill_rows(const ContactSet& set, std::int32_t p) {
  const ContactBlock& block = set.blocks[p];
  const Mat3* const spread = spread_of(set, block);
  const auto between = [&](const ContactBlock& other) {
    const ContactEntry* entry = set.entries + other.first_entry;
    Mat3 sum = spread[nodes_.slot_of_entry(other.first_entry)];
    if (other.entry_count > 1 || entry->weight != 1) {
      sum = Mat3{};
      for (std::int32_t w = 0; w < other.entry_count; ++w)
        add_scaled(sum, entry[w].weight, spread[nodes_.slot_of_entry(other.first_entry + w)]);
    }
    if (block.framed) sum = block.frame * sum;
    return other.framed ? times_transposed(sum, other.frame) : sum;
  };

  Mat3 own = between(block);
  add_scaled(own, 1, block.local);
  Rows& rows = rows_[p];
  rows = {{-1, -1, -1}};
  for (int i = 0; i < 3; ++i) {
    // A row without compliance (all its dofs are fixed) cannot move: it carries no force.
    if (!(block.axes >> i & 1u) || own.m[i][i] <= 0) continue;
    if (!std::isfinite(own.m[i][i])) return false;
    const std::int32_t row = rows.at[i] = take_row();
    scale_[row] = 1 / std::sqrt(own.m[i][i]);
    reaction_[row] = 0;
  }
  for (std::int32_t q = 0; q < set.block_count; ++q) {
    if (q != p && rows_[q].at[0] < -1) continue;
    const Mat3 c = q == p ? own : between(set.blocks[q]);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        const std::int32_t row = rows.at[i], column = rows_[q].at[j];
        if (row < 0 || column < 0) continue;
        // Of its own block the upper half counts.
        const double value = q == p && j < i ? c.m[j][i] : c.m[i][j];
        if (!std::isfinite(value)) return false;
        entry(row, column) = entry(column, row) = value;
      }
  }
  return true;
}

// Adds rows of the matrix to the factor.
bool ContactSolver::append_rows(const std::int32_t* rows, std::int32_t count) {
  const std::int32_t size = factor_.size();
  std::copy(rows, rows + count, row_at_ + size);
  for (std::int32_t at = 0; at < size + count; ++at) {
    const std::int32_t row = row_at_[at];
    const double* from = &entry(row, 0);
    double* to = factor_.coming(at);
    for (std::int32_t q = std::max(0, at - size); q < count; ++q) to[q] = scale_[row] * scale_[rows[q]] * from[rows[q]];
    if (at >= size) to[at - size] = 1 + kShift;
  }
  // Rounding of the stored tensors may leave a pivot below what the shift guarantees. Where it takes more than the shift makes up
  // for, as of hundreds of contacts in half precision, A is not definite and no force is bounded.
  double* const raised = work_;
  if (!factor_.append(count, 0.5 * kShift, raised)) return false;
  for (std::int32_t q = 0; q < count; ++q) {
    const std::int32_t row = rows[q];
    if (raised[q] > kShift) return false;
    shift_[row] = kShift + raised[q];
    soft_[row] = shift_[row] / (scale_[row] * scale_[row]);
  }
  return true;
}

void ContactSolver::keep(const ContactSet& set) {
  std::copy(set.entries, set.entries + set.entry_count, kept_entry_);
  std::copy(set.blocks, set.blocks + set.block_count, kept_block_);
  std::copy(rows_, rows_ + set.block_count, kept_rows_);
  kept_blocks_ = set.block_count, kept_entries_ = set.entry_count;
}

bool ContactSolver::update(const Tensors& tensors, const ContactSet& set) {
  if (!nodes_.hold(tensors, set)) return false;
  match(set);
  drop_rows();
  std::int32_t count = 0;
  for (std::int32_t p = 0; p < set.block_count; ++p) {
    if (rows_[p].at[0] >= -1) continue;
    if (!fill_rows(set, p)) return false;
    for (const std::int32_t row : rows_[p].at)
      if (row >= 0) list_[count++] = row;
  }
  if (!append_rows(list_, count)) return false;
  keep(set);
  return true;
}

// ---- solving ---------------------------------------------------------------------------------------------------------

// reaction_ from target_ through the factor, refined.
ContactSolver::Outcome ContactSolver::solve_factored() {
  const std::int32_t rows = factor_.size();
  double *change = work_, *sum = work_ + capacity_;
  for (std::int32_t at = 0; at < rows; ++at) change[at] = scale_[row_at_[at]] * target_[row_at_[at]], sum[at] = 0;
  double part = 1, next = 0;  // of the last change in the sum; of the one to come, as the changes shrink
  for (int solve = 0; solve < kMostSolves; ++solve) {
    factor_.solve(change);
    for (std::int32_t at = 0; at < rows; ++at) sum[at] += change[at];
    const double most = largest(sum, rows), before = part;
    part = most > 0 ? largest(change, rows) / most : 0;
    next = before > 0 ? part * part / before : 0;
    // What A leaves of the target is the shift times the last change.
    for (std::int32_t at = 0; at < rows; ++at) change[at] *= shift_[row_at_[at]];
    if (solve > 0 && next <= kMet) break;
  }
  for (std::int32_t at = 0; at < rows; ++at) reaction_[row_at_[at]] = scale_[row_at_[at]] * sum[at];
  return next > kConflict ? Outcome::regularised : Outcome::solved;
}

// Of the matrix, not of the factor, in which rows that come and go leave no more than rounding, however many
// (StabilityContacts.OneOfManyMovesEachTick): it need not be made anew.
void ContactSolver::measure_residual() {
  residual_ = {};
  for (std::int32_t at = 0; at < factor_.size(); ++at) {
    const std::int32_t row = row_at_[at];
    const double missed = target_[row] - dot_rows(rows_end_, &entry(row, 0), reaction_);
    residual_.displacement = std::max(residual_.displacement, std::fabs(missed));
    residual_.force = std::max(residual_.force, std::fabs(missed) * scale_[row] * scale_[row]);
  }
}

ContactSystem ContactSolver::system(const ContactBlock* blocks, std::int32_t count) const {
  ContactSystem system;
  system.matrix = matrix_, system.stride = stride_, system.rows_end = rows_end_;
  system.soft = soft_, system.target = target_;
  system.blocks = blocks, system.rows = rows_, system.block_count = count;
  return system;
}

void ContactSolver::solve_laws(const ContactSystem& laws) {
  std::copy(last_, last_ + rows_end_, reaction_);
  double most = 0;
  for (std::int32_t row = 0; row < rows_end_; ++row)
    if (scale_[row] != 0) most = std::max(most, std::fabs(target_[row]));
  const std::int64_t work = std::int64_t{rows_end_} * rows_end_;
  const auto sweeps =
      static_cast<std::int32_t>(std::clamp(kMostWork / work, std::int64_t{kFewestSweeps}, std::int64_t{kMostSweeps}));
  const std::int32_t done = sweep_contacts(laws, reaction_, kSettled * most, sweeps);
  residual_ = law_residual(laws, reaction_);
  residual_.sweeps = done;
}

Vec3 ContactSolver::reaction(std::int32_t p) const {
  Vec3 r;
  for (int i = 0; i < 3; ++i)
    if (const std::int32_t row = rows_[p].at[i]; row >= 0) r[i] = reaction_[row];
  return r;
}

// What the rows carry, handed to the entries of their blocks: force[e] is added to.
void ContactSolver::spread_reactions(const ContactBlock* blocks, const Rows* rows, std::int32_t count,
                                     const ContactEntry* entries, const double* reaction, Vec3* force) {
  for (std::int32_t p = 0; p < count; ++p) {
    const ContactBlock& block = blocks[p];
    Vec3 sum;
    for (int i = 0; i < 3; ++i) {
      const std::int32_t row = rows[p].at[i];
      if (row < 0) continue;
      if (!block.framed)
        sum[i] = reaction[row];
      else
        sum += reaction[row] * Vec3{block.frame.m[i][0], block.frame.m[i][1], block.frame.m[i][2]};
    }
    for (std::int32_t e = block.first_entry; e < block.first_entry + block.entry_count; ++e)
      force[e] += entries[e].weight * sum;
  }
}

int ContactSolver::rows_of(std::int32_t tool, std::int32_t point, std::int32_t row[kMostRowsOfAContact]) const {
  int count = 0;
  for (std::int32_t p = 0; p < kept_blocks_; ++p) {
    if (kept_block_[p].tool != tool || kept_block_[p].point != point) continue;
    for (const std::int32_t at : kept_rows_[p].at)
      if (at >= 0 && count < kMostRowsOfAContact) row[count++] = at;
  }
  return count;
}

// With Z the columns of the inverse for `gone` rows: r - Z (Z_gone)^-1 r_gone is zero on those and keeps the others' targets.
bool ContactSolver::take_out(const std::int32_t* gone, int count, double* left) {
  const std::int32_t size = factor_.size();
  std::int32_t position[kMostRowsOfAContact] = {};
  double* z[kMostRowsOfAContact];  // [size] each, by position
  for (int k = 0; k < count; ++k) {
    z[k] = removal_ + static_cast<std::size_t>(k) * static_cast<std::size_t>(capacity_);
    for (std::int32_t at = 0; at < size; ++at) {
      z[k][at] = row_at_[at] == gone[k] ? scale_[gone[k]] : 0;
      if (row_at_[at] == gone[k]) position[k] = at;
    }
    factor_.solve(z[k]);
    for (std::int32_t at = 0; at < size; ++at) z[k][at] *= scale_[row_at_[at]];
  }
  double system[kMostRowsOfAContact][kMostRowsOfAContact + 1];
  for (int i = 0; i < count; ++i) {
    for (int k = 0; k < count; ++k) system[i][k] = z[k][position[i]];
    system[i][count] = reaction_[gone[i]];
  }
  // Positive definite: Gauss-Jordan without pivots.
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

bool ContactSolver::without(std::int32_t tool, std::int32_t point, Vec3* modified) {
  std::int32_t own[kMostRowsOfAContact];
  const int count = rows_of(tool, point, own);
  if (count == 0) return false;
  double* const left = work_;
  std::copy(reaction_, reaction_ + rows_end_, left);
  if (residual_.sweeps == 0 && !take_out(own, count, left)) return false;
  for (int k = 0; k < count; ++k) left[own[k]] = 0;
  hold_others_to_laws(tool, point, left);
  std::fill(modified, modified + kept_entries_, Vec3{});
  spread_reactions(kept_block_, kept_rows_, kept_blocks_, kept_entry_, left, modified);
  for (std::int32_t e = 0; e < kept_entries_; ++e) modified[e] = nodes_.self(nodes_.slot_of_entry(e)) * modified[e];
  return true;
}

void ContactSolver::hold_others_to_laws(std::int32_t tool, std::int32_t point, double* left) {
  // A block without rows takes no part.
  for (std::int32_t p = 0; p < kept_blocks_; ++p)
    if (kept_block_[p].tool == tool && kept_block_[p].point == point) rows_[p] = {{-1, -1, -1}};
  const ContactSystem others = system(kept_block_, kept_blocks_);
  if (residual_.sweeps > 0 || !obeys_laws(others, left)) sweep_contacts(others, left, 0, kFewestSweeps);
  std::copy(kept_rows_, kept_rows_ + kept_blocks_, rows_);
}

ContactSolver::Outcome ContactSolver::solve(const Tensors& tensors, const ContactSet& set, Vec3* force,
                                            Vec3* modified) {
  for (std::int32_t e = 0; e < set.entry_count; ++e) force[e] = modified[e] = Vec3{};
  residual_ = {};
  const auto fail = [&] {
    forget();
    for (std::int32_t e = 0; e < set.entry_count; ++e) force[e] = modified[e] = Vec3{};
    residual_ = {};
    return Outcome::unsolved;
  };
  if (!update(tensors, set)) return fail();
  for (std::int32_t p = 0; p < set.block_count; ++p)
    for (int i = 0; i < 3; ++i)
      if (const std::int32_t row = rows_[p].at[i]; row >= 0) target_[row] = set.target[p][i];
  std::copy(reaction_, reaction_ + rows_end_, last_);
  Outcome outcome = solve_factored();
  measure_residual();
  if (const ContactSystem laws = system(set.blocks, set.block_count); !obeys_laws(laws, reaction_)) {
    solve_laws(laws);
    outcome = Outcome::solved;
  }

  spread_reactions(set.blocks, rows_, set.block_count, set.entries, reaction_, force);
  bool finite = std::isfinite(residual_.displacement) && std::isfinite(residual_.force);
  for (std::int32_t e = 0; e < set.entry_count; ++e) {
    modified[e] = nodes_.self(nodes_.slot_of_entry(e)) * force[e];
    finite = finite && is_finite(force[e]) && is_finite(modified[e]);
  }
  return finite ? outcome : fail();
}

}  // namespace palpate
