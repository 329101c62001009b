// Finishes a cut that the blade has passed although faces of it still wait, because no manifold surface has all of them. Such a cut separates two
// sides; here a tetrahedron is given from one side to the other, so that others of its faces are cut in place of those that wait. Of the
// tetrahedra where the surface has its faults, the one is taken with which the fewest faces wait, and of equals, with the fewest faces in all.
// Where none helps, all tetrahedra of a component at a node change sides (CutTrial::Group).
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/cut/cut_state.h"
#include "runtime/cut/cut_trial.h"

namespace palpate {

class CutFinish {
 public:
  static constexpr std::int32_t kMostFaces = 256;   // of a cluster: larger ones wait
  static constexpr std::int64_t kMostWork = 20000;  // of CutTrial::work() in a step, after which no trial begins
  // False where memory ends.
  bool create(SceneMemory& memory, CutState& state, CutTrial& trial);
  void forget_all();

  // The work of a step begins.
  void begin_step() { step_begin_ = trial_->work(); }
  bool has_time() const { return trial_->work() - step_begin_ < kMostWork; }
  // Whether the cluster of a face was tried already and nothing has changed since.
  bool is_tried(std::int32_t face) const { return tried_[face]; }
  void forget(std::int32_t face) { tried_[face] = 0; }
  // For pending faces that hang together by nodes, as CutTrial::gather() found them: gives a tetrahedron to the other side, and so changes which
  // faces are pending. order: as in CutTrial::try_faces(). Returns whether fewer would be left. Where the work of a step ends before all
  // tetrahedra at the faults were tried, the next call for this cluster goes on with the others.
  bool finish(const std::int32_t* faces, std::int32_t count, std::uint32_t* order);
  // Of the last one that returned true: the faces that are pending now, and whether each is new.
  std::int32_t count() const { return count_; }
  std::int32_t face(std::int32_t i) const { return faces_[i]; }
  bool is_new(std::int32_t i) const { return known_[faces_[i]] != pass_; }

 private:
  // Tetrahedra that are given to the other side together.
  struct Choice {
    std::int32_t count = 0;
    std::int32_t tetrahedra[CutTrial::Group::kMost] = {};
  };
  struct Turn {
    FaceState before[CutTrial::Group::kMost][4];
  };
  struct Candidates;
  std::int32_t count_left(const std::uint32_t* order);
  Choice best_turn(const std::uint32_t* order);
  bool keeps(const Choice& choice) const;
  Turn turn(const Choice& choice);
  void undo(const Choice& choice, const Turn& turn);
  void turn_face(std::int32_t face);

  CutState* state_ = nullptr;
  CutTrial* trial_ = nullptr;
  std::uint8_t* tried_ = nullptr;   // [tetrahedra][4], by lower side
  std::uint32_t* known_ = nullptr;  // [tetrahedra][4]: the pass in which the face was pending at first
  std::int32_t faces_[kMostFaces + 4 * CutTrial::Group::kMost];
  std::int32_t kept_[kMostFaces];
  std::int32_t count_ = 0;
  std::uint32_t pass_ = 0;
  std::int64_t step_begin_ = 0;
  // How far the candidates of the last cluster were tried.
  struct Progress {
    std::int32_t face = -1, faces = 0, next = 0;
  } progress_;
};

}  // namespace palpate
