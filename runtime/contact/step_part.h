// What an effect does in a touch step. The step goes through the list of the parts that its scene has (touch.h) and asks none what it is.
#pragma once

#include <cstdint>

namespace palpate {

struct TouchStep;

// A part overrides what concerns it. No destructor: parts belong to a scene's memory.
class StepPart {
 public:
  // After P and Q, before the limits for a device: changes what tools feel, raw and raw_torque of TouchStep::result.
  virtual void correct_forces(TouchStep&) {}

  // Forgets what earlier steps have left: for the tool in place t; for all that belongs to no tool.
  virtual void forget_tool(std::int32_t) {}
  virtual void forget_rest() {}

 protected:
  ~StepPart() = default;
};

}  // namespace palpate
