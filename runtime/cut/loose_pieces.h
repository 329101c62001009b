// Pieces that no support holds: a cut has severed them. Some nodes of each are held by springs to where they are at rest, so that the piece has a
// balance; a weak force then carries it away.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/cut/cut_mesh.h"

namespace palpate {

class LoosePieces {
 public:
  // can_hold: [nodes at rest] 1 where the compliance knows a node; borrowed.
  bool create(SceneMemory& memory, const CutMesh& mesh, const std::uint8_t* can_hold);
  void forget() { count_ = 0; }

  // After the mesh's last change: calls hold(node) for nodes that are to be held now, of each piece that is loose and has fewer than three. Nodes of
  // this change are those that its splitting makes. Cost: a pass over the tetrahedra for each such piece, where pieces have come off; else none.
  template <class Hold>
  void each_new_hold(Hold hold) {
    if (!may_be_loose()) return;
    for (std::int32_t piece = 0; piece < mesh_->pieces().count(); ++piece) {
      std::int32_t node[3];
      const std::int32_t found = find_holds(piece, node);
      for (std::int32_t i = 0; i < found && count_ < kMost; ++i) hold(held_[count_++] = node[i]);
    }
  }

 private:
  static constexpr std::int32_t kMost = 1024;
  bool may_be_loose() const;
  std::int32_t find_holds(std::int32_t piece, std::int32_t node[3]) const;
  bool is_of(std::int32_t piece, std::int32_t node) const;
  Vec3 at_rest(std::int32_t node) const;

  const CutMesh* mesh_ = nullptr;
  const double* rest_ = nullptr;
  const std::uint8_t* can_hold_ = nullptr;
  std::int32_t* held_ = nullptr;  // [kMost] nodes
  std::int32_t count_ = 0;
};

}  // namespace palpate
