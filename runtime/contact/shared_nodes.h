// H W H^T as a product through the nodes under contact: (H^T, then W, then H) in place of a matrix over the rows. Where more contacts
// than nodes are held, as where several points press one triangle, this takes fewer multiply-adds, and a system over the rows becomes
// one over the nodes (Woodbury's identity, shared_newton.h).
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/base/vec3.h"
#include "runtime/contact/contact_constraints.h"
#include "runtime/contact/node_compliance.h"

namespace palpate {

class SharedNodes {
 public:
  // More nodes are not worth it: their factor alone would cost more than a step of the default scene may.
  static constexpr std::int32_t kMostNodes = 96;
  // contact_nodes: most of a step. Memory: at most 8 (3 kMostNodes)^2 + 80 contact_nodes bytes.
  bool create(SceneMemory& memory, std::int32_t contact_nodes);

  // Takes the nodes of the constraints, which have `rows` rows. Their compliance must be held. False, with nothing that may be used,
  // where products with the rows are as cheap. Cost: 60 multiply-adds for each pair of nodes and for each contact node.
  bool take(const NodeCompliance& held, const ContactConstraints& set, std::int32_t rows);
  // Copies the nodes of `from`, for recorded problems. This object must have been created for as many contact nodes.
  void copy(const SharedNodes& from);
  // Multiply-adds of I + K W (shared_newton.h) and its factor.
  std::int64_t operations_to_factor() const;
  // Multiply-adds of take(), and of the calls below for all constraints.
  std::int64_t operations_to_take() const { return 60 * (std::int64_t{count_} * count_ + entries_); }
  std::int64_t operations_to_spread() const { return 9 * std::int64_t{entries_}; }
  std::int64_t operations_to_move() const { return 9 * std::int64_t{count_} * count_; }

  std::int32_t count() const { return count_; }  // nodes
  std::int32_t axes() const { return 3 * count_; }
  std::int32_t contact_nodes() const { return entries_; }
  // [axes] m/N: displacement of all axes by a force of 1 N along axis a.
  const double* compliance(std::int32_t a) const { return compliance_ + static_cast<std::size_t>(a) * stride_; }
  // Contact node e of a constraint: its node, and H's block, from the node's axes to the rows of the constraint's frame.
  std::int32_t node(std::int32_t e) const { return node_[e]; }
  const Mat3& block(std::int32_t e) const { return block_[e]; }

  // H u of one constraint; moved: [axes] m.
  Vec3 along(const ContactConstraint& constraint, const double* moved) const;
  // force += H^T r of one constraint; force: [axes] N.
  void spread(const ContactConstraint& constraint, Vec3 r, double* force) const;
  // moved = W force. Both [axes].
  void move(const double* force, double* moved) const;
  // moved += W H^T r of one constraint.
  void add_moved(const ContactConstraint& constraint, Vec3 r, double* moved) const;

  // For callers' sums: [axes] each.
  double* force() const { return sums_; }
  double* moved() const { return sums_ + 3 * kMostNodes; }

 private:
  std::int32_t capacity_ = 0, count_ = 0, entries_ = 0;
  std::int64_t pairs_ =
      0;  // of nodes that one constraint holds, and of each node with itself; not fewer than there are
  std::size_t stride_ = 0;                // numbers per row of the compliance
  double* compliance_ = nullptr;          // [axes][stride] m/N
  double* sums_ = nullptr;                // [2][3 kMostNodes]
  Mat3* frame_ = nullptr;                 // [count] the axes of each node
  Mat3* block_ = nullptr;                 // [contact_nodes]
  std::int32_t* node_ = nullptr;          // [contact_nodes]
  std::int32_t* slot_ = nullptr;          // [count] of each node in the compliance that is held
  std::int32_t* node_of_slot_ = nullptr;  // [contact_nodes] or -1
};

}  // namespace palpate
