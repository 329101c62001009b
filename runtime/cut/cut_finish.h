// Finishes a cut that the blade has passed although faces of it still wait, because no manifold surface has all of them. Such a cut separates two
// sides; here a tetrahedron is given from one side to the other, so that others of its faces are cut in place of those that wait. Of the
// tetrahedra there, the one is taken with which the fewest faces wait, and of equals, with the fewest faces in all.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/cut/cut_state.h"
#include "runtime/cut/cut_trial.h"

namespace palpate {

class CutFinish {
 public:
  static constexpr std::int32_t kMostFaces = 64;  // of a cluster: larger ones wait
  static constexpr std::int32_t kMostTurns = 8;   // tetrahedra that change sides
  // False where memory ends.
  bool create(SceneMemory& memory, CutState& state, CutTrial& trial);

  // Whether the cluster of a face was tried already and nothing has changed since.
  bool is_tried(std::int32_t face) const { return tried_[face]; }
  void forget(std::int32_t face) { tried_[face] = 0; }
  // For pending faces that hang together by nodes, as CutTrial::gather() found them: changes which faces are pending. order: as in
  // CutTrial::try_faces(). Returns whether fewer would be left. Cost: at most kMostTurns times a trial for each tetrahedron at these faces.
  bool finish(const std::int32_t* faces, std::int32_t count, std::uint32_t* order);
  // Of the last one that returned true: the faces that are pending now, and whether each is new.
  std::int32_t count() const { return count_; }
  std::int32_t face(std::int32_t i) const { return faces_[i]; }
  bool is_new(std::int32_t i) const { return known_[faces_[i]] != pass_; }

 private:
  struct Turn {
    FaceState before[4];
  };
  std::int32_t count_left(const std::uint32_t* order);
  bool best_turn(const std::uint32_t* order, std::int32_t* tetrahedron, std::int32_t* left);
  Turn turn(std::int32_t tetrahedron);
  void undo(std::int32_t tetrahedron, const Turn& turn);

  CutState* state_ = nullptr;
  CutTrial* trial_ = nullptr;
  std::uint8_t* tried_ = nullptr;   // [tetrahedra][4], by lower side
  std::uint32_t* known_ = nullptr;  // [tetrahedra][4]: the pass in which the face was pending at first
  std::int32_t faces_[kMostFaces + 4 * kMostTurns + 4];
  std::int32_t kept_[kMostFaces + 4 * kMostTurns + 4];
  std::int32_t count_ = 0;
  std::uint32_t pass_ = 0;
};

}  // namespace palpate
