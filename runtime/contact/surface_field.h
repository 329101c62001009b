// The displacement of the surface with the bounds and predictions that collision asks for. The linear organ answers by ContactField, a body
// that does not take its displacement from the tensors by a class of its own. Norms are those that surface_tree.h explains: sqrt(J), or
// of a body of its own metres, where a surface node has moved by at most norm().
#pragma once

#include <cstdint>

#include "runtime/base/step_work.h"
#include "runtime/base/vec3.h"
#include "runtime/contact/contact_id.h"
#include "runtime/contact/known_nodes.h"

namespace palpate {

struct ContactDisc;

// The defaults are those of a surface at rest: none is pure, as in body.h.
class SurfaceField {
 public:
  virtual bool empty() const { return true; }
  // The contact ends. The field stays as it is until the next step; predictions are of the others alone.
  virtual void end(const ContactId&) {}

  // m, displacement of a surface node, after the last step.
  Vec3 at_node(std::int32_t node, QueryWork* work) {
    return known_ && known_->has(node) ? known_->at(node) : evaluate_at_node(node, work);
  }
  // The same after the step before. A step does not evaluate both at all nodes where that costs much: the query ends, and the next step
  // asks again.
  virtual Vec3 before_at_node(std::int32_t /*node*/, QueryWork*) { return {}; }
  // The same without the part of the contact.
  virtual Vec3 at_node_without(std::int32_t /*node*/, const ContactId&, QueryWork*) { return {}; }
  // m: of what moves the surface beside the contacts (offset.h), alone.
  virtual bool has_offset() const { return false; }
  virtual Vec3 moved_at_node(std::int32_t /*node*/) const { return {}; }
  // The offset has begun a step: until the next solve the field is that of the last step's contacts, moved by the offset.
  virtual void begin_moved() {}

  // Predicts the field as if the contact ended and all others kept their targets and laws; predicted_at_node() then reads it. False where
  // that takes more than `most`. And the fewest operations that it takes; zero where it is not possible.
  virtual bool predict_without(const ContactId&, Operations /*most*/, Operations*) { return false; }
  virtual Operations operations_to_predict(const ContactId&) const { return 0; }
  virtual Vec3 predicted_at_node(std::int32_t /*node*/, QueryWork*) { return {}; }
  // Whether the contact pulls at the organ along `outward`, with other contacts beside it.
  virtual bool pulls_among_others(const ContactId&, Vec3 /*outward*/) const { return false; }
  // Of the predicted field; of its difference from the field.
  virtual double predicted_norm() const { return 0; }
  virtual double predicted_apart() const { return 0; }

  // Of the field; the sum of the norms of its changes; of the changes since the last step but one.
  virtual double norm() const { return 0; }
  virtual double path() const { return 0; }
  virtual double last_change() const { return 0; }
  // Of the part of one contact; of all others together; of the change of all others by the last step. Upper bounds.
  virtual double own_norm(const ContactId&) const { return 0; }
  virtual double norm_without(const ContactId&) const { return 0; }
  virtual double last_change_without(const ContactId&) const { return 0; }

  // m: as ContactSolver::beyond_mesh(), of the contacts of this field; and how many discs these have.
  virtual Vec3 beyond_mesh(const ContactDisc&, const ContactId&, bool /*predicted*/) const { return {}; }
  virtual std::int32_t discs() const { return 0; }
  // m: the longest way on which a contact holds its place, without that of the contact: no contact moves another place farther. And the sum
  // over the steps of the largest change of such a way.
  virtual double deepest_but(const ContactId&) const { return 0; }
  virtual double sum_of_changes() const { return 0; }

 protected:
  ~SurfaceField() = default;
  virtual Vec3 evaluate_at_node(std::int32_t /*node*/, QueryWork*) { return {}; }
  const KnownNodes* known_ = nullptr;  // what at_node() knows already, where the field remembers it
};

}  // namespace palpate
