#include "runtime/cut/cut_field.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace palpate {
namespace {

// m: farther than any organ reaches.
constexpr double kFar = 1e3;

double longest(const float* u, std::size_t numbers) {
  float most = 0;
  for (std::size_t i = 0; i < numbers; i += 3)
    most = std::max(most, u[i] * u[i] + u[i + 1] * u[i + 1] + u[i + 2] * u[i + 2]);
  return std::sqrt(static_cast<double>(most)) * (1 + 1e-6);
}
double longest_difference(const float* u, const float* v, std::size_t numbers) {
  float most = 0;
  for (std::size_t i = 0; i < numbers; i += 3) {
    const float x = u[i] - v[i], y = u[i + 1] - v[i + 1], z = u[i + 2] - v[i + 2];
    most = std::max(most, x * x + y * y + z * z);
  }
  return std::sqrt(static_cast<double>(most)) * (1 + 1e-6);
}

}  // namespace

bool CutField::create(SceneMemory& memory, const Tensors* tensors, CutResponse* response, const Offset* offset,
                      ContactSolver* solver, const Limits& limits) {
  tensors_ = tensors, response_ = response, offset_ = offset, solver_ = solver;
  numbers_ = 3 * static_cast<std::size_t>(response->surface_nodes());
  const auto nodes = static_cast<std::size_t>(limits.nodes), contacts = static_cast<std::size_t>(limits.constraints),
             rows = CutResponse::kMostRows * response->stride(), parts = (kMostParts + 1) * numbers_;
  nodes_ = memory.array<ContactNode>(nodes), force_ = memory.array<Vec3>(nodes);
  scratch_.force = memory.array<Vec3>(nodes);
  for (float** field : {&now_, &before_, &predicted_.field}) *field = memory.array<float>(numbers_);
  for (float** field : {&parts_, &parts_before_}) *field = memory.array<float>(parts);
  for (Contact** list : {&contacts_, &last_}) *list = memory.array<Contact>(contacts);
  scratch_.line = memory.array<double>(numbers_),
  scratch_.product = memory.array<double>(CutResponse::kMostRows * numbers_);
  scratch_.x = memory.array<double>(rows), scratch_.y = memory.array<double>(rows);
  if (!scratch_.loads.create(memory, limits.nodes)) return false;
  for (std::int32_t* number : {&node_count_, &contact_count_, &last_count_, &moves_, &solved_, &changed_})
    memory.keep(*number);
  memory.keep(norms_), memory.keep(ways_);
  memory.keep_array(nodes_, nodes, node_count_), memory.keep_array(force_, nodes, node_count_);
  for (float** field : {&now_, &before_}) memory.keep_array(*field, numbers_);
  for (float** field : {&parts_, &parts_before_}) memory.keep_array(*field, kMostParts * numbers_);
  memory.keep_array(contacts_, contacts, contact_count_), memory.keep_array(last_, contacts, last_count_);
  return !memory.failed();
}

void CutField::forget() {
  for (float* field : {now_, before_}) std::fill_n(field, numbers_, 0.0f);
  node_count_ = contact_count_ = last_count_ = moves_ = solved_ = changed_ = 0;
  predicted_.norm = predicted_.apart = 0;
  norms_ = {}, ways_ = {}, asked_ = {};
  is_set_ = true;
}

void CutField::copy_node(std::int32_t from, std::int32_t to) {
  const auto copy = [&](float* field) {
    std::copy_n(field + 3 * static_cast<std::size_t>(from), 3, field + 3 * static_cast<std::size_t>(to));
  };
  copy(now_), copy(before_), copy(predicted_.field);
  for (std::int32_t p = 0; p <= kMostParts; ++p) copy(part(parts_, p)), copy(part(parts_before_, p));
}

void CutField::begin_moved() {
  is_set_ = false;
  norms_.path += offset_->stepped();
}

// ---- a step's forces -------------------------------------------------------------------------------------------------

void CutField::gather(const ContactConstraints& set, const Vec3* force) {
  for (std::int32_t p = 0; p < set.constraint_count; ++p) {
    const ContactConstraint& constraint = set.constraints[p];
    Contact* contact = contact_count_ > 0 ? &contacts_[contact_count_ - 1] : nullptr;
    if (!contact || contact->id != constraint.id.contact) {
      contact = &contacts_[contact_count_++];
      *contact = Contact{};
      contact->id = constraint.id.contact, contact->first = constraint.first_node;
      // Collision asks for the parts of tools alone, which come first.
      if (is_of_tool(contact->id) && contact_count_ <= kMostParts)
        contact->part = part_count_++;
      else
        contact->part = -2;
      contact->way = held_way(set, p), contact->place = constraint.discs[0].place;
      contact->radius = constraint.discs[0].radius;
    }
    contact->last = constraint.first_node + constraint.node_count;
    for (std::int32_t e = constraint.first_node; e < contact->last; ++e) contact->force += force[e];
  }
  if (contact_count_ == 1) contacts_[0].part = -1, part_count_ = 0;
}

bool CutField::same_forces(const ContactConstraints& set, const Vec3* force, bool solved) const {
  const auto equal = [](const auto* now, const auto* before, std::int32_t count) {
    return std::memcmp(now, before, static_cast<std::size_t>(count) * sizeof *now) == 0;
  };
  return solved == (solved_ != 0) && changed_ == 0 &&
         (!solved || (set.node_count == node_count_ && equal(set.nodes, nodes_, node_count_) &&
                      equal(force, force_, node_count_)));
}

void CutField::set(const ContactConstraints& set, const Vec3* force, bool solved, Operations* work) {
  const bool same = same_forces(set, force, solved);
  std::swap(contacts_, last_);
  last_count_ = contact_count_, contact_count_ = part_count_ = 0;
  is_set_ = true, asked_ = {};
  norms_.before = norms_.now, norms_.path_before = norms_.path_set;
  if (solved) gather(set, force);
  ways_.measure(contacts_, contact_count_, last_, last_count_);
  solved_ = solved, changed_ = 0;
  node_count_ = solved ? set.node_count : 0;
  std::copy_n(set.nodes, node_count_, nodes_), std::copy_n(force, node_count_, force_);
  if (same && last_count_ == contact_count_) {
    keep_fields();
    *work += static_cast<Operations>(numbers_) / kDense;
  } else {
    find_fields();
    *work += operations_of((contact_count_ > 0) + part_count_);
  }
  if (added_) norms_.path += added_->change();
  norms_.path_set = norms_.path;
}

void CutField::keep_fields() {
  std::copy_n(now_, numbers_, before_);
  for (std::int32_t c = 0; c < contact_count_; ++c) {
    Contact& contact = contacts_[c];
    contact.own = last_[c].own, contact.without = last_[c].without, contact.own_change = 0;
    if (contact.part >= 0) std::copy_n(part(parts_, contact.part), numbers_, part(parts_before_, contact.part));
  }
}

// The field of all contacts and that of each one, under the last forces.
void CutField::evaluate_all() {
  Part parts[CutResponse::kMostRows] = {{0, node_count_, now_}};
  int count = 1;
  for (std::int32_t c = 0; c < part_count_; ++c) {
    if (count == CutResponse::kMostRows) evaluate(force_, parts, count), count = 0;
    parts[count++] = {contacts_[c].first, contacts_[c].last, part(parts_, contacts_[c].part)};
  }
  evaluate(force_, parts, count);
  norms_.now = longest(now_, numbers_);
  moves_ = norms_.now > 0;
}

// By how much a contact moves the surface, and the others without it; how that has changed is not known. Returns its part; nullptr: the part is not known.
const float* CutField::measure(Contact& contact) {
  contact.own = contact.without = contact.own_change = kFar;
  if (contact.part == -2) return nullptr;
  const bool is_alone = contact.part < 0;
  const float* const own = is_alone ? now_ : part(parts_, contact.part);
  contact.own = is_alone ? norms_.now : longest(own, numbers_);
  contact.without = is_alone ? 0 : longest_difference(now_, own, numbers_);
  return own;
}

void CutField::find_fields() {
  std::swap(now_, before_), std::swap(parts_, parts_before_);
  evaluate_all();
  const double change = longest_difference(now_, before_, numbers_);
  norms_.path += change;
  for (std::int32_t c = 0; c < contact_count_; ++c) {
    Contact& contact = contacts_[c];
    const Contact* const before = find_contact(last_, last_count_, contact.id);
    const float* const own = measure(contact);
    if (!own) continue;
    contact.own_change =
        !before ? contact.own
        : before->part == -2
            ? kFar
            : longest_difference(own, before->part < 0 ? before_ : part(parts_before_, before->part), numbers_);
  }
}

const float* CutField::follow_change(double* energy) {
  float* const released = part(parts_, kMostParts);
  asked_ = {};
  std::copy_n(now_, numbers_, released);
  evaluate_all();
  for (std::size_t i = 0; i < numbers_; ++i) released[i] = now_[i] - released[i];
  for (std::int32_t c = 0; c < contact_count_; ++c) measure(contacts_[c]);
  *energy = 0;
  for (std::int32_t e = 0; e < node_count_; ++e) *energy += 0.5 * dot(force_[e], read(released, nodes_[e].node));
  return released;
}

// scratch_.line: C f of the forces on some contact nodes, and what the base adds. A new node has the rows of the node that it comes from.
void CutField::evaluate_line(const Vec3* force, std::int32_t first, std::int32_t last) {
  scratch_.loads.begin(*tensors_);
  for (std::int32_t e = first; e < last; ++e) scratch_.loads.add(nodes_[e].column, solver_->modified(e, force[e]));
  constexpr std::int32_t kRun = 64;
  const std::int32_t at_rest = response_->first_new();
  for (std::int32_t n = 0; n < at_rest; n += kRun) {
    const std::int32_t count = std::min(kRun, at_rest - n);
    double* const to = scratch_.line + 3 * static_cast<std::size_t>(n);
    if (!tensors_->compliance) {
      scratch_.loads.at_run(n, count, to);
      continue;
    }
    for (std::int32_t k = 0; k < count; ++k) store3(scratch_.loads.at_node(n + k), to + 3 * k);
  }
  for (std::int32_t n = at_rest; n < response_->nodes(); ++n)
    std::copy_n(scratch_.line + 3 * static_cast<std::size_t>(response_->at_rest(n)), 3,
                scratch_.line + 3 * static_cast<std::size_t>(n));
  if (response_->fields().base()) add_base(force, first, last);
}

void CutField::add_base(const Vec3* force, std::int32_t first, std::int32_t last) {
  const PatternFields& fields = response_->fields();
  fields.begin_sum();
  for (std::int32_t e = first; e < last; ++e)
    if (!is_zero(force[e])) fields.add_to_sum(nodes_[e].node, force[e]);
  const double* const sum = fields.end_sum();
  for (std::int32_t n = 0; n < response_->nodes(); ++n)
    if (const std::int32_t number = fields.number_in_base(n); number >= 0)
      for (int i = 0; i < 3; ++i) scratch_.line[3 * n + i] += sum[3 * number + i];
}

void CutField::evaluate(const Vec3* force, const Part* parts, int count) {
  const auto stride = response_->stride();
  const bool is_cut = response_->is_cut();
  if (is_cut) {
    std::fill_n(scratch_.x, static_cast<std::size_t>(count) * stride, 0.0);
    for (int p = 0; p < count; ++p)
      for (std::int32_t e = parts[p].first; e < parts[p].last; ++e)
        if (!is_zero(force[e]))
          response_->add_force(nodes_[e].node, force[e], scratch_.x + static_cast<std::size_t>(p) * stride);
    response_->multiply(scratch_.x, count, scratch_.y);
    response_->spread(scratch_.y, count, scratch_.product);
  }
  const std::size_t moving = 3 * static_cast<std::size_t>(response_->nodes());
  for (int p = 0; p < count; ++p) {
    float* const field = parts[p].field;
    evaluate_line(force, parts[p].first, parts[p].last);
    for (std::size_t i = 0; i < moving; ++i)
      field[i] = static_cast<float>(
          is_cut ? scratch_.line[i] + scratch_.product[i * CutResponse::kMostRows + static_cast<std::size_t>(p)]
                 : scratch_.line[i]);
    std::fill(field + moving, field + numbers_, 0.0f);
  }
}

// Of so many fields in a step.
Operations CutField::operations_of(int fields) const {
  const auto numbers = static_cast<Operations>(numbers_), rank = Operations{response_->rank()};
  const Operations of_nodes = Operations{node_count_} * (response_->fields().base() ? 4 : 1);
  return fields * (numbers * (of_nodes + rank) + rank * rank) / kDense + numbers / kDense;
}

// ---- what is asked ---------------------------------------------------------------------------------------------------

void CutField::end(const ContactId& id) {
  auto* const own = const_cast<Contact*>(find(id));
  if (!own || own->ended != 0) return;
  own->ended = 1;
  if (solved_) solver_->end(id);
}

Vec3 CutField::evaluate_at_node(std::int32_t node, QueryWork* work) {
  work->add(3);
  return read(now_, node) + beside_contacts(node);
}

Vec3 CutField::before_at_node(std::int32_t node, QueryWork* work) {
  work->add(3);
  const Vec3 before = read(before_, node) + (is_set_ ? offset_->now(node) : offset_->before(node));
  return added_ ? before + added_->before(node) : before;
}

Vec3 CutField::at_node_without(std::int32_t node, const ContactId& id, QueryWork* work) {
  const Contact* const contact = find(id);
  if (!contact) return at_node(node, work);
  work->add(6);
  if (contact->part == -1) return beside_contacts(node);
  std::int32_t which = contact->part;
  if (which < 0) {
    which = kMostParts;
    if (asked_ != id) {
      if (!work->take(operations_of(1))) return {};
      const Part part_of_contact = {contact->first, contact->last, part(parts_, which)};
      evaluate(force_, &part_of_contact, 1);
      asked_ = id;
    }
  }
  return read(now_, node) - read(part(parts_, which), node) + beside_contacts(node);
}

Operations CutField::operations_to_predict(const ContactId& id) const {
  return solved_ ? solver_->operations_to_predict(id) + operations_of(1) : 0;
}

bool CutField::predict_without(const ContactId& id, Operations most, Operations* work) {
  const Operations own = operations_of(1);
  double norm = 0, apart = 0;  // sqrt(J), of the reactions
  if (!solved_ || own > most || !solver_->predict_without(id, most - own, scratch_.force, &norm, &apart, work))
    return false;
  const auto is_gone = [&](const Contact& c) { return c.ended != 0 || c.id == id; };
  if (std::all_of(contacts_, contacts_ + contact_count_, is_gone)) {
    std::fill_n(predicted_.field, numbers_, 0.0f);
    predicted_.norm = 0, predicted_.apart = norms_.now;
    return true;
  }
  const Part all = {0, node_count_, predicted_.field};
  evaluate(scratch_.force, &all, 1);
  *work += own;
  predicted_.norm = longest(predicted_.field, numbers_);
  predicted_.apart = longest_difference(predicted_.field, now_, numbers_);
  return true;
}

Vec3 CutField::predicted_at_node(std::int32_t node, QueryWork* work) {
  work->add(3);
  return read(predicted_.field, node) + beside_contacts(node);
}

bool CutField::pulls_among_others(const ContactId& id, Vec3 outward) const {
  const Contact* const own = find(id);
  return own && contact_count_ > 1 && dot(own->force, outward) > 0;
}

double CutField::own_norm(const ContactId& id) const {
  const Contact* const contact = find(id);
  return contact ? contact->own : 0;
}

double CutField::norm_without(const ContactId& id) const {
  const Contact* const contact = find(id);
  return moved_norm() + (contact ? contact->without : norms_.now);
}

double CutField::last_change_without(const ContactId& id) const {
  const Contact *const now = find(id), *const before = find_contact(last_, last_count_, id);
  const double own = now ? now->own_change : before ? before->own : 0;
  return std::min(last_change() + own,
                  (now ? now->without : norms_.now) + (before ? before->without : norms_.before) + moved_change());
}

}  // namespace palpate
