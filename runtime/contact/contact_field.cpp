#include "runtime/contact/contact_field.h"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

// Operations that a step spends on measuring the change of the field, contact by contact and as a whole. What is not measured
// counts with the sum of what it was and is.
constexpr Operations kMostMeasuring = 30'000;
// Of one 3 x 3 entry of the tensors.
constexpr Operations kEntry = 15;

// Share of its energy by which the stored tensors' rounding may change the energy of a field: their error, squared for single
// precision because a field and its change see the same error, but not for half precision or packed blocks.
double rounding_of(const Tensors& tensors) {
  constexpr double single = 1e-6, coarse = 1e-3;
  return tensors.compliance || tensors.surface.type == formats::ElementType::f16 ? coarse : single;
}

}  // namespace

bool ContactField::create_layer(SceneMemory& memory, Layer& layer, std::int32_t contacts,
                                std::int32_t surface_nodes) const {
  layer.contacts = memory.array<Contact>(static_cast<std::size_t>(contacts));
  if (!layer.known.create(memory, surface_nodes)) return false;
  memory.keep(layer.contact_count);
  memory.keep(layer.adds);
  memory.keep(layer.norm), memory.keep(layer.linear_norm);
  memory.keep_array(layer.contacts, static_cast<std::size_t>(contacts), layer.contact_count);
  layer.known.keep_state(memory);
  return !memory.failed();
}

bool ContactField::create(SceneMemory& memory, const DisplacementField* field, std::int32_t node_capacity,
                          std::int32_t contact_capacity, std::int32_t surface_nodes) {
  field_ = field, surface_nodes_ = surface_nodes;
  predicted_.force = memory.array<Vec3>(static_cast<std::size_t>(node_capacity));
  norms_ = memory.array<ConstraintNorms>(static_cast<std::size_t>(contact_capacity));
  if (!predicted_.loads.create(memory, node_capacity) || !without_.known.create(memory, surface_nodes) ||
      !predicted_.known.create(memory, surface_nodes) ||
      !create_layer(memory, layer_[0], contact_capacity, surface_nodes) ||
      !create_layer(memory, layer_[1], contact_capacity, surface_nodes))
    return false;
  memory.keep(path_), memory.keep(ways_);
  known_ = &now_->known;
  forget();
  return true;
}

void ContactField::restored(const Tensors& tensors, ContactSolver* solver) {
  tensors_ = &tensors, is_set_ = true;
  without_.id = {};
  solver_ = count() > 0 ? solver : nullptr;  // the last step has left either contacts or a surface at rest
}

void ContactField::forget() {
  for (Layer& layer : layer_) {
    layer.contact_count = layer.adds = 0;
    layer.norm = layer.linear_norm = 0;
    layer.known.forget();
    layer.known.expect(0, false);
  }
  without_.id = {};
  solver_ = nullptr;
  path_ = {}, ways_ = {};
}

template <class Added>
Vec3 ContactField::recall(KnownNodes& known, std::int32_t node, const LoadField& loads, QueryWork* work,
                          Added added) const {
  return known.recall(node, loads, !tensors_->compliance, operations_moved(), work, added);
}

void ContactField::swap_layers() {
  is_set_ = true;
  std::swap(layer_[0], layer_[1]);
  path_.before = path_.set;
  now_->contact_count = now_->adds = 0;
  now_->known.forget();
  without_.id = {};
}

void ContactField::begin_moved() {
  is_set_ = false;
  if (offset_->stepped() == 0) return;
  path_.now += offset_->stepped() / moved_reach_;
  now_->known.forget();
  without_.id = {};
}

void ContactField::set_rest() {
  swap_layers();
  solver_ = nullptr;
  now_->norm = now_->linear_norm = 0, path_.now += before_->norm;
  if (added_ && offset_) path_.now += added_->change() / reach_;
  path_.set = path_.now;
  measure_ways();
}

void ContactField::set(const Tensors& tensors, const ContactConstraints& set, const Vec3* force, ContactSolver* solver,
                       Operations most, Operations* work) {
  tensors_ = &tensors;
  swap_layers();
  solver_ = solver;
  Layer& now = *now_;
  nodes_ = set.nodes, force_ = force;
  now.known.expect(field_->loads().acting(), before_->known.are_all());
  const bool measured = solver->operations_to_measure() <= most;
  const ReactionNorms norms = measured ? solver->measure_norms(set, norms_) : solver->bound_norms(set, norms_);
  *work += norms.operations;
  now.norm = now.linear_norm = norms.whole;
  gather_contacts(set, norms_, measured);
  measure_ways();
  if (added_ && !offset_ && count() > 0) share_added_field();
  if (measured) remember_held_nodes(set, norms_);
  // However much changed, the field went from one norm to the other.
  double change = std::min(measure_contacts(norms.change_of_kept, most - *work, work), before_->norm + now.norm);
  if (change > norms.change_of_kept || !measured) change = std::min(change, measure_whole_change(most - *work, work));
  if ((now.adds && before_->adds) || (added_ && offset_)) change += added_->change() / reach_;
  if (now.adds != before_->adds) change = before_->norm + now.norm;
  path_.now += change;
  path_.set = path_.now;
}

// Sums the norms of the constraints of each contact. The constraints of a contact are neighbours in the list.
void ContactField::gather_contacts(const ContactConstraints& set, const ConstraintNorms* each, bool measured) {
  Layer& now = *now_;
  for (std::int32_t p = 0; p < set.constraint_count; ++p) {
    const ContactConstraint& constraint = set.constraints[p];
    Contact* last = now.contact_count > 0 ? &now.contacts[now.contact_count - 1] : nullptr;
    if (!last || last->id != constraint.id.contact) {
      last = &now.contacts[now.contact_count++];
      *last = {};
      last->id = constraint.id.contact, last->first = constraint.first_node;
      last->ratio = 1, last->kept = true;
      last->way = held_way(set, p), last->place = constraint.discs[0].place, last->radius = constraint.discs[0].radius;
    }
    last->last = constraint.first_node + constraint.node_count;
    for (std::int32_t e = constraint.first_node; e < last->last; ++e) last->force += force_[e];
    last->own += each[p].own;
    last->own_change += each[p].own_change;
    last->work += each[p].work;
    last->kept = last->kept && each[p].kept;
  }
  // |f - g|^2 = |f|^2 - 2 f C g + |g|^2 in the norm of energy.
  for (std::int32_t c = 0; c < now.contact_count; ++c) {
    Contact& contact = now.contacts[c];
    const double squared = now.norm * now.norm - 2 * contact.work + contact.own * contact.own;
    contact.without = now.contact_count == 1 ? 0
                      : measured ? std::min(now.norm + contact.own, std::sqrt(std::max(0.0, squared)) + 1e-7 * now.norm)
                                 : now.norm + contact.own;
  }
}

void ContactField::measure_ways() {
  ways_.measure(now_->contacts, now_->contact_count, before_->contacts, before_->contact_count);
}

// What each contact makes of the added field, and what that adds to the norms.
void ContactField::share_added_field() {
  // Bounds of the ratio: where the two fields point apart, it has no meaning.
  constexpr double least = 0.25, most = 4;
  Layer& now = *now_;
  now.adds = 1;
  const double longest = added_->longest() / reach_;
  now.norm += longest;
  for (std::int32_t c = 0; c < now.contact_count; ++c) {
    Contact& contact = now.contacts[c];
    double beside = 0;  // J, of the contact's forces
    for (std::int32_t e = contact.first; e < contact.last; ++e) beside += dot(force_[e], added_->now(nodes_[e].node));
    contact.ratio = contact.work > 0 ? std::clamp((contact.work + beside) / contact.work, least, most) : 1;
    if (now.contact_count > 1) contact.without += longest + std::fabs(contact.ratio - 1) * contact.own;
    const Contact* const before = find(*before_, contact.id);
    if (before) contact.ratio_change = std::fabs(contact.ratio - before->ratio) * before->own;
  }
}

// A constraint that holds one node along all axes knows the displacement of this node.
void ContactField::remember_held_nodes(const ContactConstraints& set, const ConstraintNorms* each) {
  constexpr std::uint32_t all_axes = 7;
  for (std::int32_t p = 0; p < set.constraint_count; ++p) {
    const ContactConstraint& constraint = set.constraints[p];
    const ContactNode& held = set.nodes[constraint.first_node];
    if (constraint.node_count != 1 || held.weight != 1 || constraint.axes != all_axes) continue;
    const Vec3 along = each[p].displacement;
    if (now_->known.has(held.node)) continue;
    now_->known.keep(held.node, (constraint.framed ? transposed_times(constraint.frame, along) : along) +
                                    added_at(*now_, held.node));
  }
}

// The change from the layer before to this one, contact by contact: what the contacts with old rows changed together, plus each
// contact that came, went or changed its rows. An upper bound on the norm of the whole change.
double ContactField::measure_contacts(double kept, Operations most, Operations* work) {
  double change = kept;
  Operations left = std::min(kMostMeasuring, most);
  std::int32_t b = 0;
  for (std::int32_t c = 0; c < now_->contact_count; ++c) {
    Contact& now = now_->contacts[c];
    for (; b < before_->contact_count && before_->contacts[b].id < now.id; ++b) change += before_->contacts[b].own;
    const bool known = b < before_->contact_count && before_->contacts[b].id == now.id;
    const Contact* before = known ? &before_->contacts[b++] : nullptr;
    if (now.kept && known) continue;
    now.own_change = known ? now.own + before->own : now.own;
    const Operations cost = known ? kEntry * (now.last - now.first) * (before->last - before->first) : 0;
    if (known && cost <= left && !has_given()) {
      now.own_change = change_of(*before, now);
      left -= cost, *work += cost;
    }
    change += now.own_change;
  }
  for (; b < before_->contact_count; ++b) change += before_->contacts[b].own;
  return change;
}

// |f - g|, from |f|, |g| and f C g. The norms are upper bounds.
double ContactField::norm_of_difference(double f, double g, double between) const {
  const double sum = f + g, squared = f * f + g * g - 2 * between + rounding_of(*tensors_) * sum * sum;
  return squared <= sum * sum ? std::sqrt(std::max(0.0, squared)) : sum;  // also where it is not a number
}

// The norm of the difference between a contact's forces in two steps, from the tensors between its nodes.
double ContactField::change_of(const Contact& before, const Contact& now) const {
  double between = 0;
  const LoadField& loads = field_->loads_before();
  for (std::int32_t i = now.first; i < now.last; ++i)
    for (std::int32_t j = before.first; j < before.last; ++j)
      between += dot(force_[i], tensors_->displacement(nodes_[i].node, loads.column(j)) * loads.modified(j));
  return norm_of_difference(now.own, before.own, between);
}

// m, of any node that a contact holds, by the contacts of the layer before alone. Nodes inside are not remembered.
Vec3 ContactField::held_before(std::int32_t node, QueryWork* work) {
  if (node < surface_nodes_) return before_at_node(node, work) - added_at(*before_, node);
  const LoadField& loads = field_->loads_before();
  if (!work->take(kEntry * loads.count())) return {};
  const Vec3 u = loads.at_node(node);
  return has_given() ? u + given_at(*before_, node) : u;
}

// The norm of the difference between the two layers: the forces of now act on the displacements of before. Infinite where too
// many of these displacements are not known yet.
double ContactField::measure_whole_change(Operations most, Operations* work) {
  Operations cost = 0;
  const LoadField& before = field_->loads_before();
  for (std::int32_t e = 0; e < count(); ++e)
    if (nodes_[e].node >= surface_nodes_)
      cost += kEntry * before.count();
    else if (!before_->known.has(nodes_[e].node))
      cost += KnownNodes::alone(before.acting());
  most = std::min(kMostMeasuring, most);
  if (cost > most) return INFINITY;
  double between = 0;
  QueryWork queries;
  queries.limit(most);
  for (std::int32_t e = 0; e < count(); ++e) between += dot(force_[e], held_before(nodes_[e].node, &queries));
  *work += queries.done();
  if (queries.ended()) return INFINITY;
  return norm_of_difference(now_->linear_norm, before_->linear_norm, between);
}

const ContactField::Contact* ContactField::find(const Layer& layer, const ContactId& id) {
  return find_contact(layer.contacts, layer.contact_count, id);
}

double ContactField::own_norm(const ContactId& id) const {
  const Contact* contact = find(*now_, id);
  if (contact && now_->adds && now_->contact_count == 1) return now_->norm;
  return contact ? contact->ratio * contact->own : 0;
}

double ContactField::norm_without(const ContactId& id) const {
  const Contact* contact = find(*now_, id);
  return (contact ? contact->without : now_->norm) + moved_norm();
}

double ContactField::last_change_without(const ContactId& id) const {
  const Contact *now = find(*now_, id), *before = find(*before_, id);
  const double own = now ? now->ratio * now->own_change + now->ratio_change : before ? before->ratio * before->own : 0;
  return std::min(last_change() + own,
                  (now ? now->without : now_->norm) + (before ? before->without : before_->norm) + moved_change());
}

bool ContactField::pulls_among_others(const ContactId& id, Vec3 outward) const {
  const Contact* own = find(*now_, id);
  if (!own || now_->contact_count == 1) return false;
  return dot(own->force, outward) > 0;
}

void ContactField::end(const ContactId& id) {
  Contact* const own = const_cast<Contact*>(find(*now_, id));
  if (!own || own->ended) return;
  own->ended = true;
  if (solver_) solver_->end(id);
}

Operations ContactField::operations_to_predict(const ContactId& id) const {
  return !solver_ ? 0 : solver_->operations_to_predict(id);
}

bool ContactField::predict_without(const ContactId& id, Operations most, Operations* work) {
  predicted_.known.forget();
  if (!solver_ || !solver_->predict_without(id, most, predicted_.force, &predicted_.norm, &predicted_.apart, work))
    return false;
  const LoadField& loads = field_->loads();
  predicted_.loads.begin(*tensors_);
  for (std::int32_t e = 0; e < loads.count(); ++e)
    predicted_.loads.add(loads.column(e), solver_->modified(e, predicted_.force[e]));
  if (has_given()) {
    std::fill_n(predicted_.given, offset_->count(), 0.0);
    for (std::int32_t e = 0; e < loads.count(); ++e)
      offset_->followers().subtract_force(solver_->matrix().held().nodes[e].node, predicted_.force[e],
                                          predicted_.given);
    offset_->followers().solve(predicted_.given);
  }
  predicted_.known.expect(predicted_.loads.acting(), now_->known.are_all());
  predicted_.own = find(*now_, id);
  if (!now_->adds) return true;
  std::int32_t gone = 0;
  for_gone([&](const Contact&) { ++gone; });
  predicted_.is_rest = gone == now_->contact_count;
  if (predicted_.is_rest) {
    predicted_.norm = 0, predicted_.apart = now_->norm;
    return true;
  }
  predicted_.norm += added_->longest() / reach_;
  for_gone([&](const Contact& contact) {
    const double beside = std::fabs(contact.ratio - 1) * contact.own;
    predicted_.norm += beside, predicted_.apart += beside;
  });
  return true;
}

// Calls visit(Contact) for all contacts without which the field is predicted.
template <class Visit>
void ContactField::for_gone(Visit visit) const {
  for (const Contact* c = now_->contacts; c != now_->contacts + now_->contact_count; ++c)
    if (c->ended || c == predicted_.own) visit(*c);
}

Vec3 ContactField::predicted_at_node(std::int32_t node, QueryWork* work) {
  if (now_->adds && predicted_.is_rest) return {};
  return recall(predicted_.known, node, predicted_.loads, work, [&](std::int32_t n) {
    if (!now_->adds)
      return has_given() ? moved_at(*now_, n) + offset_->given_by(predicted_.given, n) : moved_at(*now_, n);
    Vec3 added = added_->now(n);
    for_gone([&](const Contact& gone) {
      added = added - (gone.ratio - 1) * field_->loads().at_node(n, gone.first, gone.last);
    });
    return added;
  });
}

Vec3 ContactField::known_at(Layer& layer, std::int32_t node, QueryWork* work) const {
  if (loads(layer).count() == 0) return offset_ && work->take(operations_moved()) ? moved_at(layer, node) : Vec3{};
  return recall(layer.known, node, loads(layer), work, [&](std::int32_t n) {
    return has_given() ? added_at(layer, n) + given_at(layer, n) : added_at(layer, n);
  });
}

Vec3 ContactField::before_at_node(std::int32_t node, QueryWork* work) {
  const KnownNodes& before = before_->known;
  if (before.all_cost_much(field_->loads_before().acting()) && !before.has(node) && before.are_many() &&
      now_->known.are_all())
    work->end();
  return known_at(*before_, node, work);
}

Vec3 ContactField::at_node_without(std::int32_t node, const ContactId& id, QueryWork* work) {
  Without& asked = without_;
  if (id != asked.id) {
    asked.id = id;
    asked.contact = find(*now_, id);
    asked.known.forget();
    if (asked.contact && has_given())
      solver_->matrix().find_given(*offset_, solver_->system().reactions(), id, asked.given);
  }
  if (!asked.contact) return at_node(node, work);
  if (now_->contact_count == 1) return moved_at(*now_, node);
  if (asked.known.has(node)) return asked.known.at(node);
  const Vec3 all = at_node(node, work);
  const LoadField& loads = field_->loads();
  const std::int32_t first = asked.contact->first, last = asked.contact->last;
  if (!work->take(KnownNodes::alone(loads.acting(first, last)))) return {};
  Vec3 linear = loads.at_node(node, first, last);
  if (has_given()) linear += offset_->given_by(asked.given, node);
  const double ratio = asked.contact->ratio;
  return asked.known.keep(node, all - (ratio == 1 ? linear : ratio * linear));
}

}  // namespace palpate
