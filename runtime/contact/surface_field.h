// The displacement of the surface with the bounds and predictions that collision asks for, of a body that does not take it from the
// tensors. ContactField answers these questions for the linear organ, and states them. Norms are lengths: a surface node has moved by at
// most norm() metres.
#pragma once

#include <cstdint>

#include "runtime/base/step_work.h"
#include "runtime/base/vec3.h"
#include "runtime/contact/contact_id.h"

namespace palpate {

// A body overrides all of them: none is pure, as in body.h.
class SurfaceField {
 public:
  virtual bool empty() const { return true; }
  virtual void end(const ContactId&) {}
  virtual Vec3 at_node(std::int32_t /*node*/, QueryWork*) const { return {}; }
  virtual Vec3 before_at_node(std::int32_t /*node*/, QueryWork*) const { return {}; }
  virtual Vec3 at_node_without(std::int32_t /*node*/, const ContactId&, QueryWork*) const { return {}; }
  virtual bool predict_without(const ContactId&, Operations*) { return false; }
  virtual Vec3 predicted_at_node(std::int32_t /*node*/, QueryWork*) const { return {}; }
  virtual bool pulls_among_others(const ContactId&, Vec3 /*outward*/) const { return false; }
  virtual double predicted_norm() const { return 0; }
  virtual double predicted_apart() const { return 0; }
  virtual double norm() const { return 0; }
  virtual double path() const { return 0; }
  virtual double last_change() const { return 0; }
  virtual double own_norm(const ContactId&) const { return 0; }
  virtual double norm_without(const ContactId&) const { return 0; }
  virtual double last_change_without(const ContactId&) const { return 0; }

 protected:
  ~SurfaceField() = default;
};

}  // namespace palpate
