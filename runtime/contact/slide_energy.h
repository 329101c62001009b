// Keeps contacts that slide from giving energy: what they give back in a way is at most what their tools have put in.
//
// A contact holds the surface at rest at an anchor, and while it slides the anchor moves to where the surface is stiffer or softer. The
// energy of the contacts is half the sum of reactions times targets. Where it rises by more than the tools' work and what the contacts have
// lost before in the same touch, the contacts that slide give way: each target along the normal gets shorter by a part of it, the slack,
// until the energy is what was paid for. The slack goes back as the contacts lose energy in softer places. Places on an axis in
// the tissue do the same: they are then held aside of the axis.
#pragma once

#include <array>
#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/contact/contact_rows.h"
#include "runtime/contact/contact_solver.h"

namespace palpate {

class SlideEnergy {
 public:
  // What a touch knows about constraint p of a step.
  struct Sliding {
    Vec3 at,
        from;  // m, where its tool holds it, less what the offset has moved the surface there; where that was before it began
    Vec3 axis;  // of what holds places on an axis, unit; the place is `reach` (m) along it from `at`
    double reach = 0;
    // m, along its rows: how far it is held from rest, or how far all that slide push it by themselves, where that stores more.
    Vec3 way;
    double* slack = nullptr;  // m, of a contact on the surface
    Vec3* aside = nullptr;    // m, of such a place
    bool slides() const { return slack || aside; }
    // Takes back of the slack as much as lengthens the depth (m) by the share `more`; of a slack past where the contact pushes, what is past.
    void lengthen(double depth, double push, double more) const;
  };

  bool create(SceneMemory& memory, std::int32_t constraint_capacity);
  // Made: the scene keeps this account.
  bool exists() const { return sliding_ != nullptr; }
  void forget();

  // Whether something else bears a force, as a grip or another organ: targets are then no measure of what contacts that slide store.
  static bool is_shared(const ContactSolver& solver, const ContactConstraints& acting, const Sliding* sliding);

  // After a solve. sliding: [constraint_count], of this step; acting: the targets that were solved. True where contacts have shorter targets in
  // `rows` now, so that the step is to be solved again. Cost: some 50 operations for each constraint.
  // apart: is_shared(), and the step has room for 2 rows^2 multiply-adds. Without it the targets are the ways.
  bool give_way(const ContactSolver& solver, const ContactConstraints& acting, Sliding* sliding, bool apart,
                ContactRows& rows);
  // After the last solve of a step. What is still given too much is taken back in the next one. False where contacts have given more energy than
  // the tolerance allows, but in a step in which one begins: the energy is next to nothing there, and so is what it is compared with.
  // met: the solution meets its targets and laws. Else it costs rows^2 multiply-adds.
  bool end(const ContactSolver& solver, const ContactConstraints& acting, Sliding* sliding, bool met, bool apart);

  Sliding* sliding() { return sliding_; }  // [constraint_capacity]

 private:
  // A constraint of the last step.
  struct Held {
    ConstraintId id;
    std::int32_t slides, unused;
    Vec3 target, reaction;  // m and N, in its frame
    double energy;          // J
    Vec3 force, at, axis;   // N and m, in the organ's frame
  };
  // J, of a step's solution.
  struct Sum {
    bool known = false;
    bool begins = false;  // a contact that slides was not there in the last step
    double created =
        0;              // energy less work since the last step; not known where other constraints came, went or changed
    double stored = 0;  // in contacts that slide, by their ways
    double moved = 0;   // of that, in those whose rows are new
  };
  void find_ways(const ContactSolver& solver, const ContactConstraints& acting, Sliding* sliding, bool met,
                 bool apart) const;
  Sum sum_up(const ContactSolver& solver, const ContactConstraints& acting, const Sliding* sliding, bool met) const;
  void shorten(const ContactSolver& solver, const ContactConstraints& acting, const Sliding* sliding, double excess,
               const Sum& sum, ContactRows* rows) const;
  void lengthen(const ContactConstraints& acting, const Sliding* sliding, double stored) const;

  Held* held_ = nullptr;  // [constraint_capacity]
  Sliding* sliding_ = nullptr;
  double* own_ = nullptr;  // [rows] N, the reactions of contacts that slide
  std::int32_t count_ = 0;
  double lost_ = 0;  // J, by the contacts in this touch, not yet given back
};

}  // namespace palpate
