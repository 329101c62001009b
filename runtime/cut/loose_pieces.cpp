#include "runtime/cut/loose_pieces.h"

#include <algorithm>

namespace palpate {
namespace {

// Three nodes hold a piece if the triangle between them is not thinner than this share of its longest edge.
constexpr double kLeastHeight = 0.02;

double height_of(Vec3 a, Vec3 b, Vec3 c) {
  const double longest = std::max({length(b - a), length(c - a), length(c - b)});
  return longest > 0 ? length(cross(b - a, c - a)) / longest / longest : 0;
}

}  // namespace

bool LoosePieces::create(SceneMemory& memory, const CutMesh& mesh, const std::uint8_t* can_hold) {
  mesh_ = &mesh, rest_ = mesh.state().rest().body().nodes, can_hold_ = can_hold;
  held_ = memory.array<std::int32_t>(kMost);
  memory.keep(count_), memory.keep_array(held_, kMost, count_);
  return !memory.failed();
}

bool LoosePieces::may_be_loose() const {
  const CutMeshChange& change = mesh_->change();
  return change.end_piece > change.first_piece || change.removed_tetrahedra.count > 0;
}

Vec3 LoosePieces::at_rest(std::int32_t node) const {
  return load3(rest_ + 3 * static_cast<std::size_t>(mesh_->at_rest(node)));
}

bool LoosePieces::is_of(std::int32_t piece, std::int32_t node) const {
  for (const std::int32_t corner : mesh_->state().rest().star(mesh_->at_rest(node)))
    if (!mesh_->is_removed(corner / 4) && mesh_->nodes_of(corner / 4)[corner % 4] == node)
      return mesh_->pieces().piece_of(corner / 4) == piece;
  return false;
}

// The nodes that hold it already count. Old nodes come first: they can be held before the change is made. The last node that the change makes is none of
// them: before it is made, the piece hangs on the node that it comes from. The second one is far from the first, the third far from their line.
std::int32_t LoosePieces::find_holds(std::int32_t piece, std::int32_t node[3]) const {
  const CutPiece& of = mesh_->pieces().piece(piece);
  if (of.tetrahedra == 0 || of.is_held) return 0;
  std::int32_t corner[3];
  std::int32_t known = 0;
  for (std::int32_t i = 0; i < count_ && known < 3; ++i)
    if (is_of(piece, held_[i])) corner[known++] = held_[i];
  if (known == 3) return 0;
  const std::int32_t first_new = mesh_->change().first_node, begin = known,
                     tetrahedra = mesh_->state().rest().tetrahedra();
  std::int32_t last = first_new;
  for (std::int32_t t = of.first; t < tetrahedra; ++t)
    if (!mesh_->is_removed(t) && mesh_->pieces().piece_of(t) == piece)
      last = std::max(last, *std::max_element(mesh_->nodes_of(t), mesh_->nodes_of(t) + 4));
  for (int turn = 0; turn < 2 && known < 3; ++turn) {  // of old nodes, then of all
    known = begin;
    for (; known < 3; ++known) {
      double best = known == 2 ? kLeastHeight : 0;
      std::int32_t found = -1;
      for (std::int32_t t = of.first; t < tetrahedra; ++t) {
        if (mesh_->is_removed(t) || mesh_->pieces().piece_of(t) != piece) continue;
        for (int c = 0; c < 4; ++c) {
          const std::int32_t n = mesh_->nodes_of(t)[c];
          if (n >= (turn == 0 ? first_new : last) || !can_hold_[mesh_->at_rest(n)]) continue;
          const double worth = known == 0   ? 1
                               : known == 1 ? length(at_rest(n) - at_rest(corner[0]))
                                            : height_of(at_rest(corner[0]), at_rest(corner[1]), at_rest(n));
          if (worth > best) best = worth, found = n;
        }
      }
      if (found < 0) break;
      corner[known] = found;
    }
  }
  std::copy(corner + begin, corner + known, node);
  return known - begin;
}

}  // namespace palpate
