// Links between places of the organ, or from a place to the world: sutures, clips, ligaments, springs. A link is a constraint among
// those of the contacts: the weights of its first end are positive and those of its second end negative, so that its row holds the
// displacement of one end against the other.
//     t . (u_a - u_b) + (1/k) T = t . (b - a) - L      a, b: the ends at rest; t: unit, from a to b; L: rest length; T: tension
// A thread is unilateral, T >= 0; a slack one has no row. A clip has three rows, with b - a as its target.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/contact/contact_admission.h"
#include "runtime/contact/contact_rows.h"
#include "runtime/contact/contact_solver.h"
#include "runtime/contact/touchable_disc.h"
#include "runtime/pose/pose.h"

namespace palpate {

// What a link is and what the steps have left of it: a saved state holds all of it.
struct Link {
  palpate_link given = {};
  LinkEnd ends[2];
  Vec3 along;                // unit, t; zero: not known yet
  double rest_length = 0;    // m, L
  Mat3 own;                  // m/N, the compliance of one end against the other in the last step that had its row
  std::int32_t taut = 0;     // its tension was above zero in the last step
  std::int32_t row_of = -1;  // its constraint in this step
  std::int32_t fresh = 0;    // its ends are where the last step left them
  palpate_link_condition before = PALPATE_LINK_SLACK;  // the step before
  double reach =
      0;  // m / sqrt(J): a field of that norm moves one end against the other at most by reach norm (surface_tree.h)
  double path = 0;  // sqrt(J), of the field's changes, when its ends were found
  palpate_link_state state = {};
};

class Links {
 public:
  // All borrowed. The disc's patch and measure are nullptr where contacts are no discs.
  struct Source {
    DiscSource disc;
    const double* stiffness;        // [S][3][3] N/m, of each column
    const std::int32_t* triangles;  // [F][3]
    std::int32_t triangle_count;
  };
  bool create(SceneMemory& memory, const Source& source, std::int32_t capacity);

  // palpate_scene_set_links states the contract.
  palpate_status set(const palpate_link* links, std::int32_t count, palpate_error* error);
  // The links stay, and are as they were when they were given.
  void forget();

  // A step, in order: how many links will ask for rows; their rows; what became of them.
  std::int32_t begin(const OrganPose& organ, const Tensors& tensors, const ContactSolver& solver);
  std::uint32_t request(ContactRows& rows, ContactAdmission& admission);
  // What end() takes for the links that act, with so many contact nodes. Slack ones do not count: they change nothing of a step.
  Operations operations_to_end(std::int32_t contact_nodes) const;
  // Returns step flags. Cost: for each node of a link 9 multiply-adds for each contact node, at distant addresses where it is slack. A
  // slack thread costs a length while a bound on the motion of its ends shows that it stays slack; all of them together then cost rows^2
  // multiply-adds.
  std::uint32_t end(const Tensors& tensors, const ContactConstraints& set, const Vec3* force, const Vec3* modified,
                    const ContactSolver& solver, bool solved, std::uint64_t step);

  std::int32_t count() const { return count_; }
  // Finds the ends of a link that a bound has spared, which changes no later step.
  const palpate_link_state* state(std::int32_t link, const Tensors& tensors, const ContactSolver& solver) const;
  // For the report: the condition in this step and the one before.
  const Link& link(std::int32_t i) const { return links_[i]; }

 private:
  Vec3 at(const LinkEnd& end) const { return end.rest + end.moved; }
  bool acts(const Link& link) const;
  void find_end(const palpate_link& link, const palpate_link_end& from, LinkEnd* to);
  void find_disc(const SurfacePoint& place, double radius, LinkEnd* to);
  double reach_of(const LinkEnd& end) const;
  void turn(Link& link) const;
  void start(Link& link, const palpate_link& given, std::int32_t index);
  static Vec3 last_move(const LinkEnd& end, const Tensors& tensors, const ContactSolver& solver);
  void move_ends(Link& link, const Tensors& tensors, const ContactConstraints& set, const Vec3* force,
                 const Vec3* modified, const ContactSolver& solver) const;
  std::uint32_t read_solution(Link& link, const ContactConstraints& set, const ContactSolver& solver,
                              std::uint64_t step) const;
  void run_on();
  bool in_chain(std::int32_t i) const;
  bool may_rest(std::int32_t i) const;
  double longest(const Link& link) const;
  bool walk(const ContactConstraints& set, const ContactSolver& solver, bool solved);

  Source source_ = {};
  Link *links_ = nullptr, *coming_ = nullptr;  // [capacity]
  std::int32_t capacity_ = 0, count_ = 0;
  double path_ = 0;  // sqrt(J), sum of the norms of the field's changes, as far as they were measured
};

}  // namespace palpate
