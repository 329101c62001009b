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
  memory.keep(progress_);
  return true;
}

void CutFinish::forget_all() {
  std::fill(tried_, tried_ + 4 * state_->rest().tetrahedra(), std::uint8_t{0});
  progress_ = {};
}

// How many of the faces would wait. They stay pending.
std::int32_t CutFinish::count_left(const std::uint32_t* order) {
  const std::int32_t tried = trial_->try_faces(faces_, count_, order);
  for (std::int32_t i = 0; i < tried; ++i) state_->set(trial_->left()[i], FaceState::pending);
  return count_ - tried;
}

void CutFinish::turn_face(std::int32_t face) {
  const std::int32_t lower = trial_->lower_side(face);
  if (state_->face(face) != FaceState::pending) {
    state_->set(face, FaceState::pending);
    faces_[count_++] = lower;
  } else {
    state_->set(face, FaceState::spared);
    count_ = static_cast<std::int32_t>(std::remove(faces_, faces_ + count_, lower) - faces_);
  }
}

// Whether a face of the tetrahedra is not to be cut.
bool CutFinish::keeps(const Choice& choice) const {
  for (std::int32_t i = 0; i < choice.count; ++i)
    for (std::int32_t face = 4 * choice.tetrahedra[i]; face < 4 * choice.tetrahedra[i] + 4; ++face)
      if (state_->face(face) == FaceState::kept) return true;
  return false;
}

// Gives the tetrahedra to the other side: those of their faces that were to be cut are not, and the others are.
CutFinish::Turn CutFinish::turn(const Choice& choice) {
  Turn turn;
  const std::int32_t* const end = choice.tetrahedra + choice.count;
  for (std::int32_t i = 0; i < choice.count; ++i)
    for (std::int32_t face = 4 * choice.tetrahedra[i]; face < 4 * choice.tetrahedra[i] + 4; ++face)
      turn.before[i][face % 4] = state_->face(face);
  for (std::int32_t i = 0; i < choice.count; ++i)
    for (std::int32_t face = 4 * choice.tetrahedra[i]; face < 4 * choice.tetrahedra[i] + 4; ++face)
      if (!state_->open(face) && std::find(choice.tetrahedra, end, state_->rest().neighbour(face)) == end)
        turn_face(face);
  return turn;
}

void CutFinish::undo(const Choice& choice, const Turn& turn) {
  for (std::int32_t i = 0; i < choice.count; ++i)
    for (std::int32_t face = 4 * choice.tetrahedra[i]; face < 4 * choice.tetrahedra[i] + 4; ++face)
      state_->set(face, turn.before[i][face % 4]);
}

// What may be turned, as the first trial of the cluster has found it: single tetrahedra, then groups.
struct CutFinish::Candidates {
  explicit Candidates(const CutTrial& trial) : sides(2 * trial.faulty_count()), groups(trial.group_count()) {
    std::copy(trial.faulty(), trial.faulty() + sides / 2, faulty);
    for (std::int32_t i = 0; i < groups; ++i) group[i] = trial.group(i);
  }
  std::int32_t count() const { return sides + groups; }
  Choice choice(std::int32_t i, const RestMesh& rest) const {
    Choice made{1, {}};
    if (i < sides) {
      const std::int32_t face = faulty[i / 2];
      made.tetrahedra[0] = i % 2 ? rest.neighbour(face) : face / 4;
    } else {
      const CutTrial::Group& from = group[i - sides];
      made.count = from.count;
      std::copy(from.tetrahedra, from.tetrahedra + from.count, made.tetrahedra);
    }
    return made;
  }
  std::int32_t sides, groups, faulty[CutTrial::kMostFaulty];
  CutTrial::Group group[CutTrial::kMostGroups];
};

CutFinish::Choice CutFinish::best_turn(const std::uint32_t* order) {
  const std::int32_t kept = count_;
  std::copy(faces_, faces_ + count_, kept_);
  std::int32_t least = count_left(order), fewest = 0;
  const Candidates candidates(*trial_);
  Choice best;
  for (; progress_.next < candidates.count() && has_time(); ++progress_.next) {
    if (best.count > 0 && progress_.next >= candidates.sides) return best;
    const Choice choice = candidates.choice(progress_.next, state_->rest());
    if (keeps(choice)) continue;
    const Turn tried = turn(choice);
    const std::int32_t left = count_left(order);
    if (left < least || (left == least && best.count > 0 && count_ < fewest))
      best = choice, least = left, fewest = count_;
    undo(choice, tried);
    count_ = kept;
    std::copy(kept_, kept_ + kept, faces_);
  }
  if (best.count == 0 && progress_.next == candidates.count())
    for (std::int32_t i = 0; i < count_; ++i) tried_[faces_[i]] = 1;
  return best;
}

bool CutFinish::finish(const std::int32_t* faces, std::int32_t count, std::uint32_t* order) {
  ++pass_;
  if (count < 1 || count > kMostFaces) {
    for (std::int32_t i = 0; i < count; ++i) tried_[faces[i]] = 1;
    return false;
  }
  if (progress_.face != faces[0] || progress_.faces != count) progress_ = {faces[0], count, 0};
  count_ = count;
  std::copy(faces, faces + count, faces_);
  std::uint32_t last = 0;
  for (std::int32_t i = 0; i < count; ++i) known_[faces[i]] = pass_, last = std::max(last, order[faces[i]]);
  const Choice best = best_turn(order);
  if (best.count == 0) return false;
  turn(best);
  progress_ = {};
  for (std::int32_t i = 0; i < count_; ++i)
    if (is_new(i)) order[faces_[i]] = last;
  return true;
}

}  // namespace palpate
