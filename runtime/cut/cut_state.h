// Which faces are cut and which tetrahedra are removed, and around one node or one edge whether the surface that results is manifold.
//
// Nodes follow from the faces: around each node at rest the tetrahedra that are left fall into components that are connected through
// faces that are not open, and each component has a node of its own. The surface consists of the open faces. It is manifold if
//   1. each component has at most one closed row of open faces around its node (else the node has several fans), and
//   2. no two sectors around an edge belong to the same components at both of its ends (else the edge has four triangles or more).
// A sector is a run of tetrahedra around an edge without an open face between them. README.md has the proof.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/cut/rest_mesh.h"

namespace palpate {

// Of a face between two tetrahedra. Open from `tried` on.
enum class FaceState : std::uint8_t {
  whole,
  pending,  // the blade has met it, but the surface would not be manifold
  spared,   // the blade has met it, and another face near it is cut in its place
  kept,     // it has a node that is not to be divided (CutBody::dividable)
  tried,    // open while it is being found out whether it can be cut
  cut,
};

class CutState {
 public:
  // The sentence of what is wrong; nullptr: nothing, unless the memory has failed. The body must be manifold.
  const char* create(SceneMemory& memory, const RestMesh& rest);
  // Nothing is cut or removed.
  void forget();

  const RestMesh& rest() const { return *rest_; }
  FaceState face(std::int32_t face) const { return faces_[face]; }
  // Of both sides of the face.
  void set(std::int32_t face, FaceState state) {
    faces_[face] = state;
    if (const std::int32_t other = rest_->other_side(face); other >= 0) faces_[other] = state;
  }
  bool gone(std::int32_t tetrahedron) const { return gone_[tetrahedron]; }
  void set_gone(std::int32_t tetrahedron, bool gone) { gone_[tetrahedron] = gone; }
  bool open(std::int32_t face) const {
    const std::int32_t beyond = rest_->neighbour(face);
    return faces_[face] >= FaceState::tried || beyond < 0 || gone_[beyond];
  }
  // Whether a face between two tetrahedra that are left can still be cut.
  bool closed(std::int32_t face) const { return !gone_[face / 4] && !open(face); }
  // Whether the node at rest lies on the surface, where faces that are only tried count as whole.
  bool on_surface(std::int32_t node) const;
  // Whether a tetrahedron may be removed.
  bool may_go(std::int32_t tetrahedron) const;

  // Finds the components around a node at rest. Cost: the tetrahedra around it.
  void find_components(std::int32_t node);
  // The component of a corner, as its node's last find_components() found it: the first corner of the component.
  std::int32_t component(std::int32_t corner) const { return component_[corner]; }
  // Whether the component has more than one row of open faces.
  bool has_fans(std::int32_t component) const { return fans_[component]; }
  // Whether two sectors around the edge of nodes a and b belong together at both ends. The components at a and b must be known. From the
  // tetrahedron, the walk around the edge begins across the face that is opposite to node `away`; the face behind it is open, or the
  // tetrahedron is gone. Cost: the tetrahedra around the edge.
  bool edge_is_shared(std::int32_t tetrahedron, std::int32_t a, std::int32_t b, std::int32_t away);
  // The same for the three edges of an open face.
  bool face_has_shared_edge(std::int32_t face);

 private:
  struct Border {
    std::int32_t face, trail, lead;  // an open face at the node, and its two other nodes
  };
  Border next_border(std::int32_t node, Border border) const;
  void flood(std::int32_t node, std::int32_t first);
  struct Ring {
    std::int32_t tetrahedron, a, b, behind, ahead;  // crosses the face that is opposite to node `behind` first
  };
  bool find_sectors(Ring ring);

  static constexpr int kMostSectors = 64;
  const RestMesh* rest_ = nullptr;
  FaceState* faces_ = nullptr;         // [tetrahedra][4]
  std::uint8_t* gone_ = nullptr;       // [tetrahedra]
  std::int32_t* component_ = nullptr;  // [tetrahedra][4]
  std::uint8_t* fans_ = nullptr;       // [tetrahedra][4], by component
  std::int32_t* stack_ = nullptr;      // [tetrahedra]
  std::int32_t sectors_[kMostSectors][2];
  int sector_count_ = 0;
};

}  // namespace palpate
