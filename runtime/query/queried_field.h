// The displacement field of the contacts that a query is asked about, evaluated at single nodes (eq. 9 of the paper), and a bound
// on how far it moves any node.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/bundle/load_field.h"
#include "runtime/bundle/offset_rows.h"
#include "runtime/surface/surface_tree.h"

namespace palpate {

class QueriedField {
 public:
  // touchable: [columns] the surface node of each tensor column, borrowed. large: the contacts hold the displacements themselves,
  // as under large deformation; norms are then lengths. added_reach: not zero where the contacts hold displacements that add to
  // superposition; the reach of the tree (m / sqrt(J)), the same for all nodes. motions: without numbers where the scene has none;
  // moved_reach: m / sqrt(J), in which their length is stated as a norm.
  bool create(SceneMemory& memory, const Tensors& tensors, const std::int32_t* touchable, std::int32_t node_capacity,
              bool large, double added_reach, const OffsetRows& motions, double moved_reach);

  // Takes over the contact nodes; contacts: laid out (contact_nodes.h), or nullptr for the surface at rest. Returns the step flags.
  // Cost: a comparison where they are those of the last call, else nodes^2 entries of the tensors. Large: a pass over the surface.
  std::uint32_t set(const Tensors& tensors, const palpate_contacts* contacts);

  // Displacement of a surface node, m. The field remembers it until the contacts change.
  Vec3 at_node(std::int32_t node);
  FieldBound bound() const { return {norm_, path_, 0}; }

 private:
  double norm_of_loads(const Tensors& tensors) const;
  std::uint32_t copy_field(const float* field, std::int32_t nodes);
  bool take_loads(const Tensors& tensors, const palpate_contacts* contacts, std::uint32_t* flags);
  bool take_added(const float* field, std::uint32_t* flags);
  bool take_amounts(const double* amounts, std::uint32_t* flags);

  const std::int32_t* touchable_ = nullptr;
  LoadField loads_;
  std::int32_t surface_nodes_ = 0;
  bool large_ = false;
  Vec3* added_ = nullptr;                 // [surface nodes] m, or nullptr
  double longest_added_ = 0, reach_ = 1;  // m; m / sqrt(J)
  OffsetRows motions_;
  double* amounts_ = nullptr;                   // [motions]
  double longest_moved_ = 0, moved_reach_ = 1;  // m; m / sqrt(J)
  double norm_ = 0, path_ = 0;                  // sqrt(J), as surface_tree.h explains
  Vec3* known_ = nullptr;                       // [surface nodes] m
  std::uint32_t* stamp_ = nullptr;              // [surface nodes] of the evaluation
  std::uint32_t now_ = 1;
};

}  // namespace palpate
