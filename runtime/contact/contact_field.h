// What collision asks of the displacement field (displacement_field.h): it remembers the nodes that were evaluated, predicts the field
// without a contact, and has bounds on how far the field moves any node.
#pragma once

#include <cassert>
#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/bundle/tensors.h"
#include "runtime/contact/added_field.h"
#include "runtime/contact/contact_solver.h"
#include "runtime/contact/displacement_field.h"
#include "runtime/contact/offset.h"
#include "runtime/contact/surface_field.h"
#include "runtime/surface/surface_tree.h"

namespace palpate {

class ContactField {
 public:
  // Share of the nodes that is evaluated one by one before all others are at once; where the field before was evaluated at all nodes,
  // the smaller one. For many contact nodes fewer: so many operations at most. Where the query has no room for all at once, one by one.
  static constexpr std::int32_t kFew = 3, kFewAgain = 32;
  static constexpr Operations kMostOneByOne = 60'000;

  // field: of the same contacts, set before this one. borrowed.
  bool create(SceneMemory& memory, const DisplacementField* field, std::int32_t node_capacity,
              std::int32_t contact_capacity, std::int32_t surface_nodes);
  // In place of create(): the field of a body that has its own answers all that is asked. borrowed.
  void follow(SurfaceField* body) { body_ = body; }
  // Beside create(): what `added` has adds to the contacts' field, while there are contacts. A contact that is alone makes all of it. Of
  // several, each makes as many times its own linear part as its nodes move, along its forces, farther than the linear field moves
  // them. reach: m / sqrt(J), the same for all nodes. borrowed.
  void add(const AddedField* added, double reach) { added_ = added, reach_ = reach; }
  // Beside create(): the offset adds to the contacts' field, with contacts and without. It belongs to no contact.
  // reach: m / sqrt(J), in which its length is stated as a norm (set_reaches of the scene). borrowed.
  void move(const Offset* offset, double reach) { offset_ = offset, moved_reach_ = reach; }
  bool has_offset() const { return offset_ != nullptr; }
  // m, of a surface node: the offset alone.
  Vec3 moved_at_node(std::int32_t node) const { return offset_ ? offset_->now(node) : Vec3{}; }
  // The offset has begun a step: until set() the field is that of the last step's contacts, moved by the offset.
  void begin_moved();
  bool exists() const { return body_ || field_; }
  void forget();
  // Completes a restored state (scene_memory.h) by what follows from it.
  void restored(const Tensors& tensors, ContactSolver* solver);

  // Takes over the solved contacts of a step. solver: has solved these constraints; predict_without() asks it later.
  // Cost: two products with the contact matrix. Where contacts have new rows, also what measuring their change takes: for each of
  // them nodes^2 entries of the tensors, and the displacement of its nodes before, within a fixed number of operations. Norms that do
  // not fit into `most` operations are replaced by their bounds.
  void set(const Tensors& tensors, const ContactConstraints& set, const Vec3* force, ContactSolver* solver,
           Operations most, Operations* work);
  // A step without a solution: the surface is at rest.
  void set_rest();
  bool empty() const { return body_ ? body_->empty() : count() == 0 && !offset_; }

  // The contact ends. The field stays as it is until the next set(); predictions are of the others alone.
  void end(const ContactId& id);

  // Displacement of a surface node, m. The field remembers it until the next set(). Where many have been asked for, it evaluates
  // all others at once.
  Vec3 at_node(std::int32_t node, QueryWork* work) {
    return !body_ && is_known(now_->known, node) ? now_->known.at[node] : evaluate_at_node(node, work);
  }
  // The same of the field before the last set(). A step does not evaluate both fields at all nodes where that costs much: the query
  // ends, and in the next step this field is the one before.
  Vec3 before_at_node(std::int32_t node, QueryWork* work);
  // The same without the part of the contact.
  Vec3 at_node_without(std::int32_t node, const ContactId& id, QueryWork* work);

  // Predicts the field as if the contact ended and all others kept their targets and laws; predicted_at_node()
  // then reads it. False where the prediction takes more than `most`.
  bool predict_without(const ContactId& id, Operations most, Operations* work);
  // The fewest operations that it takes; zero where it is not possible.
  Operations operations_to_predict(const ContactId& id) const;
  Vec3 predicted_at_node(std::int32_t node, QueryWork* work);
  // Whether the contact pulls at the organ along `outward`, with other contacts beside it.
  bool pulls_among_others(const ContactId& id, Vec3 outward) const;
  // sqrt(J): of the predicted field; of its difference from the field.
  double predicted_norm() const { return body_ ? body_->predicted_norm() : predicted_norm_ + moved_norm(); }
  double predicted_apart() const { return body_ ? body_->predicted_apart() : predicted_apart_; }

  // m: as ContactSolver::beyond_mesh(), of the contacts of this field.
  Vec3 beyond_mesh(const ContactDisc& disc, const ContactId& id, bool predicted) const {
    return solver_ && !body_ ? solver_->beyond_mesh(disc, id, predicted) : Vec3{};
  }
  std::int32_t discs() const { return solver_ && !body_ ? solver_->matrix().held().discs : 0; }
  // m: the longest way on which a contact holds its place, without that of `id`. No contact moves another place farther.
  double deepest_but(const ContactId& id) const {
    return body_ ? 0 : deepest_.id == id ? second_deepest_ : deepest_.way;
  }
  // m: the sum over the steps of the largest change of such a way.
  double sum_of_changes() const { return body_ ? 0 : sum_of_changes_; }

  // sqrt(J), as surface_tree.h explains: of the field; the sum of the norms of its changes; of the changes since the last set()
  // but one.
  double norm() const { return body_ ? body_->norm() : norm_ + moved_norm(); }
  double path() const { return body_ ? body_->path() : path_; }
  double last_change() const { return body_ ? body_->last_change() : path_ - path_before_; }
  // Of the part of one contact; of all others together; of the change of all others by the last set(). Upper bounds.
  double own_norm(const ContactId& id) const;
  double norm_without(const ContactId& id) const;
  double last_change_without(const ContactId& id) const;

 private:
  struct Contact {
    ContactId id;
    std::int32_t first, last;         // its contact nodes
    bool kept;                        // its rows are those of the step before
    bool ended;                       // since the last set()
    bool unused[2];                   // in the place of padding, which a saved state would hold
    double own, without, own_change;  // sqrt(J)
    // Of what it makes to its linear part, whose norms the others are; 1 without an added field. And what its change adds to own_change.
    double ratio, ratio_change;
    double work;    // J, of its forces on the linear field
    Vec3 force;     // N, the sum of its forces on the organ
    Vec3 way;       // m, on which it holds its place
    Vec3 place;     // m, of its disc at rest
    double radius;  // m, of its disc; 0: it has none
  };
  // Displacements that were evaluated since the last forget().
  struct Known {
    Vec3* at;              // [surface_nodes] m
    std::uint32_t* stamp;  // [surface_nodes] of the evaluation
    std::uint32_t now;
    std::int32_t count;  // nodes that were evaluated one by one; surface_nodes + 1: all were, at once
    std::int32_t few;    // of these, before all others are
  };
  // One field: its contacts, and what was evaluated. A surface at rest has no contacts.
  struct Layer {
    Contact* contacts;  // ascending
    std::int32_t contact_count;
    std::int32_t adds;  // the added field counts: its step's in the layer of now, the one before in the other
    Known known;
  };
  bool create_known(SceneMemory& memory, Known& known) const;
  bool create_layer(SceneMemory& memory, Layer& layer, std::int32_t contacts) const;
  const LoadField& loads(const Layer& layer) const { return &layer == now_ ? field_->loads() : field_->loads_before(); }
  std::int32_t count() const { return field_->loads().count(); }
  void swap_layers();
  void forget_nodes(Known& known) const;
  static Vec3 keep(Known& known, std::int32_t node, Vec3 u);
  // added(node): m, beside the loads.
  template <class Added>
  Vec3 recall(Known& known, std::int32_t node, const LoadField& loads, QueryWork* work, Added added) const;
  // Contacts hold nodes of the surface; other constraints may hold nodes inside: Known has no entry for these.
  bool is_on_surface(std::int32_t node) const { return node < surface_nodes_; }
  bool is_known(const Known& known, std::int32_t node) const {
    assert(is_on_surface(node));
    return known.stamp[node] == known.now;
  }
  Vec3 evaluate_at_node(std::int32_t node, QueryWork* work);
  static bool are_many(const Known& known) { return known.count > known.few; }
  bool are_all(const Known& known) const { return known.count > surface_nodes_; }
  void expect(Known& known, std::int32_t contact_nodes, bool many) const;
  template <class Added>
  bool evaluate_all(Known& known, const LoadField& loads, QueryWork* work, Added added) const;
  // Of what the contacts do not make.
  Vec3 added_at(const Layer& layer, std::int32_t node) const {
    Vec3 sum = moved_at(layer, node);
    if (layer.adds) sum += &layer == now_ ? added_->now(node) : added_->before(node);
    return sum;
  }
  Vec3 moved_at(const Layer& layer, std::int32_t node) const {
    if (!offset_) return {};
    return &layer == now_ || is_set_ ? offset_->now(node) : offset_->before(node);
  }
  bool has_given() const { return offset_ && offset_->has_given(); }
  // m, B g (offset.h): the contacts make it, beside their loads.
  Vec3 given_at(const Layer& layer, std::int32_t node) const {
    return &layer == now_ ? offset_->given(node) : offset_->given_before(node);
  }
  double moved_norm() const { return offset_ ? offset_->longest() / moved_reach_ : 0; }
  double moved_change() const { return offset_ ? offset_->change() / moved_reach_ : 0; }
  Operations operations_moved() const { return offset_ ? (has_given() ? 2 : 1) * offset_->count() : 0; }
  void share_added_field();
  template <class Visit>
  void for_gone(Visit visit) const;
  static const Contact* find(const Layer& layer, const ContactId& id);
  void gather_contacts(const ContactConstraints& set, const ConstraintNorms* each, bool measured);
  void remember_held_nodes(const ContactConstraints& set, const ConstraintNorms* each);
  double measure_contacts(double kept, Operations most, Operations* work);
  void measure_ways();
  Vec3 held_before(std::int32_t node, QueryWork* work);
  double measure_whole_change(Operations most, Operations* work);
  double norm_of_difference(double f, double g, double between) const;
  double change_of(const Contact& before, const Contact& now) const;
  Vec3 known_at(Layer& layer, std::int32_t node, QueryWork* work) const;

  SurfaceField* body_ = nullptr;
  const DisplacementField* field_ = nullptr;
  const AddedField* added_ = nullptr;
  double reach_ = 1;
  const Offset* offset_ = nullptr;
  double moved_reach_ = 1;
  bool is_set_ = true;  // since begin_moved()
  const Tensors* tensors_ = nullptr;
  // Of the set() that goes on: the nodes of the loads, and N, on each.
  const ContactNode* nodes_ = nullptr;
  const Vec3* force_ = nullptr;
  Layer layer_[2] = {};
  Layer *const now_ = layer_, *const before_ = layer_ + 1;
  Vec3* predicted_ = nullptr;  // [node_capacity] N
  LoadField predicted_loads_;
  // Of the field without one contact, and of the predicted one.
  Known known_without_ = {}, known_predicted_ = {};
  // g (offset.h): of the predicted forces; of those of the contact without which the field is asked.
  double predicted_given_[kMostOffsetRows] = {}, without_given_[kMostOffsetRows] = {};
  ContactId without_id_;
  const Contact* without_ = nullptr;
  const Contact* predicted_own_ = nullptr;  // the contact that predict_without() takes away
  bool predicts_rest_ = false;              // with an added field: no contact is left
  ConstraintNorms* norms_ = nullptr;        // [contact_capacity]
  ContactSolver* solver_ = nullptr;         // of the contacts; nullptr where the surface is at rest
  std::int32_t surface_nodes_ = 0;
  double norm_ = 0, norm_before_ = 0, predicted_norm_ = 0, predicted_apart_ = 0;
  double linear_norm_ = 0, linear_norm_before_ = 0;   // of the contacts' field, without the added one
  double path_ = 0, path_set_ = 0, path_before_ = 0;  // now; after the last set(); after the one before
  struct Deepest {
    double way = 0;  // m
    ContactId id;
    std::int32_t unused = 0;  // in the place of padding, which a saved state would hold
  };
  Deepest deepest_;
  double second_deepest_ = 0, sum_of_changes_ = 0;  // m
};

}  // namespace palpate
