// Keeps contacts that slide on a hyperelastic body from giving energy: what slide_energy.h does on the linear organ, with the energy of the
// body itself.
//
// A body that has more energy than the tools have put in has some that nobody paid for: an anchor moved to a stiffer place, or a frame turned.
// The contacts that slide then give way: their targets along the normal get shorter by the slack, until the energy is what was paid for. The
// slack goes back as contacts lose energy. Where the body is solved beside the touch, its energy in a step is an estimate (BodyBeside::energy).
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/contact/contact_rows.h"
#include "runtime/contact/slide_energy.h"

namespace palpate {

class BodyEnergy {
 public:
  using Sliding = SlideEnergy::Sliding;

  bool create(SceneMemory& memory, std::int32_t constraint_capacity);
  void forget();

  // Of this step, to be filled before the calls below: what a touch knows about constraint p, and the force on the body, N.
  Sliding* sliding() { return sliding_; }  // [constraint_capacity]
  Vec3* force() { return force_; }         // [constraint_capacity]
  // Of a constraint that holds along one line, which turns by itself: the line, unit, and the mean displacement of its nodes, m. Zero of others.
  struct Along {
    Vec3 line, moved;
  };
  Along* along() { return along_; }  // [constraint_capacity]
  // Constraints of the last step are known. Where they are not, and none slides in this step, no line is asked for.
  bool is_begun() const { return count_ > 0; }

  // set: the constraints of `rows` with what the offset leaves of their targets.
  // True where the body has more energy in this step, J, than was paid for, and contacts have shorter targets in `rows` for it: the step is to be
  // solved again. noise: of the energy, J. Cost: some 30 operations for each constraint.
  bool give_way(double energy, double noise, const ContactConstraints& set, ContactRows& rows) const;
  // Judges the energy of this step. What is given too much is taken back in the next one.
  void judge(double energy, double noise, const ContactConstraints& set);
  // What the body has at the next state that is judged counts as paid.
  void adopt() { adopts_ = 1; }
  // What else the body was given, J.
  void pay(double given) { adopted_ += given; }
  // At the last state that was judged contacts had given more than the tolerance allows.
  bool gives_much() const { return gives_much_ != 0; }
  // The body is behind its contacts in this step, which may feel less than it will have taken when it has caught up.
  void lag() { lagged_ = 1; }
  // It was in this touch, and a contact has a target that is shorter by more than this share of it.
  bool lag_shortens(const ContactConstraints& set, double share) const;
  // Ends a step. followed: the body was where its contacts hold it. Until it first was, in a touch, what it catches up with counts as paid;
  // afterwards what tools have felt does, whether it followed or not.
  void end(const ContactConstraints& set, bool followed);

 private:
  // A constraint of the last step.
  struct Held {
    ConstraintId id;
    std::int32_t node, unused;  // the first node that it holds
    double weight;              // of this node
    Vec3 at, force;             // m and N, in the organ's frame
    Along along;
  };
  struct Work {
    double sum = 0;     // J
    bool known = true;  // constraints that do not slide are those of the last step
  };
  Work work_of(const ContactConstraints& set) const;
  double turned(const Held& before, std::int32_t p) const;
  const Held* held(const ContactConstraint& constraint) const;
  Vec3 place_of(const ContactConstraints& set, std::int32_t p) const;
  double stored_in(const ContactConstraints& set) const;
  double push_on(const ContactConstraints& set, std::int32_t p) const;
  void end_touch();
  void shorten(const ContactConstraints& set, double excess, double stored, ContactRows* rows) const;
  void lengthen(const ContactConstraints& set, double stored) const;

  Held* held_ = nullptr;        // [constraint_capacity]
  Sliding* sliding_ = nullptr;  // [constraint_capacity]
  Vec3* force_ = nullptr;       // [constraint_capacity] N
  Along* along_ = nullptr;      // [constraint_capacity]
  std::int32_t count_ = 0;
  double work_ = 0;              // J, what the tools have put in since the touch began
  double adopted_ = 0;           // J, that the body had beyond it, or that was lost and is not given back
  double lost_ = 0;              // J, at the last state that was judged
  double energy_ = 0;            // J, the same
  std::int32_t adopts_ = 0;      // the next state tells what the body has
  std::int32_t gives_much_ = 0;  // at the last state that was judged
  // In this touch: the body has followed its contacts; it has been behind them.
  std::int32_t settled_ = 0, lagged_ = 0;
};

}  // namespace palpate
