#include "runtime/contact/contact_solver.h"

#include <algorithm>
#include <cmath>

#include "runtime/dense/dense_rows.h"

namespace palpate {
namespace {

// Refinement ends where the next one would change the scaled forces by less than this share.
constexpr double kRefined = 1e-9;
// The targets conflict where one more refinement would still change the scaled forces by more than this share.
constexpr double kConflict = 1e-6;
// LawSolver ends where it misses the laws by this share of the largest target. Its solution is refined where refining would
// move it by more.
constexpr double kSettled = 1e-10;
// Of a friction or a reaction that is at its limit.
constexpr double kRounding = 1e-9;

// Without a branch for each number.
bool are_equal(const Mat3& a, const Mat3& b) {
  bool differ = false;
  for (int i = 0; i < 9; ++i) differ |= (&a.m[0][0])[i] != (&b.m[0][0])[i];
  return !differ;
}

bool are_equal(const ContactDisc& a, const ContactDisc& b) {
  const auto differ = [](Vec3 c, Vec3 d) { return (c.x != d.x) | (c.y != d.y) | (c.z != d.z); };
  if (a.radius == 0 && b.radius == 0) return true;
  return !((a.radius != b.radius) | (a.wide[0] != b.wide[0]) | (a.wide[1] != b.wide[1]) | differ(a.place, b.place) |
           differ(a.outward, b.outward) | differ(a.gradient, b.gradient) | differ(a.normal_root, b.normal_root)) &&
         are_equal(a.tangent_root, b.tangent_root);
}

bool is_of_the_same(const ContactConstraint& a, const ContactConstraint& b) {
  return a.tool == b.tool && a.point == b.point && a.part == b.part;
}

bool joins(const ContactConstraints& set) {
  return std::any_of(set.constraints, set.constraints + set.constraint_count,
                     [](const ContactConstraint& constraint) { return constraint.joined; });
}

bool comes_before(const ContactConstraint& a, const ContactConstraint& b) {
  if (a.tool != b.tool) return a.tool < b.tool;
  if (a.point != b.point) return a.point < b.point;
  return a.part < b.part;
}

}  // namespace

bool ContactSolver::create(SceneMemory& memory, const Limits& limits) {
  capacity_ = 3 * limits.constraints, most_operations_ = limits.operations;
  const std::size_t rows = static_cast<std::size_t>(capacity_), nodes = static_cast<std::size_t>(limits.nodes),
                    constraints = static_cast<std::size_t>(limits.constraints);
  stride_ = odd_lines(rows);
  matrix_ = memory.array<double>(rows * stride_);
  scale_ = memory.array<double>(rows);
  shift_ = memory.array<double>(rows);
  soft_ = memory.array<double>(rows);
  last_ = memory.array<double>(rows);
  target_ = memory.array<double>(rows);
  reaction_ = memory.array<double>(rows);
  work_ = memory.array<double>(3 * rows);
  if (limits.predicts) {
    removal_ = memory.array<double>(kMostRowsOfAContact * rows);
    without_ = memory.array<double>(rows);
    without_ended_ = memory.array<double>(rows);
    between_ = memory.array<double>(rows * stride_);
  }
  ended_ = memory.array<bool>(constraints);
  row_at_ = memory.array<std::int32_t>(rows);
  list_ = memory.array<std::int32_t>(rows);
  leaving_ = memory.array<std::int32_t>(rows);
  spread_ = memory.array<Mat3>(nodes);
  rows_ = memory.array<Rows>(constraints);
  is_kept_ = memory.array<bool>(constraints);
  stayed_ = memory.array<bool>(constraints);
  carried_ = memory.array<Vec3>(constraints);
  kept_rows_ = memory.array<Rows>(constraints);
  kept_node_ = memory.array<ContactNode>(nodes);
  kept_constraint_ = memory.array<ContactConstraint>(constraints);
  doubt_ = memory.array<Doubt>(2 * constraints);
  most_ = memory.array<double>(rows);
  coarse_ = memory.array<double>(rows);
  softened_ = memory.array<double>(rows);
  met_ = memory.array<double>(rows);
  if (!laws_.create(memory, capacity_, limits.nodes) || !shared_.create(memory, limits.nodes)) return false;
  memory.keep(rows_end_);
  memory.keep(free_row_);
  memory.keep(kept_constraints_);
  memory.keep(kept_nodes_);
  memory.keep(kept_discs_);
  memory.keep(used_rows_);
  memory.keep(gives_way_);
  memory.keep(decided_);
  memory.keep(residual_);
  memory.keep(energy_);
  memory.keep(most_target_);
  memory.keep(effort_);
  memory.keep_array(matrix_, rows * stride_, rows_end_, stride_);
  for (double** array : {&scale_, &shift_, &soft_, &target_, &reaction_}) memory.keep_array(*array, rows, rows_end_);
  memory.keep_array(row_at_, rows);
  memory.keep_array(kept_rows_, constraints, kept_constraints_);
  memory.keep_array(kept_constraint_, constraints, kept_constraints_);
  memory.keep_array(kept_node_, nodes, kept_nodes_);
  return compliance_.create(memory, limits.nodes, limits.columns, limits.columns_of_surface) &&
         factor_.create(memory, capacity_) && soft_factor_.create(memory, capacity_) && !memory.failed();
}

// The compliance between nodes is read again: it has the same bits whenever a node came under contact.
void ContactSolver::restored(const Tensors& tensors) {
  ContactConstraints held;
  held.nodes = kept_node_, held.node_count = kept_nodes_;
  compliance_.forget();
  compliance_.hold(tensors, held);
  std::copy(kept_rows_, kept_rows_ + kept_constraints_, rows_);
  set_limits(kept_constraint_, kept_constraints_);
  for (std::int32_t p = 0, row = 0; p < kept_constraints_; ++p) {
    if (!kept_constraint_[p].joined) row = p;
    for (std::int32_t q = 0, column = 0; q <= p; ++q) {
      if (!kept_constraint_[q].joined) column = q;
      Mat3 of_discs = q == p ? Mat3{} : compliance_between(kept_constraint_[p], kept_constraint_[q]);
      if (row == column) add_scaled(of_discs, 1, of_discs);
      remember_between(rows_[row], rows_[column], of_discs, row != p || column != q);
    }
  }
}

void ContactSolver::forget() {
  compliance_.forget();
  factor_.clear();
  soft_factor_.clear();
  std::fill(scale_, scale_ + rows_end_, 0.0);
  rows_end_ = free_row_ = kept_constraints_ = kept_nodes_ = kept_discs_ = used_rows_ = gives_way_ = decided_ = 0;
  energy_ = 0;
  forget_ended();
}

void ContactSolver::forget_ended() {
  if (any_ended_) std::fill(ended_, ended_ + capacity_ / 3, false);
  any_ended_ = false, without_tool_ = without_point_ = -1;
}

// ---- rows that stay, leave and come -------------------------------------------------------------------------------

bool ContactSolver::same(const ContactConstraints& set, const ContactConstraint& now,
                         const ContactConstraint& before) const {
  if (now.node_count != before.node_count || now.axes != before.axes || now.framed != before.framed ||
      now.joined != before.joined)
    return false;
  for (std::int32_t v = 0; v < now.node_count; ++v) {
    const ContactNode &a = set.nodes[now.first_node + v], &b = kept_node_[before.first_node + v];
    if (a.column != b.column || a.weight != b.weight) return false;
  }
  return are_equal(now.local, before.local) && (!now.framed || are_equal(now.frame, before.frame)) &&
         are_equal(now.discs[0], before.discs[0]) && are_equal(now.discs[1], before.discs[1]);
}

// The same of constraint p with those that share its rows, and kept constraint k.
bool ContactSolver::same_with_joined(const ContactConstraints& set, std::int32_t p, std::int32_t k) const {
  const std::int32_t count = end_of_joined(set.constraints, set.constraint_count, p) - p;
  if (end_of_joined(kept_constraint_, kept_constraints_, k) - k != count) return false;
  for (std::int32_t part = 0; part < count; ++part) {
    const ContactConstraint &now = set.constraints[p + part], &before = kept_constraint_[k + part];
    if (ended_[k + part] || !is_of_the_same(now, before) || !same(set, now, before)) return false;
  }
  return true;
}

const ContactConstraint* ContactSolver::kept(const ContactConstraint& like, std::int32_t number) const {
  if (number < kept_constraints_ && is_of_the_same(kept_constraint_[number], like)) return kept_constraint_ + number;
  const ContactConstraint *const first = kept_constraint_, *const end = first + kept_constraints_;
  const ContactConstraint* const at = std::lower_bound(first, end, like, comes_before);
  return at != end && is_of_the_same(*at, like) ? at : nullptr;
}

bool ContactSolver::holds(const ContactConstraints& set, std::int32_t p) const {
  const ContactConstraint* const before = kept(set.constraints[p], p);
  return before && !ended_[before - kept_constraint_] && same(set, set.constraints[p], *before);
}

// Finds which constraints were there in the last step. Both lists ascend by tool, point and part, so one walk through the two
// is enough. leaving_ gets the rows of constraints that are gone; a constraint that needs new rows is marked by first row -2.
void ContactSolver::match(const ContactConstraints& set) {
  leaving_count_ = changed_contacts_ = joining_rows_ = 0;
  const ContactConstraint* counted = nullptr;
  const auto count = [&](const ContactConstraint& of) {
    changed_contacts_ += !counted || of.tool != counted->tool || of.point != counted->point;
    counted = &of;
  };
  const auto leave = [&](std::int32_t k) {
    count(kept_constraint_[k]);
    for (const std::int32_t row : kept_rows_[k].at)
      if (row >= 0) leaving_[leaving_count_++] = row;
  };
  std::int32_t k = 0;
  for (std::int32_t p = 0; p < set.constraint_count; ++p) {
    const ContactConstraint& constraint = set.constraints[p];
    while (k < kept_constraints_ && comes_before(kept_constraint_[k], constraint)) leave(k++);
    const bool known = k < kept_constraints_ && is_of_the_same(constraint, kept_constraint_[k]);
    is_kept_[p] = constraint.joined ? is_kept_[p - 1] : known && same_with_joined(set, p, k);
    if (is_kept_[p]) {
      rows_[p] = kept_rows_[k];
    } else {
      carried_[p] = Vec3{};
      for (int i = 0; known && i < 3; ++i)
        if (const std::int32_t row = kept_rows_[k].at[i]; row >= 0) carried_[p][i] = reaction_[row];
      rows_[p] = {{-2, -1, -1}};
      if (known) leave(k);
      count(constraint);
      for (int axis = 0; axis < 3; ++axis) joining_rows_ += static_cast<std::int32_t>(constraint.axes >> axis & 1u);
    }
    if (known) ++k;
  }
  while (k < kept_constraints_) leave(k++);
  if (!again_) std::copy_n(is_kept_, set.constraint_count, stayed_);
}

// Rows without a scale leave the order of the factor. Returns their number, and their positions in list_.
std::int32_t ContactSolver::close_up() {
  std::int32_t stay = 0, positions = 0;
  for (std::int32_t at = 0; at < used_rows_; ++at) {
    const std::int32_t row = row_at_[at];
    if (scale_[row] == 0)
      list_[positions++] = at;
    else
      row_at_[stay++] = row;
  }
  used_rows_ = stay;
  return positions;
}

void ContactSolver::drop_rows() {
  if (leaving_count_ == 0) return;
  free_row_ = 0;
  for (std::int32_t l = 0; l < leaving_count_; ++l) scale_[leaving_[l]] = 0, reaction_[leaving_[l]] = 0;
  const bool has_factor = factored();
  const std::int32_t positions = close_up();
  while (rows_end_ > 0 && scale_[rows_end_ - 1] == 0) --rows_end_;
  if (!has_factor) return;
  // Where more than a sixth of the rows leave, a new factor costs less than removing them.
  if (6 * positions > factor_.size()) {
    const std::int32_t stay = used_rows_;
    factor_.clear();
    std::copy(row_at_, row_at_ + stay, list_);
    used_rows_ = 0;
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

// H C: displacement of the constraint per unit force on each contact node, by the node's slot.
const Mat3* ContactSolver::spread_of(const ContactConstraints& set, const ContactConstraint& constraint) {
  const std::int32_t first = constraint.first_node;
  if (constraint.node_count == 1 && set.nodes[first].weight == 1)
    return compliance_.at(compliance_.slot_of_contact_node(first));
  std::fill(spread_, spread_ + compliance_.slots(), Mat3{});
  for (std::int32_t e = first; e < first + constraint.node_count; ++e) {
    // Of slots that are not in use nothing is read.
    const Mat3* c = compliance_.at(compliance_.slot_of_contact_node(e));
    add_rows(9 * compliance_.slots(), set.nodes[e].weight, &c->m[0][0], &spread_->m[0][0]);
  }
  return spread_;
}

void ContactSolver::remember_between(const Rows& rows, const Rows& columns, const Mat3& between, bool add) {
  for (int i = 0; i < 3 && between_; ++i)
    for (int j = 0; j < 3; ++j) {
      if (rows.at[i] < 0 || columns.at[j] < 0) continue;
      const auto row = static_cast<std::size_t>(rows.at[i]), column = static_cast<std::size_t>(columns.at[j]);
      const double before = add ? between_[row * stride_ + column] : 0;
      between_[row * stride_ + column] = between_[column * stride_ + row] = before + between.m[i][j];
    }
}

// H W H^T of two constraints; spread: of the first one.
Mat3 ContactSolver::between(const ContactConstraints& set, const Mat3* spread, const ContactConstraint& one,
                            const ContactConstraint& other) const {
  const ContactNode* held = set.nodes + other.first_node;
  Mat3 sum = spread[compliance_.slot_of_contact_node(other.first_node)];
  if (other.node_count > 1 || held->weight != 1) {
    sum = Mat3{};
    for (std::int32_t w = 0; w < other.node_count; ++w)
      add_scaled(sum, held[w].weight, spread[compliance_.slot_of_contact_node(other.first_node + w)]);
  }
  if (one.framed) sum = one.frame * sum;
  return other.framed ? times_transposed(sum, other.frame) : sum;
}

// own: its own block. A row without compliance cannot move (its nodes are fixed along it): it gets no force. leads: constraints share the
// first row, and bound_joined() tells.
void ContactSolver::take_rows(const ContactConstraint& constraint, const Mat3& own, bool leads, Rows* rows) {
  *rows = {{-1, -1, -1}};
  for (int i = 0; i < 3; ++i) {
    if (!(constraint.axes >> i & 1u) || (own.m[i][i] <= 0 && !leads)) continue;
    rows->at[i] = take_row();
    scale_[rows->at[i]] = leads ? 1 : 1 / std::sqrt(own.m[i][i]);
  }
}

// The row that several constraints share, when all of them are in it.
void ContactSolver::bound_joined(Rows* rows) {
  const std::int32_t row = rows->at[0];
  if (row < 0) return;
  double& own = entry(row, row);
  own = std::max(own, kLeastOfJoined * most_joined_);
  scale_[row] = own > 0 ? 1 / std::sqrt(own) : 0;
  if (!(own > 0)) rows->at[0] = -1, free_row_ = std::min(free_row_, row);
}

// Fills the rows of constraint p and their columns in H W H^T. False where a number is not finite.
bool ContactSolver::fill_rows(const ContactConstraints& set, std::int32_t p) {
  const ContactConstraint& constraint = set.constraints[p];
  const Mat3* const spread = spread_of(set, constraint);
  Mat3 own = between(set, spread, constraint, constraint);
  add_scaled(own, 1, constraint.local);
  std::int32_t first = p;
  while (set.constraints[first].joined) --first;
  const bool last = end_of_joined(set.constraints, set.constraint_count, p) == p + 1;
  if (first == p)
    take_rows(constraint, own, !last, &rows_[p]);
  else
    rows_[p] = {{-1, -1, -1}};
  most_joined_ = std::max(first == p ? 0 : most_joined_, own.m[0][0]);
  const Rows& rows = rows_[first];
  for (std::int32_t q = 0, leads = 0; q < set.constraint_count; ++q) {
    const ContactConstraint& other = set.constraints[q];
    if (!other.joined) leads = q;
    const Rows& columns = rows_[leads];
    if (columns.at[0] < -1) continue;
    Mat3 c = q == p ? own : between(set, spread, constraint, other), of_discs;
    if (q != p && has_disc(constraint) && has_disc(other)) {
      of_discs = compliance_between(constraint, other);
      add_scaled(c, 1, of_discs);
    }
    const bool add = constraint.joined || other.joined;
    remember_between(rows, columns, of_discs, add);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        const std::int32_t row = rows.at[i], column = columns.at[j];
        if (row < 0 || column < 0) continue;
        // Within one constraint both halves take the upper half's numbers.
        double value = q == p && j < i ? c.m[j][i] : c.m[i][j];
        if (add) value += entry(row, column);
        if (!std::isfinite(value)) return false;
        entry(row, column) = entry(column, row) = value;
      }
  }
  if (last && first != p) bound_joined(&rows_[first]);
  return true;
}

// Writes A + shift I to where the factor takes its next `count` rows. order: the rows of all positions.
void ContactSolver::write_scaled(const std::int32_t* order, const std::int32_t* rows, std::int32_t count, double shift,
                                 UpdatedCholesky* factor) {
  const std::int32_t size = factor->size();
  for (std::int32_t at = 0; at < size + count; ++at) {
    const std::int32_t row = order[at];
    const double* from = &entry(row, 0);
    double* to = factor->coming(at);
    for (std::int32_t q = std::max(0, at - size); q < count; ++q) to[q] = scale_[row] * scale_[rows[q]] * from[rows[q]];
    if (at >= size) to[at - size] = 1 + shift;
  }
}

// Adds rows of the matrix to the factor. False where the system is not definite.
bool ContactSolver::append_rows(const std::int32_t* rows, std::int32_t count) {
  const bool has_factor = factored();
  std::copy(rows, rows + count, row_at_ + used_rows_);
  used_rows_ += count;
  for (std::int32_t q = 0; q < count && !has_factor; ++q) {
    const std::int32_t row = rows[q];
    shift_[row] = kShift, soft_[row] = kShift / (scale_[row] * scale_[row]);
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
    soft_[row] = shift_[row] / (scale_[row] * scale_[row]);
  }
  return true;
}

void ContactSolver::keep(const ContactConstraints& set) {
  std::copy(set.nodes, set.nodes + set.node_count, kept_node_);
  std::copy(set.constraints, set.constraints + set.constraint_count, kept_constraint_);
  std::copy(rows_, rows_ + set.constraint_count, kept_rows_);
  kept_constraints_ = set.constraint_count, kept_nodes_ = set.node_count;
  kept_discs_ = static_cast<std::int32_t>(std::count_if(
      set.constraints, set.constraints + set.constraint_count,
      [](const ContactConstraint& constraint) { return has_disc(constraint) && !is_gradient(constraint.discs[0]); }));
  forget_ended();
}

bool ContactSolver::update(const Tensors& tensors, const ContactConstraints& set, StepWork* work) {
  if (!compliance_.hold(tensors, set)) return false;
  match(set);
  const auto is_new = [](const Rows& rows) { return rows.at[0] < -1; };
  if (changed_contacts_ > 0) make_room_for_changes(work);
  drop_rows();
  std::int32_t count = 0, first = 0;
  for (std::int32_t p = 0; p < set.constraint_count; ++p) {
    if (!is_new(rows_[p])) continue;
    if (!fill_rows(set, p)) return false;
    if (!set.constraints[p].joined) first = p;
    if (end_of_joined(set.constraints, set.constraint_count, p) > p + 1) continue;
    for (int i = 0; i < 3; ++i)
      if (const std::int32_t row = rows_[first].at[i]; row >= 0)
        list_[count++] = row, reaction_[row] = carried_[first][i];
  }
  if (leaving_count_ > 0 || count > 0) soft_factor_.clear();
  if (!append_rows(list_, count)) return false;
  keep(set);
  return true;
}

void ContactSolver::leave_factor() {
  if (used_rows_ > 0) factor_.clear();
}

// Contacts that go without notice, as with a tool that is not sent any more, are not counted yet.
void ContactSolver::make_room_for_changes(StepWork* work) {
  const Operations paid = work->paid_changes(), unpaid = changed_contacts_ - paid;
  if (factored() && !gives_way_ && affords_factor(used_rows_ - leaving_count_ + joining_rows_)) {
    const Operations cost = unpaid > 0 ? upkeep_of(rows_end_, unpaid, 0) : 0;
    if (cost <= work->first_change_left(0)) return work->add(cost);
  }
  leave_factor();
}

// Where there is room for it, and it is likely to serve. False where the system is not definite.
bool ContactSolver::factor_again(StepWork* work) {
  const Operations cost = squared_rows() * rows_end_ / 6 / kDense;
  if (factored() || gives_way_ || cost + operations_to_solve_for(rows_end_, kept_constraints_) > work->left())
    return true;
  work->add(cost);
  const std::int32_t rows = used_rows_;
  std::copy(row_at_, row_at_ + rows, list_);
  used_rows_ = 0;
  return append_rows(list_, rows);
}

// Whether laws act otherwise than by holding: a contact that released, slipped or came to its limit.
bool ContactSolver::contacts_give_way(const ContactSystem& laws) const {
  for (std::int32_t p = 0; p < laws.constraint_count; ++p) {
    const ContactConstraint& constraint = laws.constraints[p];
    if (!may_give_way(constraint)) continue;
    const Vec3 r = reaction(p);
    if (constraint.limit > 0 && std::fabs(r.x) >= constraint.limit * (1 - kRounding)) return true;
    if (constraint.law != ContactLaw::sticking && !(r.x > 0)) return true;
    if (constraint.law == ContactLaw::coulomb && length({0, r.y, r.z}) >= constraint.friction * r.x * (1 - kRounding))
      return true;
    for (const std::int32_t row : rows_[p].at)
      if (row >= 0 && std::fabs(reaction_[row]) >= most_[row] * (1 - kRounding)) return true;
  }
  return false;
}

// ---- solving ---------------------------------------------------------------------------------------------------------

// reaction: [rows_end] N, from target_ by a factor of A with something on its diagonal, and by iterative refinement. shift(at): what
// stands on the diagonal. Returns by how much another refinement would change the scaled reactions, a share of them.
template <class Shift>
double ContactSolver::refine(const UpdatedCholesky& factor, Shift shift, int most_solves, double* reaction) {
  const std::int32_t rows = factor.size();
  double *change = work_, *sum = work_ + capacity_;
  for (std::int32_t at = 0; at < rows; ++at) change[at] = scale_[row_at_[at]] * target_[row_at_[at]], sum[at] = 0;
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
    const double before = part;
    part = most > 0 ? changed / most : 0;
    next = before > 0 ? part * part / before : 0;
    if (solve > 0 && next <= kRefined) break;
  }
  for (std::int32_t at = 0; at < rows; ++at) reaction[row_at_[at]] = scale_[row_at_[at]] * sum[at];
  return next;
}

ContactSolver::Outcome ContactSolver::solve_factored() {
  const double next = refine(
      factor_, [&](std::int32_t at) { return shift_[row_at_[at]]; }, kMostSolves, reaction_);
  return next > kConflict ? Outcome::regularised : Outcome::solved;
}

void ContactSolver::take_targets(const ContactConstraints& set) {
  most_target_ = 0;
  for (std::int32_t p = 0; p < set.constraint_count; ++p) {
    const Vec3 target = target_of_rows(set, p);
    for (int i = 0; i < 3; ++i)
      if (const std::int32_t row = rows_[p].at[i]; row >= 0) {
        target_[row] = target[i];
        most_target_ = std::max(most_target_, std::fabs(target_[row]));
      }
  }
}

void ContactSolver::set_limits(const ContactConstraint* constraints, std::int32_t count) {
  std::fill(most_, most_ + rows_end_, INFINITY);
  if (std::none_of(constraints, constraints + count, may_give_way)) return;
  for (std::int32_t p = 0; p < count; ++p) {
    if (!may_give_way(constraints[p])) continue;
    for (const std::int32_t row : rows_[p].at)
      if (row >= 0) most_[row] = kMostForce * most_target_ * scale_[row] * scale_[row];
  }
}

Vec3 ContactSolver::displacement(const ContactConstraints& set, const Vec3* force, std::int32_t e) const {
  const Mat3* c = compliance_.at(compliance_.slot_of_contact_node(e));
  Vec3 u;
  for (std::int32_t b = 0; b < set.node_count; ++b) u += c[compliance_.slot_of_contact_node(b)] * force[b];
  return u;
}

// The forces and the displacements of the nodes under the reactions. False where a number is not finite.
bool ContactSolver::write_forces(const ContactConstraints& set, Vec3* force, Vec3* modified) const {
  std::fill(force, force + set.node_count, Vec3{});
  spread_reactions(set.constraints, rows_, set.constraint_count, set.nodes, reaction_, force);
  bool finite = std::isfinite(residual_.displacement) && std::isfinite(residual_.force);
  for (std::int32_t e = 0; e < set.node_count; ++e) {
    modified[e] = compliance_.modified(compliance_.slot_of_contact_node(e), force[e]);
    finite = finite && is_finite(force[e]) && is_finite(modified[e]);
  }
  return finite;
}

// Without contact forces; the next step begins anew.
ContactSolver::Outcome ContactSolver::fail(const ContactConstraints& set, Vec3* force, Vec3* modified) {
  forget();
  for (std::int32_t e = 0; e < set.node_count; ++e) force[e] = modified[e] = Vec3{};
  residual_ = {}, effort_ = {};
  return Outcome::unsolved;
}

Mat3 ContactSolver::compliance_between_nodes(const ContactConstraints& set, std::int32_t p, std::int32_t q) const {
  const ContactConstraint &one = set.constraints[p], &other = set.constraints[q];
  Mat3 sum;
  for (std::int32_t a = one.first_node; a < one.first_node + one.node_count; ++a) {
    const Mat3* c = compliance_.at(compliance_.slot_of_contact_node(a));
    for (std::int32_t b = other.first_node; b < other.first_node + other.node_count; ++b)
      add_scaled(sum, set.nodes[a].weight * set.nodes[b].weight, c[compliance_.slot_of_contact_node(b)]);
  }
  return sum;
}

// Those that laws let go have a reaction that does not grow with their miss. Returns how many there are.
std::int32_t ContactSolver::find_rows_that_hold(const ContactConstraints& set, std::int32_t* rows) const {
  std::int32_t count = 0;
  for (std::int32_t p = 0; p < set.constraint_count; ++p) {
    const ContactConstraint& constraint = set.constraints[p];
    if (constraint.joined) continue;
    const Vec3 r = reaction(p);
    const bool may_release = constraint.law == ContactLaw::unilateral || constraint.law == ContactLaw::coulomb,
               slips = constraint.law == ContactLaw::coulomb &&
                       length({0, r.y, r.z}) >= constraint.friction * r.x * (1 - kRounding),
               at_limit = constraint.limit > 0 && std::fabs(r.x) >= constraint.limit * (1 - kRounding);
    if (may_release && !(r.x > 0)) continue;
    for (int i = 0; i < 3; ++i)
      if (const std::int32_t row = rows_[p].at[i]; row >= 0 && !(i == 0 ? at_limit : slips)) rows[count++] = row;
  }
  return count;
}

void ContactSolver::measure_stiffness(const ContactConstraints& set, const MovedAlike* groups, int count,
                                      Operations kept, StepWork* work, double* stiffness) {
  const int size = 3 * count;
  std::fill(stiffness, stiffness + size * size, 0.0);
  const auto each_row = [&](int c, auto visit) {
    for (const std::int32_t p : groups[c / 3].constraint)
      if (p >= 0 && rows_[p].at[c % 3] >= 0) visit(rows_[p].at[c % 3]);
  };
  const bool known = factored() && !decided_;
  const std::int32_t rows = known ? used_rows_ : find_rows_that_hold(set, list_), *const order =
                                                                                      known ? row_at_ : list_;
  const Operations squared = Operations{rows} * rows,
                   cost = (size * squared + (known ? 0 : squared * rows / 6)) / kDense;
  bool made = cost + kept <= work->left();
  if (made) work->add(cost);
  if (made && !known) {
    soft_factor_.clear();
    write_scaled(order, order, rows, kShift, &soft_factor_);
    made = soft_factor_.append(rows, 0.5 * kShift, work_);
  }
  const UpdatedCholesky& factor = known && !(limited_ && soft_factor_.size() == rows) ? factor_ : soft_factor_;
  double *const unit = work_, *const solved = work_ + capacity_;
  for (int c = 0; c < size; ++c) {
    std::fill(unit, unit + rows_end_, 0.0);
    each_row(c, [&](std::int32_t row) { unit[row] = made ? 1 : scale_[row] * scale_[row]; });
    for (std::int32_t at = 0; at < rows && made; ++at) solved[at] = scale_[order[at]] * unit[order[at]];
    if (made) factor.solve(solved);
    for (std::int32_t at = 0; at < rows && made; ++at) unit[order[at]] = scale_[order[at]] * solved[at];
    for (int r = 0; r < size; ++r)
      if (made || r == c) each_row(r, [&](std::int32_t row) { stiffness[r * size + c] += unit[row]; });
  }
  if (!known) soft_factor_.clear();
}

// m, along the axis along which a contact node moves most; the square of a length of 1e-290 m would be zero. force: [node_count],
// overwritten.
double ContactSolver::largest_displacement(const ContactConstraints& set, Vec3* force) const {
  std::fill(force, force + set.node_count, Vec3{});
  spread_reactions(set.constraints, rows_, set.constraint_count, set.nodes, reaction_, force);
  double most = 0;
  for (std::int32_t e = 0; e < set.node_count; ++e) {
    const Vec3 u = displacement(set, force, e);
    most = std::max({most, std::fabs(u.x), std::fabs(u.y), std::fabs(u.z)});
  }
  return most;
}

// The largest reaction over the force that its row alone would need for the largest target; kMostForce where none exceeds it, as a
// rule: all rows are asked that first, without a branch.
double ContactSolver::largest_share(Limited rows, const double* reaction) const {
  const auto alone = [&](std::int32_t row) { return most_target_ * scale_[row] * scale_[row]; };
  const auto exceeds = [&](std::int32_t row, double share) {
    return (scale_[row] != 0) & (std::fabs(reaction[row]) > share * alone(row));
  };
  bool any = false;
  for (std::int32_t row = 0; row < rows_end_; ++row) any |= exceeds(row, kMostForce);
  double most = kMostForce;
  for (std::int32_t row = 0; row < rows_end_ && any; ++row)
    if (is_limited(rows, row) && exceeds(row, most)) most = std::fabs(reaction[row]) / alone(row);
  return most;
}

// The limit of the reactions, in the same share, where one exceeds it; else 0.
double ContactSolver::limit_of(Limited rows, const ContactConstraints& set, Operations kept, Vec3* force,
                               StepWork* work) const {
  const double share = largest_share(rows, reaction_);
  if (!(share > kMostForce)) return 0;
  const Operations cost = 9 * Operations{set.node_count} * set.node_count / kDense;
  if (cost + kept > work->left()) return kMostForce;
  work->add(cost);
  const double thrown = largest_displacement(set, force) / most_target_,
               most = std::clamp(kMostForceNear / thrown, kMostForce, kMostForceNear);
  return share > most ? most : 0;
}

// The reactions `soft` are brought within the limit, by one factor, and then go as far towards reaction_ as the limit allows.
void ContactSolver::go_within(Limited rows, double most, const double* soft) {
  const std::int32_t size = used_rows_;
  const double within = 1 / std::max(1.0, largest_share(rows, soft) / most);
  double way = 1;
  for (std::int32_t at = 0; at < size; ++at) {
    const std::int32_t row = row_at_[at];
    const double from = within * soft[row], whole = reaction_[row] - from,
                 room = most * most_target_ * scale_[row] * scale_[row] - (whole > 0 ? from : -from);
    if (is_limited(rows, row) && std::fabs(whole) * way > room) way = std::max(0.0, room / std::fabs(whole));
  }
  for (std::int32_t at = 0; at < size; ++at) {
    const std::int32_t row = row_at_[at];
    const double from = within * soft[row];
    reaction_[row] = from + way * (reaction_[row] - from);
  }
}

ContactSolver::Limiting ContactSolver::limit_forces(const ContactConstraints& set, Operations kept, Vec3* force,
                                                    StepWork* work) {
  const double most = limit_of(Limited::all, set, kept, force, work);
  if (most == 0) return Limiting::within;
  const std::int32_t rows = factor_.size();
  const Operations cost = (squared_rows() * rows / 6 + kSoftSolves * squared_rows()) / kDense;
  double* const soft = work_ + 2 * capacity_;
  if (cost + kept > work->left()) {
    if (operations_to_solve_for(rows_end_, set.constraint_count) <= work->left()) return Limiting::no_room;
    std::fill(soft, soft + rows_end_, 0.0);
    go_within(Limited::all, most, soft);
    return Limiting::limited;
  }
  if (soft_factor_.size() != rows) {
    write_scaled(row_at_, row_at_, rows, kSoftShift, &soft_factor_);
    if (!soft_factor_.append(rows, 0.5 * kSoftShift, work_)) return Limiting::limited;  // not finite: solve() says so
  }
  // Counted alike where the factor is kept, so that a restored state defers the same work.
  work->add(cost);
  refine(
      soft_factor_, [](std::int32_t) { return kSoftShift; }, kSoftSolves, soft);
  go_within(Limited::all, most, soft);
  return Limiting::limited;
}

// The same for contacts that do not give way, where laws have decided. A law that is missed only after this conflicts with them.
void ContactSolver::limit_grips(const ContactSystem& laws, const ContactConstraints& set, Vec3* force, StepWork* work) {
  const Operations look = operations_to_look(laws);
  const double most = limit_of(Limited::beside_laws, set, look, force, work);
  if (most == 0) return;
  for (std::int32_t row = 0; row < rows_end_; ++row)
    softened_[row] = scale_[row] != 0 && is_limited(Limited::beside_laws, row)
                         ? kSoftShift / (scale_[row] * scale_[row])
                         : soft_[row];
  ContactSystem soft = laws;
  soft.soft = softened_;
  std::copy(reaction_, reaction_ + rows_end_, met_);
  const LawEffort before = effort_;
  if (2 * look <= work->left())
    solve_laws(soft, kSoftSolves, look, work);
  else
    std::fill(reaction_, reaction_ + rows_end_, 0.0);
  effort_.sweeps += before.sweeps, effort_.newton_steps += before.newton_steps, effort_.operations += before.operations;
  std::swap_ranges(reaction_, reaction_ + rows_end_, met_);
  go_within(Limited::beside_laws, most, met_);
  std::copy(reaction_, reaction_ + rows_end_, coarse_);
  Doubt* const exact = doubt_ + laws.constraint_count;
  std::copy(doubt_, doubt_ + laws.constraint_count, exact);
  measure_laws(laws);
  work->add(look);
  for (std::int32_t p = 0; p < laws.constraint_count; ++p) {
    doubt_[p].conflict = doubt_[p].conflict || exact[p].conflict || (doubt_[p].inexact && !exact[p].inexact);
    doubt_[p].inexact = exact[p].inexact;
  }
}

// The residual of the matrix, not of the factor. It also shows that updating leaves rounding alone in the factor, however often
// rows come and go (StabilityContacts.OneOfManyMovesEachTick), so the factor is never recomputed for accuracy.
void ContactSolver::measure_residual() {
  residual_ = {}, energy_ = 0;
  for (std::int32_t at = 0; at < used_rows_; ++at) {
    const std::int32_t row = row_at_[at];
    const double reached = dot_rows(rows_end_, &entry(row, 0), reaction_), missed = target_[row] - reached;
    energy_ += reaction_[row] * reached;
    residual_.displacement = std::max(residual_.displacement, std::fabs(missed));
    residual_.force = std::max(residual_.force, std::fabs(missed) * scale_[row] * scale_[row]);
  }
}

// Rows that are not in use have a reaction of zero.
double ContactSolver::norm_of(const double* reaction) const {
  double energy = 0;
  for (std::int32_t row = 0; row < rows_end_; ++row)
    if (reaction[row] != 0)
      energy += reaction[row] * dot_rows(rows_end_, matrix_ + static_cast<std::size_t>(row) * stride_, reaction);
  return std::sqrt(std::max(0.0, energy));
}

double ContactSolver::change_norm(const ContactConstraints& set) const {
  if (again_ || set.constraint_count != last_constraints_) return -1;
  double* const change = work_;
  std::fill(change, change + rows_end_, 0.0);
  for (std::int32_t p = 0; p < set.constraint_count; ++p) {
    if (!is_kept_[p]) return -1;
    for (const std::int32_t i : rows_[p].at)
      if (i >= 0) change[i] = reaction_[i] - last_[i];
  }
  return norm_of(change);
}

// m, [rows_end]: what the rows of discs move beyond the mesh by the reactions of other discs.
void ContactSolver::measure_between_discs(const double* reaction, double* moved) const {
  for (std::int32_t row = 0; row < rows_end_; ++row)
    moved[row] = scale_[row] == 0 || !couples()
                     ? 0
                     : dot_rows(rows_end_, between_ + static_cast<std::size_t>(row) * stride_, reaction);
}

// J: what reactions of constraint p do on its local part, which moves no node of the mesh.
double ContactSolver::work_on_local(const ContactConstraints& set, std::int32_t p, const double* reaction) const {
  double work = 0;
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b)
      if (const std::int32_t i = rows_[p].at[a], j = rows_[p].at[b]; i >= 0 && j >= 0)
        work += reaction[i] * set.constraints[p].local.m[a][b] * reaction[j];
  const std::int32_t row = rows_[p].at[0], end = end_of_joined(set.constraints, set.constraint_count, p);
  for (std::int32_t q = p + 1; row >= 0 && q < end; ++q)
    work += reaction[row] * set.constraints[q].local.m[0][0] * reaction[row];
  return work;
}

// The reactions do no more work on the tissue than their targets allow (law_solver.h), and the energy of their sum is no larger than
// the sum of theirs.
ReactionNorms ContactSolver::bound_norms(const ContactConstraints& set, ConstraintNorms* each) {
  constexpr double rounding = 1e-6;
  ReactionNorms norms;
  double *const change = work_, offered = 0, sum = 0;
  for (std::int32_t p = 0; p < set.constraint_count; ++p) {
    each[p] = {};
    each[p].kept = is_kept_[p] && !again_;
    double own = 0, own_change = 0;
    for (const std::int32_t i : rows_[p].at)
      if (i >= 0) offered += (1 + rounding) * reaction_[i] * target_[i], change[i] = reaction_[i] - last_[i];
    for (const std::int32_t i : rows_[p].at)
      for (const std::int32_t j : rows_[p].at) {
        if (i < 0 || j < 0) continue;
        own += reaction_[i] * entry(i, j) * reaction_[j];
        own_change += change[i] * entry(i, j) * change[j];
      }
    const double local = work_on_local(set, p, reaction_);
    if (!couples()) offered -= local;  // else what discs share may be less than the sum of their parts, but not below 0
    own -= local, own_change -= work_on_local(set, p, change);
    each[p].own = std::sqrt(std::max(0.0, own));
    if (each[p].kept) each[p].own_change = std::sqrt(std::max(0.0, own_change));
    sum += each[p].own;
  }
  norms.whole = std::min(std::sqrt(std::max(0.0, offered)), sum);
  norms.change_of_kept = INFINITY;
  norms.operations = 30 * Operations{set.constraint_count} / kDense;
  return norms;
}

ReactionNorms ContactSolver::measure_norms(const ContactConstraints& set, ConstraintNorms* each) {
  ReactionNorms norms;
  double energy = 0, local_change = 0, *const change = work_, *const between = work_ + capacity_;
  std::fill(change, change + rows_end_, 0.0);
  measure_between_discs(reaction_, between);
  for (std::int32_t p = 0; p < set.constraint_count; ++p) {
    each[p] = {};
    each[p].kept = is_kept_[p] && !again_;
    double own = 0, own_change = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const std::int32_t i = rows_[p].at[axis];
      if (i < 0) continue;
      if (each[p].kept) change[i] = reaction_[i] - last_[i];
      each[p].displacement[axis] = dot_rows(rows_end_, &entry(i, 0), reaction_);
      each[p].work += reaction_[i] * (each[p].displacement[axis] - between[i]);
      each[p].displacement[axis] -= between[i];
      for (int other = 0; other < 3; ++other)
        if (const std::int32_t j = rows_[p].at[other]; j >= 0)
          each[p].displacement[axis] -= set.constraints[p].local.m[axis][other] * reaction_[j];
    }
    for (const std::int32_t i : rows_[p].at)
      for (const std::int32_t j : rows_[p].at) {
        if (i < 0 || j < 0) continue;
        own += reaction_[i] * entry(i, j) * reaction_[j];
        own_change += change[i] * entry(i, j) * change[j];
      }
    const double local = work_on_local(set, p, reaction_);
    const double changed = work_on_local(set, p, change);
    each[p].work -= local, local_change += changed;
    each[p].own = std::sqrt(std::max(0.0, own - local));
    each[p].own_change = std::sqrt(std::max(0.0, own_change - changed));
    energy += each[p].work;
  }
  norms.whole = std::sqrt(std::max(0.0, energy));
  measure_between_discs(change, between);
  for (std::int32_t i = 0; i < rows_end_; ++i) local_change += change[i] * between[i];
  const double whole_change = norm_of(change);
  norms.change_of_kept = std::sqrt(std::max(0.0, whole_change * whole_change - local_change));
  norms.operations = operations_to_measure();
  return norms;
}

ContactSystem ContactSolver::system(const ContactConstraint* constraints, std::int32_t count) const {
  ContactSystem system;
  system.matrix = matrix_, system.stride = stride_, system.rows_end = rows_end_;
  system.soft = soft_, system.target = target_, system.most = most_;
  system.constraints = constraints, system.rows = rows_, system.constraint_count = count;
  return system;
}

Operations ContactSolver::operations_to_look(const ContactSystem& laws) {
  return LawSolver::operations_to_look(laws) / kDense + 1;
}

// From the reactions of the last step. kept: operations that come after it.
void ContactSolver::solve_laws(const ContactSystem& laws, int most_solves, Operations kept, StepWork* work) {
  const double most = most_target_;
  std::copy(last_, last_ + rows_end_, reaction_);
  laws_.solve_without_shift(laws, kSettled * most, kMet * most, most_solves,
                            std::max<Operations>(0, work->left() - kept) * kDense, reaction_, coarse_, last_energy_);
  effort_ = laws_.effort();
  work->add(effort_.operations / kDense);
}

// The residual counts what the laws miss without the shift and the limits. A law that the shifted and limited system of the last
// refinement misses too is not solved; one that it does not miss conflicts.
void ContactSolver::measure_laws(const ContactSystem& laws) {
  const double tolerance = kMet * most_target_ + kLeastMiss;
  double *const ahead = work_, *const shifted = work_ + capacity_;
  find_ahead(laws, reaction_, ahead);
  energy_ = 0;
  for (std::int32_t row = 0; row < rows_end_; ++row) {
    if (scale_[row] == 0) continue;
    shifted[row] = ahead[row] - soft_[row] * coarse_[row];
    ahead[row] -= soft_[row] * reaction_[row];
    energy_ += reaction_[row] * (ahead[row] + target_[row]);
  }
  ContactSystem unlimited = laws;
  unlimited.most = nullptr;
  residual_ = law_residual(unlimited, reaction_, ahead);
  const auto is_missed = [&](const ContactSystem& system, std::int32_t p, const double* by) {
    const Vec3 off = missed_by_law(laws.constraints[p], own_compliance(laws, p), gather(laws, reaction_, p),
                                   gather(laws, by, p), most_of(system, p));
    return std::max({std::fabs(off.x), std::fabs(off.y), std::fabs(off.z)}) > tolerance;
  };
  for (std::int32_t p = 0; p < laws.constraint_count; ++p) {
    doubt_[p].inexact = is_missed(laws, p, shifted);
    doubt_[p].conflict = !doubt_[p].inexact && is_missed(unlimited, p, ahead);
  }
}

Vec3 ContactSolver::reaction(std::int32_t p) const {
  while (kept_constraint_[p].joined) --p;
  Vec3 r;
  for (int i = 0; i < 3; ++i)
    if (const std::int32_t row = rows_[p].at[i]; row >= 0) r[i] = reaction_[row];
  return r;
}

// N, along x, y and z.
Vec3 ContactSolver::force_of(const ContactConstraint& constraint, const Rows& rows, const double* reaction) {
  Vec3 sum;
  for (int i = 0; i < 3; ++i) {
    const std::int32_t row = rows.at[i];
    if (row < 0) continue;
    if (!constraint.framed)
      sum[i] = reaction[row];
    else
      sum += reaction[row] * load3(constraint.frame.m[i]);
  }
  return sum;
}

// f = H^T r: adds the reactions of the rows to the forces of their contact nodes.
void ContactSolver::spread_reactions(const ContactConstraint* constraints, const Rows* rows, std::int32_t count,
                                     const ContactNode* nodes, const double* reaction, Vec3* force) {
  for (std::int32_t p = 0, leads = 0; p < count; ++p) {
    const ContactConstraint& constraint = constraints[p];
    if (!constraint.joined) leads = p;
    const Vec3 sum = force_of(constraint, rows[leads], reaction);
    for (std::int32_t e = constraint.first_node; e < constraint.first_node + constraint.node_count; ++e)
      force[e] += nodes[e].weight * sum;
  }
}

int ContactSolver::rows_of(std::int32_t tool, std::int32_t point, std::int32_t row[kMostRowsOfAContact]) const {
  int count = 0;
  for (std::int32_t p = 0; p < kept_constraints_; ++p) {
    if (!is_of(p, tool, point)) continue;
    for (const std::int32_t at : kept_rows_[p].at)
      if (at >= 0 && count < kMostRowsOfAContact) row[count++] = at;
  }
  return count;
}

// Sets the reactions of the `gone` rows to zero while all other rows keep their targets: with Z the columns of the inverse for
// those rows, left = r - Z (Z_gone)^-1 r_gone.
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

// With a sweep, which laws may ask for.
Operations ContactSolver::operations_to_predict(std::int32_t tool, std::int32_t point) const {
  std::int32_t own[kMostRowsOfAContact];
  return (2 * rows_of(tool, point, own) + 2) * squared_rows() / kDense +
         operations_of_sweep(system(kept_constraint_, kept_constraints_)) / kDense + 1;
}

Vec3 ContactSolver::beyond_mesh(const ContactDisc& disc, std::int32_t tool, std::int32_t point, bool predicted) const {
  const double* const reactions = predicted ? without_ : reaction_;
  Vec3 sum;
  for (std::int32_t p = 0; p < kept_constraints_; ++p) {
    const ContactConstraint& other = kept_constraint_[p];
    if (!has_disc(other) || is_of(p, tool, point)) continue;
    Vec3 reaction;
    for (int i = 0; i < 3; ++i)
      if (const std::int32_t row = kept_rows_[p].at[i]; row >= 0) reaction[i] = reactions[row];
    for (const ContactDisc& of_other : other.discs)
      if (of_other.radius > 0) sum += compliance_between(disc, of_other) * reaction;
  }
  return sum;
}

bool ContactSolver::predict_without(std::int32_t tool, std::int32_t point, Operations most, Vec3* modified,
                                    double* norm, double* apart, Operations* work) {
  std::int32_t own[kMostRowsOfAContact];
  const int count = rows_of(tool, point, own);
  if (count == 0 || operations_to_predict(tool, point) > most) return false;
  double* const left = without_;
  without_tool_ = without_point_ = -1;
  std::copy(reactions_left(), reactions_left() + rows_end_, left);
  const Operations taken = (2 * count + 2) * squared_rows() / kDense;
  *work += taken;
  without_met_ = may_take_out();
  if (without_met_ && !take_out(own, count, left)) return false;
  for (int k = 0; k < count; ++k) left[own[k]] = 0;
  // As much is left for the queries that read the prediction.
  *work += hold_others_to_laws(tool, point, (most - taken) / 2 * kDense, left) / kDense;
  without_tool_ = tool, without_point_ = point;
  *norm = norm_of(left);
  double* const change = work_ + capacity_;
  for (std::int32_t row = 0; row < rows_end_; ++row) change[row] = left[row] - reaction_[row];
  *apart = norm_of(change);
  std::fill(modified, modified + kept_nodes_, Vec3{});
  spread_reactions(kept_constraint_, kept_rows_, kept_constraints_, kept_node_, left, modified);
  for (std::int32_t e = 0; e < kept_nodes_; ++e)
    modified[e] = compliance_.modified(compliance_.slot_of_contact_node(e), modified[e]);
  return true;
}

// By the factor: it has the rows of all contacts that are left, and their reactions meet all of their targets.
bool ContactSolver::may_take_out() const {
  return !decided_ && factored() && (!any_ended_ || ended_met_);
}

// Returns the multiply-adds that it took.
std::int64_t ContactSolver::hold_others_to_laws(std::int32_t tool, std::int32_t point, std::int64_t most,
                                                double* left) {
  // A constraint without rows takes no part.
  for (std::int32_t p = 0; p < kept_constraints_; ++p)
    if (ended_[p] || is_of(p, tool, point)) rows_[p] = {{-1, -1, -1}};
  const ContactSystem others = system(kept_constraint_, kept_constraints_);
  std::int64_t taken = 0;
  without_met_ = without_met_ && obeys_laws(others, left);
  if (!without_met_ && most >= LawSolver::fewest_operations(others)) {
    laws_.solve(others, kSettled * most_target_, most, left);
    taken = laws_.effort().operations;
  } else if (!without_met_) {
    do {  // one sweep at least
      taken += operations_of_sweep(others);
    } while (sweep_contacts(others, left) > 0 && taken < most);
  }
  std::copy(kept_rows_, kept_rows_ + kept_constraints_, rows_);
  return taken;
}

// Its prediction, where there is one, holds the others to their targets and laws. Else the next prediction does so.
void ContactSolver::end(std::int32_t tool, std::int32_t point) {
  if (!without_) return;
  std::int32_t own[kMostRowsOfAContact];
  const int count = rows_of(tool, point, own);
  const bool was_predicted = tool == without_tool_ && point == without_point_;
  const double* const left = was_predicted ? without_ : reactions_left();
  if (left != without_ended_) std::copy(left, left + rows_end_, without_ended_);
  for (int k = 0; k < count; ++k) without_ended_[own[k]] = 0;
  ended_met_ = was_predicted && without_met_;
  for (std::int32_t p = 0; p < kept_constraints_; ++p) ended_[p] = ended_[p] || is_of(p, tool, point);
  any_ended_ = true, without_tool_ = without_point_ = -1;
  if (!factored()) return;
  for (int k = 0; k < count; ++k) scale_[own[k]] = 0;
  const std::int32_t positions = close_up();
  factor_.remove(positions, list_);
  soft_factor_.clear();
}

// Removing a row takes rows^2 multiply-adds and adding one half of that; a new factor takes rows^3 / 6. leave, join: contacts.
Operations ContactSolver::upkeep_of(Operations rows, Operations leave, Operations join) {
  const Operations each = 3 * rows * rows, whole = rows * rows * rows / 6;
  return (std::min(each * leave, whole) + std::min(each / 2 * join, whole)) / kDense;
}

// The compliance between a contact's nodes and all others takes 9 multiply-adds for each pair.
Operations ContactSolver::entries_of(const Changes& changes) const {
  const std::int32_t nodes = kept_nodes_ + changes.nodes, constraints = kept_constraints_ + changes.constraints,
                     nodes_of_each = constraints > 0 ? 1 + nodes / constraints : 1;
  const std::int32_t discs = kept_discs_ + changes.discs;
  return changes.contacts * (9 * nodes_of_each * nodes / kDense + (discs > 1 ? kOfTwoDiscs * (discs - 1) : 0));
}

Operations ContactSolver::operations_to_renew(const Changes& changes) const {
  if (changes.contacts == 0) return 0;  // in most steps no contact changes
  const Operations rows = rows_end_ + changes.rows;
  const bool keeps_factor = !gives_way_ && factored() && affords_factor(rows);
  return (keeps_factor ? upkeep_of(rows, changes.contacts - changes.begun, changes.contacts) : 0) + entries_of(changes);
}

bool ContactSolver::prepare(const Tensors& tensors, const ContactConstraints& set, StepWork* work) {
  again_ = false, last_constraints_ = kept_constraints_;
  residual_ = {}, effort_ = {}, shares_ = false, decided_ = 0;
  if (!update(tensors, set, work)) {
    forget();
    return false;
  }
  std::copy(reaction_, reaction_ + rows_end_, last_);
  last_energy_ = energy_;
  return true;
}

Vec3 ContactSolver::reached(std::int32_t p) const {
  Vec3 sum;
  for (int i = 0; i < 3; ++i)
    if (const std::int32_t row = rows_[p].at[i]; row >= 0) sum[i] = dot_rows(rows_end_, matrix_row(row), reaction_);
  return sum;
}

ContactSolver::Outcome ContactSolver::take_reactions(const ContactConstraints& set, const LawEffort& effort,
                                                     Vec3* force, Vec3* modified) {
  take_targets(set);
  set_limits(set.constraints, set.constraint_count);
  effort_ = effort, gives_way_ = decided_ = 1;
  measure_laws(system(set.constraints, set.constraint_count));
  return write_forces(set, force, modified) ? Outcome::solved : fail(set, force, modified);
}

ContactSolver::Outcome ContactSolver::solve(const Tensors& tensors, const ContactConstraints& set, Vec3* force,
                                            Vec3* modified, StepWork* work, bool again) {
  again_ = again, last_constraints_ = kept_constraints_;
  for (std::int32_t e = 0; e < set.node_count; ++e) force[e] = modified[e] = Vec3{};
  residual_ = {}, effort_ = {}, shares_ = limited_ = false, decided_ = 0;
  if (!update(tensors, set, work)) return fail(set, force, modified);
  take_targets(set);
  std::copy(reaction_, reaction_ + rows_end_, last_);
  last_energy_ = energy_;
  set_limits(set.constraints, set.constraint_count);
  if (!factor_again(work)) return fail(set, force, modified);
  const ContactSystem laws = system(set.constraints, set.constraint_count);
  const bool have_laws = std::any_of(set.constraints, set.constraints + set.constraint_count, may_give_way);
  // Of the laws, or of a second solution without a soft factor.
  const Operations least = operations_to_solve_for(rows_end_, set.constraint_count);
  bool obeys = false;
  Outcome outcome = Outcome::solved;
  Limiting limiting = Limiting::within;
  if (const Operations cost = 3 * squared_rows() / kDense;
      factored() && cost + (have_laws ? least : 0) <= work->left()) {
    work->add(cost);
    outcome = solve_factored();
    obeys = obeys_laws(laws, reaction_);
    if (obeys) limiting = limit_forces(set, have_laws ? least : 0, force, work);
    limited_ = limiting == Limiting::limited;
    if (limited_) outcome = Outcome::regularised, obeys = obeys_laws(laws, reaction_);
    measure_residual();
  }
  gives_way_ = 0;
  if (!obeys || limiting == Limiting::no_room) {
    decide_by_laws(laws, set, obeys && !have_laws, force, work);
    outcome = Outcome::solved;
  }
  return write_forces(set, force, modified) ? outcome : fail(set, force, modified);
}

// solved: reaction_ is the solution, and only grips are to be brought within their limit.
void ContactSolver::decide_by_laws(const ContactSystem& laws, const ContactConstraints& set, bool solved, Vec3* force,
                                   StepWork* work) {
  ContactSystem through = laws;
  constexpr Operations most_shared = SharedNodes::kMostNodes;
  const Operations nodes = std::min<Operations>(set.node_count, most_shared),
                   to_take = 60 * (nodes * nodes + set.node_count) / kDense,
                   least = operations_to_solve_for(rows_end_, set.constraint_count);
  // Through the nodes there is no way from one disc to another beyond the mesh, and none to a row that constraints share.
  shares_ = !couples() && !joins(set) && to_take + least <= work->left() && shared_.take(compliance_, set, used_rows_);
  if (shares_) {
    through.shared = &shared_;
    work->add(shared_.operations_to_take() / kDense);
  }
  decided_ = 1;
  if (solved) {
    std::fill(doubt_, doubt_ + set.constraint_count, Doubt{});
  } else {
    const Operations look = operations_to_look(through);
    solve_laws(through, kMostSolves, 2 * look, work);
    measure_laws(through);
    work->add(look);
  }
  limit_grips(through, set, force, work);
  gives_way_ = contacts_give_way(laws);
}

}  // namespace palpate
