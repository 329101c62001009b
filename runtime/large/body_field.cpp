#include "runtime/large/body_field.h"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

// Bounds of the ratio between what a contact's rows do and what all responses give them.
constexpr double kLeastRatio = 0.25, kMostRatio = 4;
// Rows that hold, of the contacts without which the field is predicted, at most.
constexpr int kMostRows = 48;

double longest(const float* u, std::int32_t nodes) {
  float most = 0;
  for (std::int32_t n = 0; n < nodes; ++n, u += 3) most = std::max(most, u[0] * u[0] + u[1] * u[1] + u[2] * u[2]);
  return std::sqrt(static_cast<double>(most)) * (1 + 1e-6);
}
double longest_difference(const float* u, const float* v, std::int32_t nodes) {
  float most = 0;
  for (std::int32_t n = 0; n < nodes; ++n, u += 3, v += 3) {
    const float x = u[0] - v[0], y = u[1] - v[1], z = u[2] - v[2];
    most = std::max(most, x * x + y * y + z * z);
  }
  return std::sqrt(static_cast<double>(most)) * (1 + 1e-6);
}

}  // namespace

bool BodyField::create(SceneMemory& memory, const DeformingBody* body, const Offset* offset,
                       std::int32_t constraint_capacity, std::int32_t surface_nodes) {
  body_ = body, offset_ = offset, surface_nodes_ = surface_nodes;
  const auto constraints = static_cast<std::size_t>(constraint_capacity),
             numbers = 3 * static_cast<std::size_t>(surface_nodes);
  for (float** field : {&now_, &before_}) *field = memory.array<float>(numbers);
  contacts_ = memory.array<Contact>(constraints), last_ = memory.array<Contact>(constraints);
  for (double** array : {&own_, &predicted_, &column_, &together_}) *array = memory.array<double>(3 * constraints);
  if (memory.failed()) return false;
  for (std::int32_t* count : {&contact_count_, &last_count_, &moves_}) memory.keep(*count);
  for (double* norm : {&norm_, &norm_before_, &path_, &path_set_, &path_before_}) memory.keep(*norm);
  for (float** field : {&now_, &before_}) memory.keep_array(*field, numbers);
  memory.keep_array(contacts_, constraints, contact_count_), memory.keep_array(last_, constraints, last_count_);
  memory.keep_array(own_, 3 * constraints);
  return true;
}

void BodyField::forget() {
  for (float* field : {now_, before_}) std::fill(field, field + 3 * static_cast<std::size_t>(surface_nodes_), 0.0f);
  contact_count_ = last_count_ = moves_ = 0;
  norm_ = norm_before_ = path_ = path_set_ = path_before_ = predicted_apart_ = 0;
  is_set_ = true;
}

void BodyField::begin_moved() {
  is_set_ = false;
  path_ += offset_->stepped();
}

const BodyField::Contact* BodyField::find(const ContactId& id) const {
  const Contact *first = contacts_, *end = contacts_ + contact_count_;
  const Contact* at = std::partition_point(first, end, [&](const Contact& c) { return c.id < id; });
  return at != end && at->id == id ? at : nullptr;
}

Vec3 BodyField::response_at(const double* force, std::int32_t first, std::int32_t end, std::int32_t node,
                            QueryWork* work) const {
  double out[3];
  body_->solver().response_at(force, first, end, node, out);
  work->add(3 * (end - first));
  return load3(out);
}

// The contacts, and their rows in the order of DeformingBody.
void BodyField::gather(const ContactConstraints& set, const Vec3* force) {
  std::swap(contacts_, last_);
  last_count_ = contact_count_, contact_count_ = 0;
  std::int32_t row = 0;
  for (std::int32_t p = 0; p < set.constraint_count; ++p) {
    const ContactConstraint& constraint = set.constraints[p];
    Contact* contact = contact_count_ > 0 ? &contacts_[contact_count_ - 1] : nullptr;
    const bool joins = contact && contact->id == constraint.id.contact;
    if (!joins) {
      contact = &contacts_[contact_count_++];
      *contact = Contact{};
      contact->id = constraint.id.contact, contact->first = row;
    }
    for (std::uint32_t axes = constraint.axes & 7u; axes != 0; axes &= axes - 1) ++row;
    contact->end = row;
    contact->response = joins || contact->first == row ? -1 : body_->solver().response_id(contact->first);
    for (std::int32_t e = constraint.first_node; e < constraint.first_node + constraint.node_count; ++e)
      for (int i = 0; i < 3; ++i) contact->force[i] += force[e][i];
  }
}

void BodyField::find_own_parts() {
  const LargeSolver& solver = body_->solver();
  const double* const force = body_->row_forces();
  solver.response_on_rows(force, together_);
  for (std::int32_t c = 0; c < contact_count_; ++c) {
    Contact& now = contacts_[c];
    double there = 0, linear = 0;
    for (std::int32_t r = now.first; r < now.end; ++r)
      there += force[r] * solver.on_row(r), linear += force[r] * together_[r];
    const double ratio = linear > 0 && moved_norm() == 0 ? std::clamp(there / linear, kLeastRatio, kMostRatio) : 1;
    for (std::int32_t r = now.first; r < now.end; ++r) {
      own_[r] = ratio * force[r];
      for (int d = 0; d < 3; ++d) now.sum[d] += own_[r] * solver.direction(r)[d];
    }
    now.own = alone() ? norm_ : solver.response_bound(own_, now.first, now.end);
    const Contact* before = last_;
    const Contact* const end = last_ + last_count_;
    while (before != end && before->id != now.id) ++before;
    now.own_change = now.own + (before != end ? before->own : 0);
    if (before == end || now.response < 0 || before->response != now.response) continue;
    const double change[3] = {now.sum[0] - before->sum[0], now.sum[1] - before->sum[1], now.sum[2] - before->sum[2]};
    now.own_change = std::min(now.own_change, solver.spot_response_bound(now.first, change));
  }
}

void BodyField::set(const ContactConstraints& set, const Vec3* force, bool solved, Operations* work) {
  std::swap(now_, before_);
  is_set_ = true;
  norm_before_ = norm_, path_before_ = path_set_;
  body_->write_field(surface_nodes_, now_);
  norm_ = longest(now_, surface_nodes_);
  moves_ = norm_ > 0;
  path_ += longest_difference(now_, before_, surface_nodes_);
  path_set_ = path_;
  gather(set, force);
  if (!solved) contact_count_ = 0;
  if (contact_count_ > 0) find_own_parts();
  *work += surface_nodes_;
}

void BodyField::end(const ContactId& id) {
  if (auto* const own = const_cast<Contact*>(find(id))) own->ended = 1;
}

Vec3 BodyField::evaluate_at_node(std::int32_t node, QueryWork* work) {
  work->add(3);
  return (node < surface_nodes_ ? read(now_, node) : body_->moved_by_contacts(node)) + moved_at_node(node);
}

Vec3 BodyField::at_node_without(std::int32_t node, const ContactId& id, QueryWork* work) {
  const Contact* const contact = find(id);
  if (!contact) return at_node(node, work);
  if (alone()) return {};
  return at_node(node, work) - response_at(own_, contact->first, contact->end, node, work);
}

// The own parts of the contact and of those that have ended are taken away, and the rows of the others that hold stay where they are: with x the linear response,
// C x = 0 on these rows.
bool BodyField::predict_without(const ContactId& id, Operations /*most*/, Operations* work) {
  const Contact* const contact = find(id);
  if (!contact) return false;
  const LargeSolver& solver = body_->solver();
  const std::int32_t rows = contacts_[contact_count_ - 1].end;
  std::fill(predicted_, predicted_ + rows, 0.0);
  const auto is_gone = [&](const Contact& c) { return c.ended != 0 || &c == contact; };
  const bool all_gone = std::all_of(contacts_, contacts_ + contact_count_, is_gone);
  predicts_rest_ = all_gone && moved_norm() == 0;
  if (all_gone) {
    std::copy(own_, own_ + rows, predicted_);
    predicted_apart_ = predicts_rest_ ? norm_ : solver.response_bound(predicted_, 0, rows);
    return true;
  }
  double* const gone = together_;  // [rows] 1: of a contact that is gone
  for (const Contact* c = contacts_; c != contacts_ + contact_count_; ++c)
    std::fill(gone + c->first, gone + c->end, is_gone(*c) ? 1.0 : 0.0);
  // What rows that do not hold do to those that do; then what makes the part of the gone rows that hold whole.
  std::int32_t own[kMostRows];
  int count = 0;
  for (std::int32_t r = 0; r < rows; ++r) {
    if (gone[r] == 0 || !solver.holds(r)) continue;
    if (count == kMostRows) return false;
    own[count++] = r;
  }
  const RowMatrix& c = solver.compliance();
  for (std::int32_t r = 0; r < rows; ++r)
    for (std::int32_t k = 0; solver.holds(r) && k < rows; ++k)
      if (gone[k] != 0 && !solver.holds(k)) predicted_[r] -= c.entry(r, k) * own_[k];
  solver.solve_held(predicted_);
  double system[kMostRows][kMostRows + 1];
  for (int k = 0; k < count; ++k) {
    std::fill(column_, column_ + rows, 0.0);
    column_[own[k]] = 1;
    solver.solve_held(column_);
    for (int i = 0; i < count; ++i) system[i][k] = column_[own[i]];
    system[k][count] = own_[own[k]] - predicted_[own[k]];
  }
  // Positive definite, so that Gauss-Jordan needs no pivoting.
  for (int i = 0; i < count; ++i) {
    if (!(system[i][i] > 0)) return false;
    for (int r = 0; r < count; ++r) {
      const double factor = r == i ? 0 : system[r][i] / system[i][i];
      for (int k = i; k <= count && factor != 0; ++k) system[r][k] -= factor * system[i][k];
    }
  }
  std::fill(column_, column_ + rows, 0.0);
  for (int k = 0; k < count; ++k) column_[own[k]] = system[k][count] / system[k][k];
  solver.solve_held(column_);
  for (std::int32_t r = 0; r < rows; ++r) predicted_[r] += column_[r];
  for (std::int32_t r = 0; r < rows; ++r)
    if (gone[r] != 0 && !solver.holds(r)) predicted_[r] = own_[r];
  predicted_apart_ = solver.response_bound(predicted_, 0, rows);
  *work += Operations{2 + count} * rows * rows / kDense;
  return true;
}

Vec3 BodyField::predicted_at_node(std::int32_t node, QueryWork* work) {
  if (predicts_rest_) return {};
  return at_node(node, work) - response_at(predicted_, 0, contacts_[contact_count_ - 1].end, node, work);
}

bool BodyField::pulls_among_others(const ContactId& id, Vec3 outward) const {
  const Contact* const own = find(id);
  return own && !alone() && dot(load3(own->force), outward) > 0;
}

double BodyField::own_norm(const ContactId& id) const {
  const Contact* const contact = find(id);
  return contact ? contact->own : 0;
}

double BodyField::norm_without(const ContactId& id) const {
  const Contact* const contact = find(id);
  return moved_norm() + (!contact ? norm_ : alone() ? 0 : norm_ + contact->own);
}

double BodyField::last_change_without(const ContactId& id) const {
  const Contact* const contact = find(id);
  const auto same = [&](const Contact& c) { return c.id == id; };
  const Contact* const before = std::find_if(last_, last_ + last_count_, same);
  const double without_before = before == last_ + last_count_           ? norm_before_
                                : last_count_ == 1 && moved_norm() == 0 ? 0
                                                                        : norm_before_ + before->own;
  const double own = contact ? contact->own_change : before != last_ + last_count_ ? before->own : 0;
  return std::min(last_change() + own,
                  norm_without(id) - moved_norm() + without_before + (offset_ ? offset_->change() : 0));
}

}  // namespace palpate
