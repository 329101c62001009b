// The contacts of several organs as one system: each organ's H W H^T in common rows, where a pair of two organs shares its rows, and so does
// a link between them (world_links.h).
//
// A pair holds the displacement of a vertex of one organ less that of a place of the other one. Both organs have a constraint for it, the
// frame of one with n and that of the other with -n in front, so that one reaction r acts on both, and the joint matrix is the sum
//     (H_a W_a H_a^T + H_b W_b H_b^T) r >= d,   r >= 0,   r ((...) r - d) = 0.
#pragma once

#include <cstdint>

#include "runtime/contact/contact_solver.h"

namespace palpate {

// index: of a pair the other organ, of a link the first one of its thread. point: of a pair which vertex, and of which of the two organs.
constexpr ContactSource kPairSource{PALPATE_SOURCE_ORGAN}, kWorldLinkSource{PALPATE_SOURCE_WORLD_LINK};
// Whether it belongs to the joint system alone.
inline bool is_between_organs(const ContactId& contact) {
  return contact.source >= kPairSource;
}

struct JointOrgan {
  ContactSolver* solver = nullptr;
  const ContactConstraints* set = nullptr;  // with the targets of contacts, without what offsets do
  Vec3* force = nullptr;                    // [node_count] N, overwritten
};
struct JointPair {
  std::int32_t organ[2] = {};             // among the JointOrgans
  std::int32_t constraint[2] = {-1, -1};  // in the organ's set; -1: that side does not move
  ContactLaw law = ContactLaw::unilateral;
  double friction = 0;
  double give = 0;      // share of its rows' own compliance by which the pair gives way besides
  bool joined = false;  // its row is that of the pair before, as the parts of one thread have it
  Vec3 target;          // m, for the contacts: without what offsets do
  Vec3 reaction;        // N; in: of the last step
  double gap = 0;       // m, along the normal, when it was solved
};

class JointSolver {
 public:
  // organs: the solvers of all organs that may be solved together; rows and constraints: of all of them, pairs and links counted once.
  bool create(SceneMemory& memory, std::int32_t organ_count, std::int32_t rows_of_organ, std::int32_t rows,
              std::int32_t constraints);

  // Solves the organs' constraints and the pairs, and sets the reactions of the organs' solvers, which have been prepared. Returns whether
  // the laws are met. operations: that it may take.
  // Cost: the sum of the squares of the organs' rows, and the laws (law_solver.h).
  bool solve(const JointOrgan* organs, std::int32_t organ_count, JointPair* pairs, std::int32_t pair_count,
             Operations operations);
  const LawEffort& effort() const { return system_.effort(); }

 private:
  std::int32_t* row_of(std::int32_t organ) { return row_of_ + static_cast<std::size_t>(organ) * rows_of_organ_; }
  void list_rows(const JointOrgan* organs, std::int32_t organ_count, const JointPair* pairs, std::int32_t pair_count);
  void join_row(const JointOrgan* organs, const JointPair& pair, RowsOfConstraint* first);
  void bound_joined(const JointOrgan* organs, const JointPair* pairs, std::int32_t pair_count);
  void sum_matrices(const JointOrgan* organs, std::int32_t organ_count, const JointPair* pairs,
                    std::int32_t pair_count);
  void set_reactions();
  double farthest(Operations kept, StepWork* work);
  class Nodes;

  std::size_t rows_of_organ_ = 0;
  RowMatrix matrix_;
  SystemSolver system_;
  const JointOrgan* organs_ = nullptr;  // during a solve
  std::int32_t organ_count_ = 0;
  ContactConstraint* constraints_ = nullptr;
  RowsOfConstraint* rows_ = nullptr;
  std::int32_t* row_of_ = nullptr;  // [organs][rows of an organ] joint row; -1: none
  std::int32_t* list_ = nullptr;    // [rows of an organ]
  std::int32_t constraint_count_ = 0;
};

}  // namespace palpate
