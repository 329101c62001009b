// The field of an organ after a solve, at any node: u = o + C f + B g (offset.h). The offset o is what moves the nodes beside the forces f at the contacts:
// rows with amounts (offset.h), and what the body adds to the linear response (added_field.h). Bounds and predictions of the
// field, which collision needs, are in contact_field.h.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/bundle/load_field.h"
#include "runtime/contact/added_field.h"
#include "runtime/contact/contact_constraints.h"
#include "runtime/contact/offset.h"
#include "runtime/contact/surface_field.h"

namespace palpate {

class DisplacementField {
 public:
  bool create(SceneMemory& memory, std::int32_t node_capacity);
  // In place of create(): the field of a body that has its own answers. borrowed.
  void follow(SurfaceField* body) { body_ = body; }
  // The sources of the offset; nullptr: none. borrowed.
  void offset_by(const Offset* offset, const AddedField* added) { offset_ = offset, added_ = added; }

  bool exists() const { return exists_; }
  // Takes over the contact nodes of a solve of the linear organ, and u~ of each, m. Not solved: there are none.
  void set(const Tensors& tensors, const ContactConstraints& set, const Vec3* modified, bool solved);
  void forget();
  // Completes a restored state (scene_memory.h).
  void restored(const Tensors& tensors);

  // m, of a node of the surface or, with a corridor, inside: after the last solve, moved by the offset of this step; after the solve
  // before. Zero where it is not finite.
  Vec3 at_node(std::int32_t node) const;
  Vec3 before_at_node(std::int32_t node) const;
  // m: o of the offset's rows alone. A contact holds what they leave of its target.
  Vec3 moved_at_node(std::int32_t node) const { return offset_ ? offset_->now(node) : Vec3{}; }
  // m, of a node: what the contacts do to it, C f + B g, and what the body adds. Zero where it is not finite.
  Vec3 by_contacts(std::int32_t node) const;
  // m: C f alone.
  const LoadField& loads() const { return now_; }
  const LoadField& loads_before() const { return before_; }

 private:
  SurfaceField* body_ = nullptr;
  const Offset* offset_ = nullptr;
  const AddedField* added_ = nullptr;
  LoadField now_, before_;
  bool exists_ = false;
};

}  // namespace palpate
