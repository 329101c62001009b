// A tool that presses with a given force F: the step looks for the place at which the reactions of the tool's contacts have the sum F.
//
// The tool moves as a whole, so that all its targets move alike, by x. After a solve the sum misses F by e; with K, how the sum grows with x while all
// rows hold that now hold (Body::measure_stiffness), x grows by K^-1 e, and the step is solved again. In directions in which nothing holds the tool K
// is zero: there it stays. Where friction is at its limit, e has no part that asks for more friction than the force across it allows.
#pragma once

#include <cstdint>

#include "runtime/base/passes.h"
#include "runtime/base/scene_memory.h"
#include "runtime/contact/row_source.h"
#include "runtime/contact/system_solver.h"
#include "runtime/contact/tool_input.h"
#include "runtime/include/palpate/palpate_force_control.h"

namespace palpate {

struct TouchState;

inline constexpr int kForcePart = 2;
inline bool has_force(const Tool& tool) {
  return tool.has_part[kForcePart];
}
inline const palpate_given_force& force_of(const Tool& tool) {
  return *reinterpret_cast<const palpate_given_force*>(tool.part[kForcePart]);
}

class ForceControl final : public RowSource {
 public:
  // touch: borrowed. constraints: that a step can have.
  bool create(SceneMemory& memory, TouchState* touch, std::int32_t max_tools, std::int32_t constraints, Pass pass);

  // Puts the tools where the last step has left them, and where the change of their forces brings them.
  void begin_step(TouchStep& step) override;
  // Where a sum misses its force: moves the tool, and its targets with it.
  bool asks_again(TouchStep& step) override;
  void take_reactions(TouchStep& step, bool solved) override;
  Pass pass() const override { return pass_; }
  void forget_tool(std::int32_t t) override;

  const palpate_given_force_state& state(std::int32_t t) const { return driven_[t].state; }

 private:
  // What the steps have left of a tool with a force; a saved state holds all of it.
  struct Driven {
    std::int32_t active = 0, unused = 0;  // in the place of padding, which a saved state would hold
    Vec3 way, last;                       // m and N, in the world: from where the host sends the tool; what it gave
    Mat3 gives, carries;  // m/N and 1, in the organ's frame: as measured last, the way by a force, and what
                          // of a force something holds
    double share = 1;     // of the way that acts
    palpate_given_force_state state = {};
  };
  // A tool with a force in this step. In the organ's frame.
  struct Pressing {
    std::int32_t tool = -1;
    Vec3 force, missed;                    // N: of its contacts; what was given, less that
    Vec3 normal;                           // unit, of what presses
    double across = 0, pressed = 0;        // N: of the sum of the forces along the normals; the sum of these forces
    double friction = 0;                   // of contacts that may slip
    bool touches = false;                  // it has constraints
    bool may_slip = false, slips = false;  // along the surface: none holds there whatever presses; none does now
  };
  // What a correction was to do.
  struct Asked {
    Vec3 start;          // m, the way when the step began
    Vec3 force, wanted;  // N, before it; by how much it was to grow
    bool limited = false;
  };

  Pressing pressing(const TouchStep& step, std::int32_t t) const;
  Vec3 allowed(const Pressing& of) const;
  double tolerance(const TouchStep& step, std::int32_t t) const;
  void measure(const Pressing* pressing, int count, double* stiffness);
  void learn(const Pressing& of, Mat3 stiffness);
  bool move(TouchStep& step, const Pressing& of, Vec3 by);
  Vec3 given(const TouchStep& step, std::int32_t t) const;
  double farthest(const TouchStep& step, std::int32_t t) const;
  Vec3 within(const TouchStep& step, std::int32_t t, Vec3 way, bool* limited) const;

  TouchState* touch_ = nullptr;
  Pass pass_ = Pass::contact;
  Driven* driven_ = nullptr;             // [max_tools]
  std::int32_t* constraints_ = nullptr;  // of the tools of a correction, one tool after the other
  double* way_ = nullptr;                // of each of their targets, where its tool moves by 1
  Asked asked_[PALPATE_MAX_TOOLS];
};

}  // namespace palpate
