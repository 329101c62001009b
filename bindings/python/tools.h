// What a touch takes: tools and what they grip, as Python holds them.
#pragma once

#include "bindings/python/bindings.h"

namespace palpate::python {

// The points stay a numpy array that the caller may write in place between touches.
struct HeldTool {
  py::array points;  // float64 [P, 3]
  py::list grips;
  bool hold = false;
  double radius = 0, friction = 0;
};

// The tools of one touch, copied while the interpreter's lock is held, so that nothing changes under the step. Its memory is
// used again.
class ToolCopies {
 public:
  // Throws a Python error where something is no tool, or its points are no points any more.
  void take(const py::iterable& tools);
  const palpate_tool* data() const { return tools_.data(); }
  std::int32_t count() const { return static_cast<std::int32_t>(tools_.size()); }

 private:
  std::vector<palpate_tool> tools_;
  std::vector<double> points_;
  std::vector<palpate_grip> grips_;
};

}  // namespace palpate::python
