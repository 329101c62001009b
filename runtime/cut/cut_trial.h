// Which of some faces can be cut, or which of some tetrahedra can be removed, so that the surface stays manifold: all are tried at once, and
// while there is a fault, those that are at fault and that divide the least are taken back.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/cut/cut_state.h"

namespace palpate {

class CutTrial {
 public:
  // False where memory ends.
  bool create(SceneMemory& memory, CutState& state);

  // The faces of `state` that hang together with the face by nodes, from it on; each as its tetrahedron with the lower number has it. The
  // list is valid until the next call. Cost: the tetrahedra around these faces.
  std::int32_t gather(std::int32_t face, FaceState state);
  const std::int32_t* gathered() const { return gathered_; }
  // Counts calls of gather(); whether one since then has found the face, of which this is the lower side.
  std::uint32_t moment() const { return pass_; }
  bool gathered_since(std::uint32_t moment, std::int32_t face) const { return seen_face_[face] > moment; }
  std::int32_t lower_side(std::int32_t face) const {
    const std::int32_t other = state_->rest().other_side(face);
    return other >= 0 && other < face ? other : face;
  }

  // Tries the faces, which are pending, and leaves those that can be cut `tried`, the others pending. `order` [tetrahedra][4]: when each
  // face was met; the last ones are taken back first. Returns how many are left. The components at the nodes of these faces are known then.
  std::int32_t try_faces(const std::int32_t* faces, std::int32_t count, const std::uint32_t* order);
  // Tries to remove the tetrahedra, the first ones rather than the last. Those that can go are gone(); returns how many.
  std::int32_t try_removal(const std::int32_t* tetrahedra, std::int32_t count);
  // What was tried and left, after either.
  const std::int32_t* left() const { return items_; }
  // Whether the nodes on both sides of a face at a corner differ.
  bool divides(std::int32_t corner, std::int32_t face) const;
  // Counted work since create(): the corners that were looked at.
  std::int64_t work() const { return work_; }

 private:
  template <class Visit>
  void each_node(std::int32_t item, const Visit& visit) const;
  void know(std::int32_t node);
  // 0: no fault; else 1 and the number of nodes that the face divides.
  std::int32_t face_fault(std::int32_t face);
  std::int32_t removal_fault(std::int32_t tetrahedron);
  std::int32_t settle(bool removal);
  std::int32_t take_back(bool removal, std::int32_t least);
  void find_faults(bool removal, std::int32_t* least);

  CutState* state_ = nullptr;
  std::int32_t *gathered_ = nullptr, *items_ = nullptr;  // [2 tetrahedra]: faces between two of them
  std::uint8_t* faults_ = nullptr;                       // [2 tetrahedra], by item
  std::uint32_t *seen_face_ = nullptr, *seen_node_ = nullptr,
                *changed_ = nullptr;  // [tetrahedra][4], [nodes], [nodes]: a pass
  std::uint32_t pass_ = 0;
  std::int32_t count_ = 0;
  std::int64_t work_ = 0;
};

}  // namespace palpate
