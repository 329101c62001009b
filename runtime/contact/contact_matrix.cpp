#include "runtime/contact/contact_matrix.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "runtime/dense/dense_rows.h"

namespace palpate {
namespace {

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

// N, along x, y and z.
Vec3 force_of(const ContactConstraint& constraint, const RowsOfConstraint& rows, const double* reaction) {
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

// Writes what lies between the rows of two constraints; own: of one, where both halves take the numbers of the upper one. add: to what is
// there. False where a number is not finite.
bool write_block(const RowMatrix& matrix, const RowsOfConstraint& rows, const RowsOfConstraint& columns,
                 const Mat3& block, bool own, bool add) {
  double* across[3];
  for (int j = 0; j < 3; ++j) across[j] = matrix.row(std::max(columns.at[j], 0));
  double sum = 0;
  for (int i = 0; i < 3; ++i) {
    const std::int32_t row = rows.at[i];
    if (row < 0) continue;
    double* const along = matrix.row(row);
    for (int j = own ? i : 0; j < 3; ++j) {
      const std::int32_t column = columns.at[j];
      if (column < 0) continue;
      const double value = block.m[i][j] + (add ? along[column] : 0);
      along[column] = across[j][row] = value;
      sum += value;
    }
  }
  return std::isfinite(sum);
}

bool is_one_node(const ContactConstraints& set, const ContactConstraint& constraint) {
  return constraint.node_count == 1 && set.nodes[constraint.first_node].weight == 1;
}

}  // namespace

bool ContactMatrix::create(SceneMemory& memory, const Limits& limits) {
  if (!matrix_.create(memory, 3 * limits.constraints)) return false;
  const std::size_t rows = static_cast<std::size_t>(matrix_.capacity), nodes = static_cast<std::size_t>(limits.nodes),
                    constraints = static_cast<std::size_t>(limits.constraints);
  if (limits.predicts) between_ = memory.array<double>(rows * matrix_.stride);
  spread_ = memory.array<Mat3>(nodes);
  rows_ = memory.array<Rows>(constraints);
  held_.nodes = memory.array<ContactNode>(nodes);
  held_.constraints = memory.array<ContactConstraint>(constraints);
  held_.rows = memory.array<Rows>(constraints);
  held_.ended = memory.array<bool>(constraints);
  is_kept_ = memory.array<bool>(constraints);
  stayed_ = memory.array<bool>(constraints);
  carried_ = memory.array<Vec3>(constraints);
  leaving_ = memory.array<std::int32_t>(rows);
  coming_ = memory.array<std::int32_t>(rows);
  memory.keep(matrix_.rows_end);
  memory.keep(free_row_);
  memory.keep(held_.count);
  memory.keep(held_.node_count);
  memory.keep(held_.discs);
  memory.keep_array(matrix_.numbers, rows * matrix_.stride, matrix_.rows_end, matrix_.stride);
  memory.keep_array(matrix_.scale, rows, matrix_.rows_end);
  memory.keep_array(held_.rows, constraints, held_.count);
  memory.keep_array(held_.constraints, constraints, held_.count);
  memory.keep_array(held_.nodes, nodes, held_.node_count);
  return compliance_.create(memory, limits.nodes, limits.columns, limits.columns_of_surface, limits.surface_nodes,
                            limits.offset) &&
         !memory.failed();
}

// The compliance between nodes is read again: it has the same bits whenever a node came under contact.
void ContactMatrix::restored(const Tensors& tensors) {
  ContactConstraints held;
  held.nodes = held_.nodes, held.node_count = held_.node_count;
  compliance_.forget();
  compliance_.hold(tensors, held);
  std::copy(held_.rows, held_.rows + held_.count, rows_);
  // A saved state has no between_. The array may hold what another run has left, so zeros are written as well.
  has_coupled_ = true;
  for (std::int32_t p = 0, row = 0; p < held_.count; ++p) {
    if (!held_.constraints[p].joined) row = p;
    for (std::int32_t q = 0, column = 0; q <= p; ++q) {
      if (!held_.constraints[q].joined) column = q;
      const bool couple = q != p && has_disc(held_.constraints[p]) && has_disc(held_.constraints[q]);
      Mat3 of_discs = couple ? compliance_between(held_.constraints[p], held_.constraints[q]) : Mat3{};
      if (row == column) add_scaled(of_discs, 1, of_discs);
      remember_between(rows_[row], rows_[column], of_discs, couple, row != p || column != q);
    }
  }
}

void ContactMatrix::forget() {
  compliance_.forget();
  std::fill(matrix_.scale, matrix_.scale + matrix_.rows_end, 0.0);
  matrix_.rows_end = free_row_ = held_.count = held_.node_count = held_.discs = 0;
  forget_ended();
}

void ContactMatrix::forget_ended() {
  if (held_.any_ended) std::fill(held_.ended, held_.ended + matrix_.capacity / 3, false);
  held_.any_ended = false;
}

void ContactMatrix::end(const ContactId& contact) {
  for (std::int32_t p = 0; p < held_.count; ++p) held_.ended[p] = held_.ended[p] || is_of(p, contact);
  held_.any_ended = true;
}

void ContactMatrix::retire(const std::int32_t* rows, int count) {
  for (int k = 0; k < count; ++k) matrix_.scale[rows[k]] = 0;
}

// ---- rows that stay, leave and come ----------------------------------------------------------------------------------

bool ContactMatrix::same(const ContactConstraints& set, const ContactConstraint& now,
                         const ContactConstraint& before) const {
  if (now.node_count != before.node_count || now.axes != before.axes || now.framed != before.framed ||
      now.joined != before.joined)
    return false;
  for (std::int32_t v = 0; v < now.node_count; ++v) {
    const ContactNode &a = set.nodes[now.first_node + v], &b = held_.nodes[before.first_node + v];
    if (a.node != b.node || a.weight != b.weight) return false;
  }
  return are_equal(now.local, before.local) && (!now.framed || are_equal(now.frame, before.frame)) &&
         are_equal(now.discs[0], before.discs[0]) && are_equal(now.discs[1], before.discs[1]);
}

// The same of constraint p with those that share its rows, and kept constraint k.
bool ContactMatrix::same_with_joined(const ContactConstraints& set, std::int32_t p, std::int32_t k) const {
  const std::int32_t count = end_of_joined(set.constraints, set.constraint_count, p) - p;
  if (end_of_joined(held_.constraints, held_.count, k) - k != count) return false;
  for (std::int32_t part = 0; part < count; ++part) {
    const ContactConstraint &now = set.constraints[p + part], &before = held_.constraints[k + part];
    if (held_.ended[k + part] || now.id != before.id || !same(set, now, before)) return false;
  }
  return true;
}

const ContactConstraint* ContactMatrix::kept(const ContactConstraint& like, std::int32_t number) const {
  if (number < held_.count && held_.constraints[number].id == like.id) return held_.constraints + number;
  const ContactConstraint *const first = held_.constraints, *const end = first + held_.count;
  const ContactConstraint* const at = std::lower_bound(
      first, end, like, [](const ContactConstraint& a, const ContactConstraint& b) { return a.id < b.id; });
  return at != end && at->id == like.id ? at : nullptr;
}

bool ContactMatrix::holds(const ContactConstraints& set, std::int32_t p) const {
  const ContactConstraint* const before = kept(set.constraints[p], p);
  return before && !held_.ended[before - held_.constraints] && same(set, set.constraints[p], *before);
}

// Whether the constraints are those of the last solve, to the last bit, as those of tools that stand still are. Then all have their rows.
bool ContactMatrix::holds_all(const ContactConstraints& set) const {
  const auto equal = [](const auto* now, const auto* before, std::int32_t count) {
    return std::memcmp(now, before, static_cast<std::size_t>(count) * sizeof *now) == 0;
  };
  return !held_.any_ended && set.constraint_count == held_.count && set.node_count == held_.node_count &&
         equal(set.nodes, held_.nodes, held_.node_count) && equal(set.constraints, held_.constraints, held_.count);
}

// Finds which constraints were there in the last step. Both lists ascend by contact and part, so one walk through the two
// is enough. leaving_ gets the rows of constraints that are gone; a constraint that needs new rows is marked by first row -2.
bool ContactMatrix::match(const Tensors& tensors, const ContactConstraints& set, const double* reaction, bool again) {
  const bool is_stale = compliance_.is_stale();
  if (is_stale) compliance_.forget();
  if (!again) is_renewed_ = is_stale;
  if (!compliance_.hold(tensors, set)) return false;
  leaving_count_ = changed_contacts_ = joining_rows_ = 0;
  unchanged_ = !is_stale && holds_all(set);
  if (unchanged_) {
    std::fill_n(is_kept_, set.constraint_count, true);
    if (!again) std::fill_n(stayed_, set.constraint_count, true);
    return true;
  }
  const ContactConstraint* counted = nullptr;
  const auto count = [&](const ContactConstraint& of) {
    changed_contacts_ += !counted || of.id.contact != counted->id.contact;
    counted = &of;
  };
  const auto leave = [&](std::int32_t k) {
    count(held_.constraints[k]);
    for (const std::int32_t row : held_.rows[k].at)
      if (row >= 0) leaving_[leaving_count_++] = row;
  };
  std::int32_t k = 0;
  for (std::int32_t p = 0; p < set.constraint_count; ++p) {
    const ContactConstraint& constraint = set.constraints[p];
    while (k < held_.count && held_.constraints[k].id < constraint.id) leave(k++);
    const bool known = k < held_.count && constraint.id == held_.constraints[k].id;
    is_kept_[p] = constraint.joined ? is_kept_[p - 1] : known && !is_stale && same_with_joined(set, p, k);
    if (is_kept_[p]) {
      rows_[p] = held_.rows[k];
    } else {
      carried_[p] = Vec3{};
      for (int i = 0; known && i < 3; ++i)
        if (const std::int32_t row = held_.rows[k].at[i]; row >= 0) carried_[p][i] = reaction[row];
      rows_[p] = {{-2, -1, -1}};
      if (known) leave(k);
      count(constraint);
      for (int axis = 0; axis < 3; ++axis) joining_rows_ += static_cast<std::int32_t>(constraint.axes >> axis & 1u);
    }
    if (known) ++k;
  }
  while (k < held_.count) leave(k++);
  if (!again) std::copy_n(is_kept_, set.constraint_count, stayed_);
  return true;
}

void ContactMatrix::drop_leaving(double* reaction) {
  if (leaving_count_ == 0) return;
  free_row_ = 0;
  for (std::int32_t l = 0; l < leaving_count_; ++l) matrix_.scale[leaving_[l]] = 0, reaction[leaving_[l]] = 0;
  while (matrix_.rows_end > 0 && matrix_.scale[matrix_.rows_end - 1] == 0) --matrix_.rows_end;
}

// H C: displacement of the constraint per unit force on each contact node, by the node's slot.
const Mat3* ContactMatrix::spread_of(const ContactConstraints& set, const ContactConstraint& constraint) {
  const std::int32_t first = constraint.first_node;
  if (is_one_node(set, constraint)) return compliance_.at(compliance_.slot_of_contact_node(first));
  std::fill(spread_, spread_ + compliance_.slots(), Mat3{});
  for (std::int32_t e = first; e < first + constraint.node_count; ++e) {
    // Of slots that are not in use nothing is read.
    const Mat3* c = compliance_.at(compliance_.slot_of_contact_node(e));
    add_rows(9 * compliance_.slots(), set.nodes[e].weight, &c->m[0][0], &spread_->m[0][0]);
  }
  return spread_;
}

// Until the first two discs meet, all of it is zero.
void ContactMatrix::remember_between(const Rows& rows, const Rows& columns, const Mat3& between, bool couple,
                                     bool add) {
  if (!between_ || (!couple && !has_coupled_)) return;
  has_coupled_ = true;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      if (rows.at[i] < 0 || columns.at[j] < 0) continue;
      const auto row = static_cast<std::size_t>(rows.at[i]), column = static_cast<std::size_t>(columns.at[j]);
      const double before = add ? between_[row * matrix_.stride + column] : 0;
      between_[row * matrix_.stride + column] = between_[column * matrix_.stride + row] = before + between.m[i][j];
    }
}

// H W H^T of two constraints; spread: of the first one. Of two nodes along x, y and z, of which there may be many pairs, it is not copied.
const Mat3& ContactMatrix::between(const ContactConstraints& set, const Mat3* spread, const ContactConstraint& one,
                                   const ContactConstraint& other, Mat3* sum) const {
  const std::int32_t first = other.first_node;
  const Mat3& of_node = spread[compliance_.slot_of_contact_node(first)];
  if (is_one_node(set, other)) {
    if (!one.framed && !other.framed) return of_node;
    *sum = of_node;
  } else {
    *sum = Mat3{};
    for (std::int32_t e = first; e < first + other.node_count; ++e)
      add_scaled(*sum, set.nodes[e].weight, spread[compliance_.slot_of_contact_node(e)]);
  }
  if (!one.framed || !other.framed) {
    if (one.framed) *sum = one.frame * *sum;
    if (other.framed) *sum = times_transposed(*sum, other.frame);
    return *sum;
  }
  // Many constraints that have both frames have one row alone.
  const std::uint32_t rows = one.joined ? 7 : one.axes, columns = other.joined ? 7 : other.axes;
  Mat3 framed;
  for (int i = 0; i < 3; ++i) {
    if (!(rows >> i & 1u)) continue;
    const Vec3 along = transposed_times(*sum, load3(one.frame.m[i]));
    for (int j = 0; j < 3; ++j)
      if (columns >> j & 1u) framed.m[i][j] = dot(along, load3(other.frame.m[j]));
  }
  return *sum = framed;
}

// own: its own block. A row without compliance cannot move (its nodes are fixed along it): it gets no force. leads: constraints share the
// first row, and bound_joined() tells.
ContactMatrix::Rows ContactMatrix::take_rows(const ContactConstraint& constraint, const Mat3& own, bool leads) {
  Rows rows = {{-1, -1, -1}};
  double* const scale = matrix_.scale;
  std::int32_t row = free_row_, end = matrix_.rows_end;
  for (int i = 0; i < 3; ++i) {
    if (!(constraint.axes >> i & 1u) || (own.m[i][i] <= 0 && !leads)) continue;
    while (row < end && scale[row] != 0) ++row;
    scale[row] = leads ? 1 : 1 / std::sqrt(own.m[i][i]);
    rows.at[i] = row, end = std::max(end, row + 1);
  }
  free_row_ = row, matrix_.rows_end = end;
  return rows;
}

// The row that several constraints share, when all of them are in it.
void ContactMatrix::bound_joined(Rows* rows) {
  const std::int32_t row = rows->at[0];
  if (row < 0) return;
  double& own = matrix_.entry(row, row);
  own = std::max(own, kLeastOfJoined * most_joined_);
  matrix_.scale[row] = own > 0 ? 1 / std::sqrt(own) : 0;
  if (!(own > 0)) rows->at[0] = -1, free_row_ = std::min(free_row_, row);
}

// Fills the rows of constraint p and their columns in H W H^T. False where a number is not finite.
bool ContactMatrix::fill_rows(const ContactConstraints& set, std::int32_t p) {
  const ContactConstraint& constraint = set.constraints[p];
  const Mat3* const spread = spread_of(set, constraint);
  Mat3 own, sum;
  own = between(set, spread, constraint, constraint, &sum);
  add_scaled(own, 1, constraint.local);
  std::int32_t first = p;
  while (set.constraints[first].joined) --first;
  const bool last = end_of_joined(set.constraints, set.constraint_count, p) == p + 1;
  if (first == p)
    rows_[p] = take_rows(constraint, own, !last);
  else
    rows_[p] = {{-1, -1, -1}};
  most_joined_ = std::max(first == p ? 0 : most_joined_, own.m[0][0]);
  const Rows& rows = rows_[first];
  for (std::int32_t q = 0, leads = 0; q < set.constraint_count; ++q) {
    const ContactConstraint& other = set.constraints[q];
    if (!other.joined) leads = q;
    const Rows& columns = rows_[leads];
    if (columns.at[0] < -1) continue;
    const Mat3* block = q == p ? &own : &between(set, spread, constraint, other, &sum);
    const bool add = constraint.joined || other.joined, couple = q != p && has_disc(constraint) && has_disc(other);
    const Mat3 of_discs = couple ? compliance_between(constraint, other) : Mat3{};
    if (couple) {
      sum = *block, block = &sum;
      add_scaled(sum, 1, of_discs);
    }
    remember_between(rows, columns, of_discs, couple, add);
    if (!write_block(matrix_, rows, columns, *block, q == p, add)) return false;
  }
  if (last && first != p) bound_joined(&rows_[first]);
  return true;
}

bool ContactMatrix::add_coming(const ContactConstraints& set, double* reaction) {
  coming_count_ = 0;
  const auto is_new = [](const Rows& rows) { return rows.at[0] < -1; };
  for (std::int32_t p = 0, first = 0; p < set.constraint_count; ++p) {
    if (!is_new(rows_[p])) continue;
    if (!fill_rows(set, p)) return false;
    if (!set.constraints[p].joined) first = p;
    if (end_of_joined(set.constraints, set.constraint_count, p) > p + 1) continue;
    for (int i = 0; i < 3; ++i)
      if (const std::int32_t row = rows_[first].at[i]; row >= 0)
        coming_[coming_count_++] = row, reaction[row] = carried_[first][i];
  }
  return true;
}

void ContactMatrix::keep(const ContactConstraints& set) {
  if (unchanged_) return;
  std::copy(set.nodes, set.nodes + set.node_count, held_.nodes);
  std::copy(set.constraints, set.constraints + set.constraint_count, held_.constraints);
  std::copy(rows_, rows_ + set.constraint_count, held_.rows);
  held_.count = set.constraint_count, held_.node_count = set.node_count;
  held_.discs = static_cast<std::int32_t>(std::count_if(
      set.constraints, set.constraints + set.constraint_count,
      [](const ContactConstraint& constraint) { return has_disc(constraint) && !is_gradient(constraint.discs[0]); }));
  forget_ended();
}

// ---- asked by others ---------------------------------------------------------------------------------------------------

int ContactMatrix::rows_of(const ContactId& contact, std::int32_t row[kMostRowsOfAContact]) const {
  int count = 0;
  for (std::int32_t p = 0; p < held_.count; ++p) {
    if (!is_of(p, contact)) continue;
    for (const std::int32_t at : held_.rows[p].at)
      if (at >= 0 && count < kMostRowsOfAContact) row[count++] = at;
  }
  return count;
}

// m, [rows_end]: what the rows of discs move beyond the mesh by the reactions of other discs.
void ContactMatrix::measure_between_discs(const double* reaction, double* moved) const {
  for (std::int32_t row = 0; row < matrix_.rows_end; ++row)
    moved[row] = matrix_.scale[row] == 0 || !couples()
                     ? 0
                     : dot_rows(matrix_.rows_end, between_ + static_cast<std::size_t>(row) * matrix_.stride, reaction);
}

Vec3 ContactMatrix::beyond_mesh(const double* reactions, const ContactDisc& disc, const ContactId& contact) const {
  Vec3 sum;
  for (std::int32_t p = 0; p < held_.count; ++p) {
    const ContactConstraint& other = held_.constraints[p];
    if (!has_disc(other) || is_of(p, contact)) continue;
    Vec3 reaction;
    for (int i = 0; i < 3; ++i)
      if (const std::int32_t row = held_.rows[p].at[i]; row >= 0) reaction[i] = reactions[row];
    for (const ContactDisc& of_other : other.discs)
      if (of_other.radius > 0) sum += compliance_between(disc, of_other) * reaction;
  }
  return sum;
}

Vec3 ContactMatrix::reaction(const double* reaction, std::int32_t p) const {
  while (held_.constraints[p].joined) --p;
  Vec3 r;
  for (int i = 0; i < 3; ++i)
    if (const std::int32_t row = rows_[p].at[i]; row >= 0) r[i] = reaction[row];
  return r;
}

void ContactMatrix::find_given(const Offset& offset, const double* reaction, const ContactId& contact,
                               double* given) const {
  std::fill_n(given, offset.count(), 0.0);
  for (std::int32_t p = 0, leads = 0; p < held_.count; ++p) {
    const ContactConstraint& constraint = held_.constraints[p];
    if (!constraint.joined) leads = p;
    if (!is_of(p, contact)) continue;
    const Vec3 force = force_of(constraint, held_.rows[leads], reaction);
    for (std::int32_t e = constraint.first_node; e < constraint.first_node + constraint.node_count; ++e)
      offset.followers().subtract_force(held_.nodes[e].node, held_.nodes[e].weight * force, given);
  }
  offset.followers().solve(given);
}

Vec3 ContactMatrix::reached(const double* reaction, std::int32_t p) const {
  Vec3 sum;
  for (int i = 0; i < 3; ++i)
    if (const std::int32_t row = rows_[p].at[i]; row >= 0)
      sum[i] = dot_rows(matrix_.rows_end, matrix_.row(row), reaction);
  return sum;
}

double ContactMatrix::largest_displacement(const ContactConstraints& set, const double* reaction, Vec3* force,
                                           Operations kept, StepWork* work) const {
  const Operations cost = 9 * Operations{set.node_count} * set.node_count / kDense;
  if (cost + kept > work->left()) return -1;
  work->add(cost);
  std::fill(force, force + set.node_count, Vec3{});
  spread_reactions(set.constraints, rows_, set.constraint_count, set.nodes, reaction, force);
  double most = 0;
  for (std::int32_t e = 0; e < set.node_count; ++e) {
    const Vec3 u = displacement(set, force, e);
    most = std::max({most, std::fabs(u.x), std::fabs(u.y), std::fabs(u.z)});
  }
  return most;
}

Vec3 ContactMatrix::displacement(const ContactConstraints& set, const Vec3* force, std::int32_t e) const {
  const Mat3* c = compliance_.at(compliance_.slot_of_contact_node(e));
  Vec3 u;
  for (std::int32_t b = 0; b < set.node_count; ++b) u += c[compliance_.slot_of_contact_node(b)] * force[b];
  return u;
}

Mat3 ContactMatrix::compliance_between_nodes(const ContactConstraints& set, std::int32_t p, std::int32_t q) const {
  const ContactConstraint &one = set.constraints[p], &other = set.constraints[q];
  Mat3 sum;
  for (std::int32_t a = one.first_node; a < one.first_node + one.node_count; ++a) {
    const Mat3* c = compliance_.at(compliance_.slot_of_contact_node(a));
    for (std::int32_t b = other.first_node; b < other.first_node + other.node_count; ++b)
      add_scaled(sum, set.nodes[a].weight * set.nodes[b].weight, c[compliance_.slot_of_contact_node(b)]);
  }
  return sum;
}

// f = H^T r: adds the reactions of the rows to the forces of their contact nodes.
void spread_reactions(const ContactConstraint* constraints, const RowsOfConstraint* rows, std::int32_t count,
                      const ContactNode* nodes, const double* reaction, Vec3* force) {
  for (std::int32_t p = 0, leads = 0; p < count; ++p) {
    const ContactConstraint& constraint = constraints[p];
    if (!constraint.joined) leads = p;
    const Vec3 sum = force_of(constraint, rows[leads], reaction);
    for (std::int32_t e = constraint.first_node; e < constraint.first_node + constraint.node_count; ++e)
      force[e] += nodes[e].weight * sum;
  }
}

}  // namespace palpate
