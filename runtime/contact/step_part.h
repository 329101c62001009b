// What an effect does in a touch step. The step goes through the list of the parts that its scene has (touch.h) and asks none what it is.
#pragma once

#include <cstdint>

#include "runtime/base/passes.h"
#include "runtime/include/palpate/palpate.h"

namespace palpate {

struct TouchStep;

// A part overrides what concerns it. No destructor: parts belong to a scene's memory.
class StepPart {
 public:
  // Before all else: takes in the step's tools (ToolInput::take) and begins the step of the pose, in the scene's place. Returns whether it
  // has; the scene then asks no other part.
  virtual bool take_input(TouchStep&, const palpate_tool*, std::int32_t /*tool_count*/, double /*dt*/) { return false; }
  // A step, in this order. After the input, before collision: writes the amounts of its rows of the
  // offset (offset.h), which move the organ from outside.
  virtual void begin_step(TouchStep&) {}
  // After the last solve. solved: false where the step has no solution.
  virtual void take_reactions(TouchStep&, bool /*solved*/) {}
  // After P and Q, before the limits for a device: changes what tools feel, raw and raw_torque of TouchStep::result.
  virtual void correct_forces(TouchStep&) {}
  // After the output.
  virtual void end_step(TouchStep&) {}

  // The pass (passes.h) that counts the time of take_reactions() and, of a RowSource, of end().
  virtual Pass pass() const { return Pass::contact; }

  // Forgets what earlier steps have left: for the tool in place t; for all that belongs to no tool.
  virtual void forget_tool(std::int32_t) {}
  virtual void forget_rest() {}
  // A saved state has been copied back (scene_memory.h): before all else, makes anew what the state does not hold.
  virtual void restored() {}
  // The host has the tool in place t forgotten, after forget_tool(t).
  virtual void reset_tool(std::int32_t) {}

 protected:
  ~StepPart() = default;
};

}  // namespace palpate
