// The pieces of a cut body: tetrahedra that are connected through faces that are not open. After a cut two searches begin on both sides of a
// face, in turns; if one of them ends without having met the other, a piece is severed, and all are numbered anew.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/cut/cut_state.h"

namespace palpate {

struct CutPiece {
  std::int32_t tetrahedra = 0;
  std::int32_t first = -1;   // a tetrahedron of it; -1: none is left
  std::int32_t from = -1;    // the piece from which it was severed
  std::int32_t anchors = 0;  // places at rest that a support holds
  std::int32_t is_held = 0;  // 1: three of them are not on one line
  std::int32_t unused = 0;
};

class MeshPieces {
 public:
  // False where memory ends.
  bool create(SceneMemory& memory, const CutState& state);
  // Those of the state as it is.
  void forget();
  std::int32_t count() const { return count_; }
  const CutPiece& piece(std::int32_t i) const { return pieces_[i]; }
  std::int32_t piece_of(std::int32_t tetrahedron) const { return piece_of_[tetrahedron]; }

  // Whether the two tetrahedra are connected. Cost: twice the tetrahedra that the shorter search visits.
  bool connected(std::int32_t one, std::int32_t two);
  // Numbers the pieces that have come apart: the largest part keeps the number, the others get new ones. Cost: all tetrahedra.
  void renumber();
  // The tetrahedron is removed.
  void remove(std::int32_t tetrahedron);
  // Counts the anchors of the pieces anew. Cost: the nodes that are held, and the tetrahedra around them; for each piece that they do not hold,
  // the triangles of the surface that have supports.
  void measure();
  // Tetrahedra that searches have visited since create().
  std::int64_t work() const { return work_; }

 private:
  struct Search {
    std::int32_t* list;
    std::int32_t at, end;
    std::uint32_t mark;
  };
  // 1: goes on, 0: all visited, 2: has met the other one.
  int visit(Search& search, const Search& other);
  Search flood(std::int32_t tetrahedron);
  void add_anchor(CutPiece& piece, std::int32_t node);
  bool is_supported(std::int32_t piece) const;

  struct Line {
    std::int32_t node[2];  // the first two anchors of a piece, at different places
  };
  const CutState* state_ = nullptr;
  std::int32_t* piece_of_ = nullptr;   // [tetrahedra]
  CutPiece* pieces_ = nullptr;         // [tetrahedra]
  Line* lines_ = nullptr;              // [tetrahedra], by piece
  std::int32_t* lists_[2] = {};        // [tetrahedra]
  std::uint32_t* marks_ = nullptr;     // [tetrahedra]
  std::int32_t* held_ = nullptr;       // nodes
  std::int32_t* part_of_ = nullptr;    // [tetrahedra]: while they are numbered anew
  std::int32_t* counted_ = nullptr;    // [tetrahedra], by piece: the last node that was counted for it
  std::int32_t* supported_ = nullptr;  // triangles
  std::int32_t held_count_ = 0, supported_count_ = 0, count_ = 0;
  std::uint32_t mark_ = 0;
  std::int64_t work_ = 0;
};

}  // namespace palpate
