// A body under large deformation whose mesh is cut: what whoever cuts tells the body, and what the body asks.
//
// The body's energy follows the mesh exactly. Its method has the metric of the uncut body at rest, plus what the cut adds to that: so the metric stays
// exact at rest, and no factor is made anew.
//
// No function is pure, as in body.h.
#pragma once

#include <cstddef>
#include <cstdint>

#include "runtime/base/vec3.h"

namespace palpate {

class Body;
class NodeFans;

// Nodes first .. first + count - 1 of the bundle's mesh, which are in no tetrahedron: they become the new nodes.
struct NewNodes {
  std::int32_t first = 0, count = 0;
};

// What a cut adds to K^-1, the inverse of the uncut body's stiffness at rest. With K' of the cut one
//     K'^-1 f = K^-1 (f + p) + jumps:
// forces on new nodes act on the nodes at rest that these come from, p are pseudo-forces that follow from K^-1 f, and new nodes are displaced by jumps
// besides. Vectors go by places, [MeshFollower::Layout::length].
class AddedCompliance {
 public:
  static constexpr int kMostVectors = 12;

  // Whether there is a cut.
  virtual bool acts() const { return false; }
  // Of some vectors x at once, around two solves with K^-1. begin(): x are forces, and get those of new nodes at the nodes at rest.
  virtual void begin(float* const* /*x*/, int /*count*/) {}
  // x: K^-1 of them, which becomes the forces and the pseudo-forces.
  virtual void go_on(float* const* /*x*/, int /*count*/) {}
  // x: K^-1 of these. New nodes get their displacements.
  virtual void end(float* const* /*x*/, int /*count*/) {}

 protected:
  ~AddedCompliance() = default;
};

// The changes of a mesh as numbers, which a body that is solved in another thread follows. Whoever cuts adds them in the thread of the touch; each job for
// the other thread carries those that it does not have yet.
class MeshStream {
 public:
  // ---- the thread of the touch
  virtual std::int32_t end() const { return 0; }  // numbers so far; 0 after the mesh was put back
  // Copies whole changes from number `from` on, most numbers at most. Returns how many numbers.
  virtual std::int32_t copy(std::int32_t /*from*/, std::int32_t /*most*/, std::int32_t* /*out*/) const { return 0; }
  static constexpr std::int32_t kMostOfJob = 16384;

  // ---- the other thread
  virtual void follow(const std::int32_t* /*numbers*/, std::int32_t /*count*/, bool /*replayed*/) {}
  virtual void forget() {}  // back to the uncut mesh
  // The surface that it has followed.
  struct Surface {
    const double* rest = nullptr;
    const std::int32_t* triangles = nullptr;
    const NodeFans* fans = nullptr;
  };
  virtual Surface surface() const { return {}; }
  // No other thread follows: all of the first `count` numbers again.
  virtual void restore(std::int32_t /*count*/) {}

 protected:
  ~MeshStream() = default;
};

// Of the loads at a node at rest, what a node there has: of those in the volume, as gravity, and of those on the surface.
struct LoadShare {
  double in_volume = 1, on_surface = 1;
};

class MeshFollower {
 public:
  // A body that is solved beside the touch: `linear` is the organ that the touch solves, and the body follows `stream`. Borrowed.
  virtual void follow_beside(Body* /*linear*/, MeshStream* /*stream*/) {}
  // In the thread of the touch: a surface node has what another one has, until a solution tells.
  virtual void copy_node(std::int32_t /*from*/, std::int32_t /*to*/) {}
  // In the thread of the touch: whether the forces that hold the tissue would give the linear organ far more energy than the body has (body_beside.h). After a
  // change of the mesh hold_back() is then told what the change does to the linear organ under these forces, [surface nodes][3] m, and the energy of that, J.
  // The touch does not show it.
  virtual bool holds_back() const { return false; }
  virtual void hold_back(const float* /*released*/, double /*energy*/) {}
  // The touch needs a solution that has followed all changes of the mesh: until it comes, the mesh is to stay as it is.
  virtual bool awaits_mesh() const { return false; }
  struct Layout {
    const std::int32_t* place = nullptr;  // [nodes of the mesh]
    std::int32_t rows = 0;                // nodes at places below it move
    std::size_t length = 0;               // numbers of a vector
  };
  // Before the first change. added: borrowed.
  virtual Layout follow_mesh(AddedCompliance* /*added*/) { return {}; }

  // Changes of the mesh, after those of the added compliance; then changed(). A node of the mesh that has waited lies where `from` lies, and has some
  // of its tetrahedra.
  struct Split {
    std::int32_t node, from;
    const std::int32_t* tetrahedra;
    std::int32_t count;
  };
  // replayed: of a saved state, which has the displacements.
  virtual void split(const Split& /*split*/, bool /*replayed*/) {}
  // m, by which a new node is off its place at rest in the bundle.
  virtual void bring(std::int32_t /*node*/, Vec3 /*on*/) {}
  virtual void remove(std::int32_t /*tetrahedron*/) {}
  // Part of the soft supports: a block, N/m, in the rows of one node and the columns of another one, or of the same.
  struct Support {
    std::int32_t node, other;
    Mat3 block;
  };
  // All of them from now on. Borrowed.
  virtual void take_supports(const Support* /*supports*/, std::int32_t /*count*/) {}
  // Of nodes that have split or lost tetrahedra, all from now on: new nodes first, then those at rest. Borrowed.
  struct DividedLoad {
    std::int32_t node, at_rest;
    LoadShare share;
  };
  virtual void take_loads(const DividedLoad* /*loads*/, std::int32_t /*count*/) {}
  virtual void changed(bool /*replayed*/) {}
  virtual void forget_changes() {}

 protected:
  ~MeshFollower() = default;
};

}  // namespace palpate
