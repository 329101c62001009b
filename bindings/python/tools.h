// The Python objects for tools and grips.
#pragma once

#include <palpate/palpate_scene_def.hpp>

#include <array>
#include <optional>

#include "bindings/python/bindings.h"

namespace palpate::python {

using Numbers = py::array_t<double, py::array::c_style | py::array::forcecast>;

// Throws a Python error that begins with `name` where these are not as many numbers.
void set_numbers(double* to, py::ssize_t count, const Numbers& from, const char* name);
template <std::size_t count>
void set_numbers(double (&to)[count], const Numbers& from, const char* name) {
  set_numbers(to, count, from, name);
}

// A property of some numbers of a struct: a view that the caller may write to.
template <class Held, std::size_t count>
void add_numbers_of(py::class_<Held>& type, const char* name, double (Held::*member)[count], const char* about) {
  type.def_property(
      name,
      [member](const py::object& self) {
        return py::array_t<double>({count}, {sizeof(double)}, self.cast<Held&>().*member, self);
      },
      [member, name](Held& self, const Numbers& to) { set_numbers(self.*member, to, name); }, about);
}

// The points are a numpy array that the caller may write to between touches.
struct HeldTool {
  py::array points;  // float64 [P, 3]
  py::list grips;
  bool hold = false;
  double disc_radius = 0, friction = 0;
  std::int32_t id = -1;
  std::optional<std::array<double, 3>> torque_about = std::nullopt;  // m; none: no torque
  py::object grasp = py::none();                                     // a Grasp, or None
  py::object needle = py::none();                                    // a Needle, or None
  py::object given_force = py::none();                               // a GivenForce, or None
  std::int32_t organ = 0;                                            // of a world, that grips, grasp and needle hold
};

// What the effects of a scene make of a tool's numbers: what they leave out is refused, so that nobody waits for a force of it.
struct Obeyed {
  bool disc_radius = false, friction = false;
  void add(const SceneDef& def) {
    disc_radius = disc_radius || def.contact == PALPATE_CONTACT_PATCH;
    friction = friction || def.law == PALPATE_LAW_COULOMB;
  }
};

// A copy of the tools of one touch, made while the interpreter's lock is held, so that nothing changes during the step. The next
// touch uses the same memory.
class ToolCopies {
 public:
  // Throws a Python error where an object is not a tool, its points no longer have the shape [P, 3], or a number is outside its limits or
  // not obeyed.
  void take(const py::iterable& tools, const Obeyed& obeyed);
  const palpate_tool* data() const { return tools_.data(); }
  std::int32_t count() const { return static_cast<std::int32_t>(tools_.size()); }

 private:
  std::vector<palpate_tool> tools_;
  std::vector<double> points_;
  std::vector<palpate_grip> grips_;
  std::vector<std::optional<palpate_grasp>> grasps_;              // [tool]
  std::vector<std::optional<palpate_needle>> needles_;            // [tool]
  std::vector<std::optional<palpate_given_force>> given_forces_;  // [tool]
};

// The same of links, palpate_link or palpate_world_link, for one call.
template <class Link>
class LinkCopies {
 public:
  // Throws a Python error where an object is not a Link.
  void take(const py::iterable& links) {
    links_.clear();
    for (const py::handle each : links) links_.push_back(each.cast<const Link&>());
  }
  const Link* data() const { return links_.data(); }
  std::int32_t count() const { return static_cast<std::int32_t>(links_.size()); }

 private:
  std::vector<Link> links_;
};

}  // namespace palpate::python
