// W_ab, the compliance between the nodes under contact: C_ab less what amounts of the offset take away that follow the forces (offset.h),
// and what a changed body adds (changed_body.h), in which several nodes may have the same column.
// Each pair is read from the tensors once, in the step in which the later of the two nodes comes under contact.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/bundle/tensors.h"
#include "runtime/contact/contact_constraints.h"
#include "runtime/contact/offset.h"

namespace palpate {

// C_kk, the inverse of the stiffness T^f_k on its free axes, zero on the others. False where T^f_k is not positive definite.
bool self_compliance(const double stiffness[9], Mat3* compliance);

class NodeCompliance {
 public:
  // capacity: most contact nodes of a step, where a node under several contacts counts for each; columns: of the tensors, those of the
  // corridor among them, of_surface without these; surface_nodes: asked for where a body changes; offset: borrowed, nullptr: none.
  // Memory: 72 min(capacity, columns)^2 + 4 columns bytes.
  bool create(SceneMemory& memory, std::int32_t capacity, std::int32_t columns, std::int32_t of_surface,
              std::int32_t surface_nodes, const Offset* offset);

  // Makes the nodes under contact exactly those of the constraints. False, and no nodes, where a number of the tensors is not
  // finite. Cost: 9 numbers of the tensors, from three distant addresses, per pair of a new node and any node.
  bool hold(const Tensors& tensors, const ContactConstraints& set);
  void forget();
  // Other amounts follow than those of this compliance: forget() comes before hold().
  bool is_stale() const { return version_ != version_of_offset(); }

  std::int32_t slot_of_contact_node(std::int32_t e) const { return slot_of_contact_node_[e]; }
  // All slots in use are below this number.
  std::int32_t slots() const { return slots_; }
  bool in_use(std::int32_t slot) const { return column_[slot] >= 0; }

  // W_ab = at(a)[b], m/N: displacement of the node in slot a per unit force on the node in slot b.
  const Mat3* at(std::int32_t a) const { return matrix_ + static_cast<std::size_t>(a) * stride_; }
  // u~ of the node in slot a under its own force, m; of a node of the corridor the force itself, as its columns are of unit forces.
  Vec3 modified(std::int32_t a, Vec3 force) const { return column_[a] < of_surface_ ? self_[a] * force : force; }

 private:
  bool follows() const { return offset_ && offset_->followers().count() > 0; }
  ChangedBody* changed() const { return offset_ ? offset_->changed() : nullptr; }
  std::int32_t version_of_offset() const {
    const std::int32_t version = offset_ ? offset_->version() : 0;
    return changed() ? version + changed()->version() : version;
  }
  // By which contact nodes are told apart: the column, or in a changed body the node.
  std::int32_t key_of(std::int32_t node, std::int32_t column) const { return changed() ? node : column; }
  std::int32_t at_rest(std::int32_t slot) const { return changed() ? changed()->at_rest(node_[slot]) : node_[slot]; }
  bool read_new(const Tensors& tensors);
  bool read_self(const Tensors& tensors, std::int32_t a);
  bool take_self(std::int32_t a);
  bool read(const Tensors& tensors, std::int32_t a, const std::int32_t* earlier, std::int32_t count);
  bool is_new(std::int32_t slot) const { return taken_in_[slot] == round_; }
  void release(std::int32_t slot);

  Mat3* matrix_ = nullptr;  // [slots][stride] W_ab
  Mat3* self_ = nullptr;    // [slots] C_aa
  const Offset* offset_ = nullptr;
  Vec3 response_[kMostOffsetRows];                // scratch, of one node
  std::int32_t version_ = 0;                      // of the offset and of the changed body
  std::int32_t* column_ = nullptr;                // [slots] of each slot, or -1
  std::int32_t* node_ = nullptr;                  // [slots]
  std::uint32_t* held_in_ = nullptr;              // [slots] the last round that asked for it
  std::uint32_t* taken_in_ = nullptr;             // [slots] the round in which it came
  std::int32_t* by_column_ = nullptr;             // [slots] slots in use
  std::int32_t* new_ = nullptr;                   // [slots] those of them that are new
  std::int32_t* slot_of_key_ = nullptr;           // [keys] or -1
  std::int32_t* slot_of_contact_node_ = nullptr;  // [capacity]
  std::size_t stride_ = 0;
  std::int32_t capacity_ = 0, keys_ = 0, of_surface_ = 0;
  std::int32_t slots_ = 0;
  std::uint32_t round_ = 0;
};

}  // namespace palpate
