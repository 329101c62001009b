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
  // The faces of the last try_faces() that were at fault before any was taken back; the first kMostFaulty.
  static constexpr std::int32_t kMostFaulty = 32;
  std::int32_t faulty_count() const { return faulty_count_; }
  const std::int32_t* faulty() const { return faulty_; }
  // The tetrahedra of a component that lies beyond a faulty face from one that has several fans. A node at which such a cut only touches the
  // surface, or itself, is free of the fault when all of them are on the other side.
  struct Group {
    static constexpr std::int32_t kMost = 24;
    std::int32_t component, count, tetrahedra[kMost];
  };
  static constexpr std::int32_t kMostGroups = 8;
  std::int32_t group_count() const { return group_count_; }
  const Group& group(std::int32_t i) const { return groups_[i]; }
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
  void note_faulty(bool removal);
  void note_group(std::int32_t corner);
  void find_faults(bool removal, std::int32_t* least);

  CutState* state_ = nullptr;
  std::int32_t *gathered_ = nullptr, *items_ = nullptr;  // [2 tetrahedra]: faces between two of them
  std::uint8_t* faults_ = nullptr;                       // [2 tetrahedra], by item
  std::uint32_t *seen_face_ = nullptr, *seen_node_ = nullptr,
                *changed_ = nullptr;  // [tetrahedra][4], [nodes], [nodes]: a pass
  std::uint32_t pass_ = 0;
  std::int32_t count_ = 0, faulty_count_ = 0;
  std::int32_t faulty_[kMostFaulty];
  std::int32_t group_count_ = 0;
  Group groups_[kMostGroups];
  std::int64_t work_ = 0;
};

}  // namespace palpate
