// The displacement of the linear organ's surface as collision asks for it (surface_field.h): displacement_field.h, of which it remembers
// the nodes that were evaluated, with predictions and bounds.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/bundle/tensors.h"
#include "runtime/contact/added_field.h"
#include "runtime/contact/contact_solver.h"
#include "runtime/contact/contact_ways.h"
#include "runtime/contact/displacement_field.h"
#include "runtime/contact/known_nodes.h"
#include "runtime/contact/offset.h"
#include "runtime/contact/surface_field.h"
#include "runtime/surface/surface_tree.h"

namespace palpate {

class ContactField final : public SurfaceField {
 public:
  // field: of the same contacts, set before this one. borrowed.
  bool create(SceneMemory& memory, const DisplacementField* field, std::int32_t node_capacity,
              std::int32_t contact_capacity, std::int32_t surface_nodes);
  // What `added` has adds to the contacts' field, while there are contacts. A contact that is alone makes all of it. Of several, each makes
  // as many times its own linear part as its nodes move, along its forces, farther than the linear field moves them. Beside an offset it is
  // there without contacts, too, and belongs to none. reach: m / sqrt(J), the same for all nodes. borrowed.
  void add(const AddedField* added, double reach) { added_ = added, reach_ = reach; }
  // The offset adds to the contacts' field, with contacts and without. It belongs to no contact.
  // reach: m / sqrt(J), in which its length is stated as a norm (set_reaches of the scene). borrowed.
  void move(const Offset* offset, double reach) { offset_ = offset, moved_reach_ = reach; }
  bool has_offset() const override { return offset_ != nullptr; }
  Vec3 moved_at_node(std::int32_t node) const override { return offset_ ? offset_->now(node) : Vec3{}; }
  void begin_moved() override;
  bool exists() const { return field_ != nullptr; }
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

  bool empty() const override { return count() == 0 && !offset_; }
  void end(const ContactId& id) override;
  Vec3 before_at_node(std::int32_t node, QueryWork* work) override;
  Vec3 at_node_without(std::int32_t node, const ContactId& id, QueryWork* work) override;

  bool predict_without(const ContactId& id, Operations most, Operations* work) override;
  Operations operations_to_predict(const ContactId& id) const override;
  Vec3 predicted_at_node(std::int32_t node, QueryWork* work) override;
  bool pulls_among_others(const ContactId& id, Vec3 outward) const override;
  double predicted_norm() const override { return predicted_.norm + moved_norm(); }
  double predicted_apart() const override { return predicted_.apart; }

  double norm() const override { return now_->norm + moved_norm(); }
  double path() const override { return path_.now; }
  double last_change() const override { return path_.now - path_.before; }
  double own_norm(const ContactId& id) const override;
  double norm_without(const ContactId& id) const override;
  double last_change_without(const ContactId& id) const override;

  Vec3 beyond_mesh(const ContactDisc& disc, const ContactId& id, bool predicted) const override {
    return solver_ ? solver_->beyond_mesh(disc, id, predicted) : Vec3{};
  }
  std::int32_t discs() const override { return solver_ ? solver_->matrix().held().discs : 0; }
  double deepest_but(const ContactId& id) const override { return ways_.deepest_but(id); }
  double sum_of_changes() const override { return ways_.sum_of_changes; }

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
  // One field: its contacts, and what was evaluated. A surface at rest has no contacts.
  struct Layer {
    Contact* contacts;  // ascending
    std::int32_t contact_count;
    std::int32_t adds;  // the added field counts: its step's in the layer of now, the one before in the other
    KnownNodes known;
    double norm, linear_norm;  // sqrt(J), of the contacts' field with and without the added one
  };
  // A field without some contact, at least. given: g (offset.h) of its forces.
  struct Prediction {
    Vec3* force = nullptr;  // [node_capacity] N
    LoadField loads;
    KnownNodes known;
    double given[kMostOffsetRows] = {};
    const Contact* own = nullptr;  // the contact that predict_without() takes away
    bool is_rest = false;          // with an added field: no contact is left
    double norm = 0, apart = 0;    // sqrt(J)
  };
  struct Without {
    KnownNodes known;
    double given[kMostOffsetRows] = {};  // g of the contact's forces
    ContactId id;
    const Contact* contact = nullptr;
  };
  struct Path {
    double now = 0, set = 0, before = 0;  // sqrt(J); after the last set(); after the one before
  };

  // The field remembers it until the next set(). Where many nodes have been asked for, it evaluates all others at once.
  Vec3 evaluate_at_node(std::int32_t node, QueryWork* work) override { return known_at(*now_, node, work); }
  bool create_layer(SceneMemory& memory, Layer& layer, std::int32_t contacts, std::int32_t surface_nodes) const;
  const LoadField& loads(const Layer& layer) const { return &layer == now_ ? field_->loads() : field_->loads_before(); }
  std::int32_t count() const { return field_->loads().count(); }
  void swap_layers();
  template <class Added>
  Vec3 recall(KnownNodes& known, std::int32_t node, const LoadField& loads, QueryWork* work, Added added) const;
  // Of what the contacts do not make.
  Vec3 added_at(const Layer& layer, std::int32_t node) const {
    return layer.adds ? moved_at(layer, node) + body_adds(layer, node) : moved_at(layer, node);
  }
  Vec3 body_adds(const Layer& layer, std::int32_t node) const {
    return &layer == now_ ? added_->now(node) : added_->before(node);
  }
  // Of what belongs to no contact.
  Vec3 moved_at(const Layer& layer, std::int32_t node) const {
    if (!offset_) return {};
    const Vec3 moved = &layer == now_ || is_set_ ? offset_->now(node) : offset_->before(node);
    return added_ ? moved + body_adds(layer, node) : moved;
  }
  bool has_given() const { return offset_ && offset_->has_given(); }
  // m, B g (offset.h): the contacts make it, beside their loads.
  Vec3 given_at(const Layer& layer, std::int32_t node) const {
    return &layer == now_ ? offset_->given(node) : offset_->given_before(node);
  }
  double moved_norm() const {
    return !offset_ ? 0 : (added_ ? offset_->longest() + added_->longest() : offset_->longest()) / moved_reach_;
  }
  double moved_change() const {
    return !offset_ ? 0 : (added_ ? offset_->change() + added_->change() : offset_->change()) / moved_reach_;
  }
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
  Prediction predicted_;
  Without without_;
  ConstraintNorms* norms_ = nullptr;  // [contact_capacity]
  ContactSolver* solver_ = nullptr;   // of the contacts; nullptr where the surface is at rest
  std::int32_t surface_nodes_ = 0;
  Path path_;
  ContactWays ways_;
};

}  // namespace palpate
