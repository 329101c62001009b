// Energy and forces of the hyperelastic body at a displacement from where it rests: its elements, its soft supports and, under a preload,
// the load that holds it there. Vectors over the dofs that move are padded with zeros (length()).
//
// What moves the body from outside is a displacement o, rows with amounts (contact/offset.h), which held nodes have, too. The body is then at
// o + u for a displacement u. Soft supports, whose bases move, are stretched by u alone, and the load K_el o acts, with the stiffness K_el of
// the elements at rest: so u is zero for the linear body, and is what the hyperelastic body does otherwise.
#pragma once

#include <cstddef>
#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/bundle/offset_rows.h"
#include "runtime/large/block_rows.h"
#include "runtime/large/element_lanes.h"
#include "runtime/large/mesh_follower.h"
#include "runtime/large/surface_pressures.h"

namespace palpate {

class HyperelasticEnergy {
 public:
  using Elements = ElementLanes<EightFloats>;
  using Energy = Elements::Energy;

  // Places of the nodes: [node_count] those that move first, in the order of elimination; then new ones; then those that are held. order:
  // [order_count] of the first.
  bool place_nodes(SceneMemory& memory, const HyperelasticBody& body, const std::int32_t* order,
                   std::int32_t order_count, const NewNodes& new_nodes);
  // The order of elimination becomes improved[place].
  void reorder(const std::int32_t* improved);
  // After the nodes have their places. has_preload: a load may be set.
  bool create(SceneMemory& memory, const HyperelasticBody& body, bool has_preload, const NewNodes& new_nodes);
  // The load is K preload, N. preload: [node_count][3] m.
  bool take_load(SceneMemory& memory, const HyperelasticBody& body, const BlockRows& stiffness, const double* preload);
  void set_load_share(double share) { load_share_ = share; }
  // The body rests at u from now on, held there by the force that it has there.
  void rest_at(const float* u, float* force);
  // rows: of finite numbers, with all nodes; borrowed. The amounts are zero.
  bool take_offset(SceneMemory& memory, const HyperelasticBody& body, const OffsetRows& rows);
  // The amounts [offset_rows()] become from + share (to - from). Cost: a pass over the nodes for each row.
  void move(const double* from, const double* to, double share);
  // The pressures among the rows. Their state is that of accept(), rest_pressures() or take_state().
  SurfacePressures& pressures() { return pressures_; }
  const SurfacePressures& pressures() const { return pressures_; }
  // The last evaluated displacement becomes the state; the state is at rest, without offset; it is at u, and the volumes are known.
  void accept() { pressures_.accept(); }
  void rest_pressures();
  void take_state(const float* u);
  // f += the force of pressure i of the state, times `factor`: dV/du.
  void add_volume_gradient(std::int32_t i, double factor, float* f) const {
    pressures_.add_gradient(i, factor, rows_, f);
    clear_held(f);
  }
  // After amounts() has been restored, and u.
  void restored(const float* u) {
    move(offset_.amounts, offset_.amounts, 0);
    take_state(u);
  }

  std::int32_t nodes() const { return nodes_; }
  std::int32_t rows() const { return rows_; }             // nodes that move
  std::int32_t rows_at_rest() const { return at_rest_; }  // of them, in the uncut mesh
  std::size_t length() const { return length_; }
  // Numbers of a vector of displacements of all nodes.
  std::size_t padded() const { return padded_; }
  const std::int32_t* places() const { return place_; }
  std::int32_t place(std::int32_t node) const { return place_[node]; }
  const float* base() const { return base_; }  // [padded] m, where the body rests under a preload; else nullptr
  // J, of an energy, by the rounding of the preload's and of the places to which the offset moves.
  double noise() const { return noise_ + offset_.noise; }
  std::int32_t offset_rows() const { return offset_.rows.count; }
  const double* amounts() const { return offset_.amounts; }
  bool is_moved() const { return offset_.acts; }
  const float* moved() const { return offset_.acts ? offset_.by : nullptr; }  // [padded] m, o by places; nullptr: zero

  // u: [3 nodes] m, by places; f: [length] N, dE/du. Where the energy is not finite, the least volume is 0.
  Energy evaluate(const float* u, float* f);
  // ElementLanes::turned_shear() of the same state. Costs a part of an evaluation.
  double turned_shear(const float* u, const float* move);
  // The mesh is cut (mesh_follower.h): then evaluate anew, with displacements of new nodes.
  void split(const MeshFollower::Split& split);
  void remove(std::int32_t tetrahedron) {
    elements_.remove(tetrahedron), pressures_.remove(tetrahedron), new_.removed = true;
  }
  void take_supports(const MeshFollower::Support* supports, std::int32_t count) {
    new_.supports = supports, new_.support_count = count;
  }
  void take_loads(const MeshFollower::DividedLoad* loads, std::int32_t count);
  void forget_changes();
  bool is_changed() const { return new_.made > 0 || new_.removed; }
  // A load acts at rest, so that a changed body does not rest where the uncut one does.
  bool has_load() const { return load_ != nullptr; }

  // Components of single dofs that are held become 0.
  void clear_held(float* f) const {
    for (std::int32_t h = 0; h < held_count_; ++h) f[held_[h]] = 0;
  }

 private:
  struct Offset {
    OffsetRows rows;
    float* loads = nullptr;     // [rows][length] N per unit, K_el times the row
    float* supports = nullptr;  // the same: what soft supports do of that; nullptr: the mesh is not cut
    double* roughness =
        nullptr;                // [rows] sqrt(J) per unit: of rounding that displaces each dof by its own displacement
    double* amounts = nullptr;  // [rows]
    float *by = nullptr, *load = nullptr;  // under these: [padded] m, o; [length] N
    double noise = 0;                      // J
    bool acts = false;                     // an amount is not zero
  };
  const float* from_mesh(const float* u) const;
  bool take_supports(SceneMemory& memory, const HyperelasticBody& body);
  double add_supports(const float* u, float* f) const;
  double add_support(std::int32_t a, std::int32_t b, const double* k, const float* u, float* f) const;
  void take_force(const RowForce& force, const double* row, float* load) const;
  Vec3 displaced(std::int32_t place, const float* u, bool with_offset) const;
  void clear_held_dofs(const HyperelasticBody& body, float* f) const;
  void sum_loads();
  void sum_divided_loads();
  void add_row(double amount, const float* rows, std::int32_t m, float* sum) const;
  void divide(double LoadShare::*share, float* load) const;

  Elements elements_;
  std::int32_t nodes_ = 0, rows_ = 0, at_rest_ = 0;
  std::size_t length_ = 0, padded_ = 0;
  std::int32_t* place_ = nullptr;  // [nodes]
  std::int32_t* held_ = nullptr;   // single held dofs, as indices of vectors
  std::int32_t held_count_ = 0;
  std::int32_t* support_place_ = nullptr;  // [support_count][2]
  double* support_stiffness_ = nullptr;    // [support_count][9] N/m
  std::int32_t support_count_ = 0;
  // Under a preload: where the body rests, [padded] m; the load there, [length] N. There and with an offset: the place of a state, [padded] m.
  float *base_ = nullptr, *absolute_ = nullptr, *load_ = nullptr;
  Offset offset_;
  SurfacePressures pressures_;
  // Nodes that have split off, and the uncut body's counts.
  struct New {
    std::int32_t* origin =
        nullptr;  // [nodes] each node, or the node at rest that a new one comes from; nullptr: the mesh is not cut
    std::int32_t made = 0, held = 0;
    bool removed = false;
    const MeshFollower::Support* supports = nullptr;  // in place of the uncut body's; nullptr: these
    std::int32_t support_count = 0;
    const MeshFollower::DividedLoad* loads = nullptr;
    std::int32_t load_count = 0;
    float* load = nullptr;  // [length] N, of the preload in the uncut mesh
  } new_;
  double base_energy_ = 0, noise_ = 0;  // J
  double load_share_ = 1;
};

}  // namespace palpate
