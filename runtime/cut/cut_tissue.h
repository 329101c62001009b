// The tetrahedra that a cut has left, and their stiffness at rest in parts: each part is a strain mode of a tetrahedron, or of a site where an
// element averages (dilatation_sites.h).
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/base/vec3.h"
#include "runtime/cut/strain_modes.h"
#include "runtime/large/hyperelastic_body.h"
#include "runtime/large/mesh_follower.h"

namespace palpate {

// Gradients on nodes: a sum over some tetrahedra of a share of their volume times the gradients of the shape functions. In mode m its strain
// is the sum of u_n . strain_mode(m, gradient_n).
struct NodeGradients {
  std::int32_t* node = nullptr;
  Vec3* gradient = nullptr;
  std::int32_t count = 0, capacity = 0;
  double volume = 0;  // m^3, of a site

  bool create(SceneMemory& memory, std::int32_t most) {
    node = memory.array<std::int32_t>(static_cast<std::size_t>(most));
    gradient = memory.array<Vec3>(static_cast<std::size_t>(most));
    capacity = most;
    return !memory.failed();
  }
  void clear() { count = 0, volume = 0; }
  void add(std::int32_t of, Vec3 g) {
    std::int32_t at = 0;
    while (at < count && node[at] != of) ++at;
    if (at == count) node[count] = of, gradient[count++] = {};
    gradient[at] += g;
  }
};

class CutTissue {
 public:
  // body: borrowed, at rest and uncut. most_new: nodes that may be added.
  bool create(SceneMemory& memory, const HyperelasticBody& body, std::int32_t most_new);

  std::int32_t rest_nodes() const { return body_->node_count; }
  std::int32_t nodes() const { return body_->node_count + new_count_; }
  std::int32_t most_nodes() const { return body_->node_count + most_new_; }
  bool is_new(std::int32_t node) const { return node >= body_->node_count; }
  // The node that a new node split from, and the node at rest that it began as.
  std::int32_t parent(std::int32_t node) const { return parent_[node - body_->node_count]; }
  std::int32_t origin(std::int32_t node) const { return is_new(node) ? origin_[node - body_->node_count] : node; }
  bool is_held(std::int32_t node, int axis) const {
    return body_->fixed[3 * static_cast<std::int64_t>(origin(node)) + axis] != 0;
  }
  const std::int32_t* corners(std::int32_t e) const { return corners_ + 4 * static_cast<std::int64_t>(e); }
  bool is_left(std::int32_t e) const { return !removed_[e]; }
  std::int32_t tetrahedra() const { return body_->tetrahedron_count; }
  std::int32_t region(std::int32_t e) const { return body_->region[e]; }

  // Nodes below it are those of a base: a body, cut or not, whose compliance is known (cut_base.h). At first that is the body at rest. And the node of the
  // base that a node is, or began as.
  std::int32_t base_nodes() const { return base_nodes_; }
  std::int32_t base(std::int32_t node) const { return node < base_nodes_ ? node : base_[node - body_->node_count]; }

  void forget();  // back to the body at rest
  // Of the same body: as `now` is, which is the base from now on.
  void begin_from(const CutTissue& now);

  // gets the number nodes(). share: of what `from` has of the loads.
  void add_node(std::int32_t from, LoadShare share);
  // A part of a node's tetrahedra is removed, which has this share of the node's loads.
  void lose_loads(std::int32_t node, LoadShare share);
  const LoadShare& loads(std::int32_t node) const { return loads_[node]; }
  void move_corner(std::int32_t e, std::int32_t from, std::int32_t to);
  void remove(std::int32_t e) { removed_[e] = 1; }

  // Stiffness of a mode, Pa: of a tetrahedron's own part, and of a site's.
  double own_stiffness(std::int32_t region, int mode) const;
  double site_stiffness(std::int32_t region, int mode) const;
  int site_modes() const { return body_->nodal_dilatation ? (body_->averaged_shear > 0 ? kStrainModes : 1) : 0; }
  // The four gradients of a tetrahedron, 1/m; returns its volume, m^3.
  double gradients(std::int32_t e, Vec3 g[4]) const;
  double volume(std::int32_t e) const {
    Vec3 g[4];
    return gradients(e, g);
  }
  // -1: the node is no corner of it.
  int corner_of(std::int32_t e, std::int32_t node) const;

  // Calls visit(tetrahedron, corner) for each tetrahedron that is left at a node.
  template <class Visit>
  void for_each_at(std::int32_t node, Visit visit) const {
    const std::int32_t at_rest = origin(node);
    for (std::int32_t at = first_[at_rest]; at < first_[at_rest + 1]; ++at) {
      const std::int32_t e = around_[at];
      const int corner = removed_[e] ? -1 : corner_of(e, node);
      if (corner >= 0) visit(e, corner);
    }
  }
  std::int32_t tetrahedra_at(std::int32_t node) const;
  // Most nodes of the tetrahedra around a node of the body at rest.
  std::int32_t largest_star() const { return largest_star_; }
  // What the site of a node and a region averages: D = sum of V_e / 4 grad N, and V. of: a tetrahedron counts where of(e) is true.
  template <class Of>
  void find_site(std::int32_t node, std::int32_t of_region, NodeGradients& site, Of of) const {
    site.clear();
    for_each_at(node, [&](std::int32_t e, int) {
      if (body_->region[e] == of_region && of(e)) add_quarter(e, site);
    });
  }

 private:
  void add_quarter(std::int32_t e, NodeGradients& site) const;

  const HyperelasticBody* body_ = nullptr;
  std::int32_t* corners_ = nullptr;                                       // [tetrahedra][4]
  std::uint8_t* removed_ = nullptr;                                       // [tetrahedra]
  std::int32_t* first_ = nullptr;                                         // [nodes at rest + 1] into around_
  std::int32_t* around_ = nullptr;                                        // tetrahedra of each node at rest, ascending
  std::int32_t *parent_ = nullptr, *origin_ = nullptr, *base_ = nullptr;  // [most_new]
  LoadShare* loads_ = nullptr;                                            // [most_nodes()]
  std::int32_t new_count_ = 0, most_new_ = 0, base_nodes_ = 0, largest_star_ = 0;
};

}  // namespace palpate
