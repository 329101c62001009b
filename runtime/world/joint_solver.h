// The contacts of several organs as one system: each organ's H W H^T in common rows, where constraints between organs (WorldSource) share
// their rows.
//
// A pair holds the displacement of a vertex of one organ less that of a place of the other one. Both organs have a constraint for it, the
// frame of one with n and that of the other with -n in front, so that one reaction r acts on both, and the joint matrix is the sum
//     (H_a W_a H_a^T + H_b W_b H_b^T) r >= d,   r >= 0,   r ((...) r - d) = 0.
#pragma once

#include <cstdint>

#include "runtime/contact/body.h"

namespace palpate {

// index: of a pair the other organ, of a link the first one of its thread. point: of a pair which vertex, and of which of the two organs.
constexpr ContactSource kPairSource{PALPATE_SOURCE_ORGAN}, kWorldLinkSource{PALPATE_SOURCE_WORLD_LINK};
// Whether it belongs to the joint system alone.
inline bool is_between_organs(const ContactId& contact) {
  return contact.source >= kPairSource;
}

struct JointOrgan {
  BodySystem body;  // with the targets that are left for the reactions
  const ContactConstraints* set = nullptr;
  Vec3* force = nullptr;  // [node_count] N, overwritten
};
// A constraint between two organs, or within one that a source of a world adds.
struct JointConstraint {
  std::int32_t organ[2] = {};             // of the world
  std::int32_t constraint[2] = {-1, -1};  // in the organ's set; -1: that side does not move
  ContactLaw law = ContactLaw::unilateral;
  double friction = 0;
  double give = 0;      // share of its rows' own compliance by which it gives way besides
  bool joined = false;  // its row is that of the one before, as the parts of one thread have it
  Vec3 target;          // m, for the bodies: without what offsets do
  Vec3 reaction;        // N; in: of the last step
  double gap = 0;       // m, along the first row, when it was solved
};
// Both sides stand still: there is nothing to solve.
inline bool is_held(const JointConstraint& joint) {
  return joint.constraint[0] < 0 && joint.constraint[1] < 0;
}

class JointSolver {
 public:
  // Of all organs that may be solved together; rows and constraints: those between them counted once.
  bool create(SceneMemory& memory, std::int32_t organ_count, std::int32_t rows_of_organ, std::int32_t rows,
              std::int32_t constraints);

  // Solves the constraints of the organs `members` and the joints between them, and sets the reactions of the organs' systems, which have
  // been prepared. organs: [organ_count], by their numbers in the world. Returns whether the laws are met. operations: that it may take.
  // Cost: the sum of the squares of the organs' rows, and the laws (law_solver.h).
  bool solve(const JointOrgan* organs, const std::int32_t* members, std::int32_t member_count,
             JointConstraint* const* joints, std::int32_t joint_count, Operations operations);
  const LawEffort& effort() const { return system_.effort(); }

 private:
  std::int32_t* row_of(std::int32_t organ) { return row_of_ + static_cast<std::size_t>(organ) * rows_of_organ_; }
  const RowMatrix& matrix_of(std::int32_t organ) const { return *organs_[organ].body.matrix; }
  std::int32_t row_of_side(const JointConstraint& joint, int side, int i) const;
  double left_of_target(const JointConstraint& joint, int i) const;
  std::int32_t take_row(double target, double reaction);
  void list_rows_of_organs();
  void list_rows_of_joints();
  void bound_joined();
  void sum_matrices();
  void set_reactions();
  double farthest(Operations kept, StepWork* work);
  class Nodes;

  std::size_t rows_of_organ_ = 0;
  RowMatrix matrix_;
  SystemSolver system_;
  // Of a solve:
  const JointOrgan* organs_ = nullptr;
  const std::int32_t* members_ = nullptr;
  JointConstraint* const* joints_ = nullptr;
  std::int32_t member_count_ = 0, joint_count_ = 0;
  ContactConstraint* constraints_ = nullptr;
  RowsOfConstraint* rows_ = nullptr;
  std::int32_t* row_of_ = nullptr;  // [organs][rows of an organ] joint row; -1: none
  std::int32_t* list_ = nullptr;    // [rows of an organ]
  std::int32_t constraint_count_ = 0;
};

}  // namespace palpate
