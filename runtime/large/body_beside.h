// Large deformation beside the touch: one thread solves the hyperelastic body under the newest contacts, and the touch goes on from
// its newest solution by the linear response.
//
// A solution is the displacement u of all nodes under the forces f that hold the contacts at their targets. What the linear organ
// does not do of it is o = u - Y f, where Y f is the linear response (large_solver.h). The touch solves the linear contacts with
// the targets d - W o, and adds o to the displacement that they make. Where the targets are those of the solution, forces and shape are
// those of the solution, too. Where they are not, o goes on as it went from the last solution to the newest one: o is a smooth function
// of the targets, and s = (d - d_n) . (d_n - d_(n-1)) / |d_n - d_(n-1)|^2, within -1 and 1, says how far along their change the
// targets are now. Where that would have missed the newest solution by more than half of what o_n alone missed it by, as after a turn
// of a tool, o stays. Nothing of this enters the solutions.
//
// o cancels a part of Y f. In tissue that has stiffened many times the linear organ has far more energy under f than the body, and Y f is far longer than u.
// Where contacts end or let go before a new solution comes, a part of Y f is missing, and what is left of o would throw the surface. So what a step has
// lost of f may give the linear organ no more energy than the body had, E. With f Y f / 2 = b^2 E and l^2 the energy of the lost forces, o is scaled by
// sqrt(E) / l, where this is below 1 and b above 2, until the next solution; between b = 1 and 2 the scale goes there from 1. l is the sum over the contacts
// of the root of what each one's loss alone would give. It counts the whole force of one that has ended or let go, and of the others the changes beyond half
// of all forces, or all of them where a change of the mesh waits. No o gets shorter than kBehindUnknown, nor than what the offset moves; but where no contact is
// left, o gets that short.
//
// Where the mesh is cut, the forces open the linear organ at once. With b above 2 this is subtracted from o, so that nothing moves, and no other change is
// made until a solution of the changed mesh has come.
//
// Where the scene's offset (contact/offset.h) moves the body, all of this is relative to it: the thread gets its amounts with the contacts and with what
// they leave of the targets, and what they have moved since then is the touch's linear displacement.
//
// Two mailboxes (palpate_mailbox.h) connect the threads. Neither waits for the other.
#pragma once

#include <cmath>
#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/contact/added_field.h"
#include "runtime/contact/contact_constraints.h"
#include "runtime/contact/contact_solver.h"
#include "runtime/contact/offset.h"
#include "runtime/include/palpate/palpate_mailbox.h"
#include "runtime/large/deforming_body.h"
#include "runtime/large/mesh_follower.h"
#include "runtime/large/turned_surface.h"

namespace palpate {

class BodyBeside {
 public:
  struct Limits {
    std::int32_t nodes = 0, constraints = 0;  // most of each in a step
    std::int32_t field_nodes = 0,
                 surface_nodes = 0;  // whose displacements a solution has; at least those of the surface
    MeshStream* stream = nullptr;    // of a mesh that is cut, borrowed; nullptr: it stays whole
  };
  // A step is not to be trusted (DEFORMATION_BEHIND) where its contacts are estimated to miss the solution of their targets by this
  // share of what the linear organ does at them, and by more than kLeastMiss metres. The estimate is what the newest solution says that it
  // misses itself, and the way from it, times what the touch missed a solution by, for each metre of way, when it came, and what that has grown by since the solution
  // before. Aside of the way between the last two solutions nothing is known: there the tissue may miss the force of the linear organ by the
  // share by which it did on the way. Where no solution has told that, contacts may be kBehindUnknown metres from the newest one.
  // docs/method.md, section 14, has the errors.
  static constexpr double kBehind = 0.05, kLeastMiss = 5e-5, kBehindUnknown = 1e-3;
  // A solution is unfinished above this residual (LargeOutcome), as a step in the touch.
  static constexpr double kUnfinished = LargeSolver::kUnfinished;

  // body: made, borrowed; only deform() and restored() use it. offset: borrowed; the other thread reads its rows alone.
  bool create(SceneMemory& memory, DeformingBody* body, Offset* offset, const Limits& limits);
  // The mesh is cut: a new node has from now on what another one has.
  void copy_node(std::int32_t from, std::int32_t to);
  // MeshFollower.
  bool holds_back() const { return opens_too_far(told_); }
  void hold_back(const float* released, double energy);
  // For constraints with frames; as TurnedSurface::create. False where memory ends.
  bool follow_normals(SceneMemory& memory, const TurnedSurface::Source& surface) {
    return turned_.create(memory, surface);
  }

  // ---- the thread of the touch ----
  // What the newest solution says about itself.
  struct Told {
    std::int32_t steps = 0, cut = 0, unfinished = 0, failed = 0;
    double residual = 0, least_volume = 1;
    double off =
        0;  // rad, of the frames of its contacts from the surface's normals: its forces miss as much of themselves
    double energy = 0;             // J, of the body
    double given = 0;              // J, that the offset has given it since forget()
    double spring = 0;             // J, of the linear organ under the same forces
    std::int32_t followed = 0;     // numbers of the mesh's stream
    std::int32_t awaits_mesh = 0;  // 1: the mesh has changed since, and the next solution has to have all changes
  };
  // Takes the newest solution, and returns the constraints of a step as the linear organ is to hold
  // them: along the normals of the solution, and less what the solution adds. They are valid until the next call.
  // knows_targets: of all constraints; else o does not go on. *fresh: the solution is new. Cost: a pass over the nodes; six triangles a
  // contact node.
  const ContactConstraints& take(const ContactConstraints& set, bool knows_targets, bool* fresh);
  // Other targets of the same constraints, for what take() has returned.
  void take_targets(const ContactConstraints& set);
  // Gives the constraints to the other thread, with the last targets.
  void give();
  // After the linear organ has been solved: what is added is bounded by the forces that it has. True: it is less than before, so that the
  // step is to be solved again.
  bool lose(const ContactSolver& solver);
  // m, along its rows: what is added at constraint p of those that take() has returned.
  Vec3 added_on(std::int32_t p) const;
  // The constraints of the step with what the offset leaves of their targets; after take(), until the next call.
  const ContactConstraints& left() const { return left_; }
  const Told& told() const { return told_; }
  // The contacts of this step are too far from the newest solution.
  bool behind() const {
    return behind_ != 0 || borne_.is_less || (limits_.stream && told_.followed != limits_.stream->end());
  }
  // No solution before the newest one was at its targets with contacts.
  bool is_first() const { return settled_ == 0; }
  const AddedField& added() const { return added_; }
  // J, of the body in this step: that of the newest solution, and what the touch has moved the linear organ and o since. force:
  // [constraint_count] N, of take()'s constraints on the body, in the organ's axes.
  double energy(const Vec3* force) const;
  // Forgets all solutions, also those that the other thread has not made yet.
  void forget();

  // ---- the other thread ----
  // Solves the newest contacts a little further, eight steps of the method at most, and publishes the solution. Then the body goes on with
  // its next metric, where it renews it.
  // Returns the evaluations of the energy that it took; 0: there was nothing to do.
  std::int32_t deform();

  // Completes a restored state (scene_memory.h) by what follows from it. No other thread may be in deform().
  void restored();

 private:
  struct Job {
    std::uint64_t begun;  // counts forget()
    std::int32_t node_count, constraint_count;
    std::int32_t first_change, change_numbers;  // of the mesh's stream
  };
  struct Solved {
    ConstraintId id;
    Vec3 target;      // m, in the organ's axes
    Mat3 frame;       // the constraint's own times this is the one along which the solution has its laws
    Mat3 stiffness;   // N/m, of the linear response along the rows that hold
    Mat3 compliance;  // m/N, of the linear response to its own force
    Vec3 force;       // N, on the body
    double metres;    // metres_of() it
  };
  // By what the touch misses a solution, of the worst contact.
  struct Miss {
    double displacement = 0, force = 0;  // m, N
  };
  // What solutions have told of the miss.
  struct KnownMiss {
    // When solutions came, for each metre on the way from one to the next: with o going on or not, as it does; what of that the newest one
    // had more than the one before; with o as it was.
    Miss missed, grown;
    double at_rest = 0, share = 0;  // the last one's force, of the linear organ's force on the way
    std::int32_t is_known = 0, unused = 0;
  };
  // What the forces of the touch bear of the newest solution's o.
  struct Borne {
    double share = 1;                        // the least since the solution
    double whole = 0;                        // m, the longest displacement of o in this step, as the solution has it
    bool is_less = false, is_known = false;  // in this step: o has been made shorter; after a solve
  };
  struct Solution {
    std::uint64_t begun;
    Told told;
    std::int32_t constraint_count, unused;
  };
  // Of the offset between solutions and since the newest one.
  struct MovedBy {
    double rate =
        0;  // by how much o has changed for each metre that the offset has moved a node, from one solution to the next
    std::int32_t is_known = 0, unused = 0;
  };
  // In a slot of a mailbox the arrays follow the head.
  ContactNode* nodes_of(Job* job) const { return reinterpret_cast<ContactNode*>(job + 1); }
  ContactConstraint* constraints_of(Job* job) const {
    return reinterpret_cast<ContactConstraint*>(nodes_of(job) + limits_.nodes);
  }
  Vec3* targets_of(Job* job) const { return reinterpret_cast<Vec3*>(constraints_of(job) + limits_.constraints); }
  double* amounts_of(Job* job) const { return reinterpret_cast<double*>(targets_of(job) + limits_.constraints); }
  RowVolume* volumes_of(Job* job) const { return reinterpret_cast<RowVolume*>(amounts_of(job) + offset_->count()); }
  std::int32_t* changes_of(Job* job) const { return reinterpret_cast<std::int32_t*>(volumes_of(job) + volume_count()); }
  bool follow_changes(Job* job);
  std::int32_t volume_count() const { return offset_->volumes() ? offset_->count() : 0; }
  double* amounts_of(Solution* solution) const { return reinterpret_cast<double*>(solution + 1); }
  RowVolume* volumes_of(Solution* solution) const {
    return reinterpret_cast<RowVolume*>(amounts_of(solution) + offset_->count());
  }
  Solved* solved_of(Solution* solution) const {
    return reinterpret_cast<Solved*>(volumes_of(solution) + volume_count());
  }
  float* added_of(Solution* solution) const {
    return reinterpret_cast<float*>(solved_of(solution) + limits_.constraints);
  }
  float* displacement_of(Solution* solution) const {
    return added_of(solution) + 3 * static_cast<std::size_t>(limits_.field_nodes);
  }
  bool make_mailbox(SceneMemory& memory, std::size_t bytes, std::uint64_t** box);
  palpate_mailbox* jobs() const { return reinterpret_cast<palpate_mailbox*>(jobs_); }
  palpate_mailbox* solutions() const { return reinterpret_cast<palpate_mailbox*>(solutions_); }
  Solution* take_newest(bool* fresh);
  void copy(Solution* newest);
  static bool opens_too_far(const Told& told) { return told.spring > 4 * std::fabs(told.energy); }
  template <class Force>
  double share_borne(const ContactConstraints& set, Force force_of) const;
  bool bear(const ContactConstraints& set, double share);
  void send(const ContactConstraints& set);
  void turn_frames(const float* displacement);
  // At the targets target(p), of constraints 0 .. count - 1 in the organ's axes.
  template <class Target>
  double share(std::int32_t count, Target target) const;
  bool same_contacts(const Solved* solved, std::int32_t count, const ContactConstraints& set) const;
  void publish(const ContactConstraints& set, Job* job, const DeformingBody::Outcome& outcome);
  void leave_out_followers(const ContactConstraints& set, const RowVolume* volumes, float* beyond);
  static double by_turning(const ContactConstraint& constraint, const Solved& now, const Solved& before);
  void measure_miss(const ContactConstraints& set, Solution* newest);
  double way_to_new(const ContactConstraints& set, std::int32_t p) const;
  bool is_behind(const ContactConstraints& set) const;
  double way_between(const double* from, const double* to) const;
  void take_left(const ContactConstraints& set);
  void aim(const ContactConstraints& set);
  void measure_moved();
  bool is_moved_too_far(double largest) const;
  void expect(const Solved& solved, Vec3 target, Vec3 along, Miss* miss) const;
  void forget_miss();
  Vec3 moved_on(const ContactConstraint& constraint) const;
  const Solved* solved_of(const ContactConstraint& constraint) const;

  DeformingBody* body_ = nullptr;
  Offset* offset_ = nullptr;
  TurnedSurface turned_;
  Limits limits_;
  std::uint64_t *jobs_ = nullptr, *solutions_ = nullptr;  // the mailboxes' memory
  // Of the touch:
  AddedField added_;
  float* beyond_[2] = {};    // [field nodes][3] m, o of the newest solution and of the last one, turn by turn
  double* amounts_[2] = {};  // of the offset, of the same
  Solved* solved_[2] = {};   // [constraints]
  std::int32_t solved_count_[2] = {}, newest_ = 0;
  ContactConstraints acting_, left_;
  const float* displacement_ =
      nullptr;  // [surface_nodes][3] m, of the newest solution, until the next take(); nullptr: there is none
  MovedBy moved_by_;
  Told told_;
  KnownMiss miss_;
  std::int32_t goes_on_ = 0;  // o does, between solutions
  Borne borne_;
  std::int32_t behind_ = 0;
  std::int32_t settled_ =
      0;  // a solution with contacts before the newest one was at its targets, and none has failed since
  std::uint64_t begun_ = 1;
  std::int32_t solutions_taken_ = 0;  // since forget(); 2 and more count as 2
  struct Thread {
    ContactConstraints set;
    Vec3* force = nullptr;      // [nodes] N
    OffsetFollowers followers;  // of the last solution
    double given = 0;           // J, by the offset since forget()
    std::uint64_t begun = 1;
    std::int32_t published = 0;  // constraints of the last solution
    std::int32_t doubted = 0;    // the last solution is not to be trusted
    std::int32_t followed = 0;   // numbers of the mesh's stream
  } thread_;                     // of the other one
};

}  // namespace palpate
