#include "runtime/cut/cut_finish.h"

#include <algorithm>

namespace palpate {

bool CutFinish::create(SceneMemory& memory, CutState& state, CutTrial& trial) {
  state_ = &state, trial_ = &trial;
  const auto faces = 4 * static_cast<std::size_t>(state.rest().tetrahedra());
  tried_ = memory.array<std::uint8_t>(faces);
  known_ = memory.array<std::uint32_t>(faces);
  if (memory.failed()) return false;
  memory.keep_array(tried_, faces);
  return true;
}

// How many of the faces would wait. They stay pending.
std::int32_t CutFinish::count_left(const std::uint32_t* order) {
  const std::int32_t tried = trial_->try_faces(faces_, count_, order);
  for (std::int32_t i = 0; i < tried; ++i) state_->set(trial_->left()[i], FaceState::pending);
  return count_ - tried;
}

// Gives the tetrahedron to the other side: those of its faces that were to be cut are not, and the others are.
CutFinish::Turn CutFinish::turn(std::int32_t tetrahedron) {
  Turn turn;
  for (std::int32_t face = 4 * tetrahedron; face < 4 * tetrahedron + 4; ++face) {
    turn.before[face % 4] = state_->face(face);
    if (state_->open(face)) continue;
    const std::int32_t lower = trial_->lower_side(face);
    if (state_->face(face) == FaceState::pending) {
      state_->set(face, FaceState::spared);
      count_ = static_cast<std::int32_t>(std::remove(faces_, faces_ + count_, lower) - faces_);
    } else {
      state_->set(face, FaceState::pending);
      faces_[count_++] = lower;
    }
  }
  return turn;
}

void CutFinish::undo(std::int32_t tetrahedron, const Turn& turn) {
  for (std::int32_t face = 4 * tetrahedron; face < 4 * tetrahedron + 4; ++face)
    state_->set(face, turn.before[face % 4]);
}

bool CutFinish::best_turn(const std::uint32_t* order, std::int32_t* tetrahedron, std::int32_t* left) {
  const std::int32_t kept = count_;
  std::copy(faces_, faces_ + count_, kept_);
  std::int32_t best = -1, least = *left, fewest = 0;
  for (std::int32_t i = 0; i < 2 * kept; ++i) {
    const std::int32_t face = kept_[i / 2], at = i % 2 ? state_->rest().neighbour(face) : face / 4;
    if (at == best) continue;
    const Turn tried = turn(at);
    const std::int32_t now = count_left(order);
    if (now < least || (now == least && best >= 0 && count_ < fewest)) best = at, least = now, fewest = count_;
    undo(at, tried);
    count_ = kept;
    std::copy(kept_, kept_ + kept, faces_);
    if (best >= 0 && least == 0 && fewest < kept) break;
  }
  *tetrahedron = best, *left = least;
  return best >= 0;
}

bool CutFinish::finish(const std::int32_t* faces, std::int32_t count, std::uint32_t* order) {
  ++pass_;
  for (std::int32_t i = 0; i < count; ++i) tried_[faces[i]] = 1, known_[faces[i]] = pass_;
  if (count < 1 || count > kMostFaces) return false;
  count_ = count;
  std::copy(faces, faces + count, faces_);
  std::uint32_t last = 0;
  for (std::int32_t i = 0; i < count; ++i) last = std::max(last, order[faces_[i]]);
  std::int32_t left = count_left(order), turns = 0;
  for (std::int32_t tetrahedron = -1; left > 0 && turns < kMostTurns && best_turn(order, &tetrahedron, &left); ++turns)
    turn(tetrahedron);
  for (std::int32_t i = 0; i < count_; ++i)
    if (is_new(i)) order[faces_[i]] = last;
  return turns > 0;
}

}  // namespace palpate
