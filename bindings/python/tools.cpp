#include "bindings/python/tools.h"

#include <algorithm>
#include <array>
#include <optional>
#include <string>

namespace palpate::python {
namespace {

std::string shape_of(const py::array& array) {
  return py::str(array.attr("shape"));
}

palpate_grip make_grip(std::optional<std::int32_t> node, const Numbers& displacement,
                       std::optional<std::int32_t> triangle, const Numbers& barycentric, std::uint32_t axes) {
  if (node.has_value() == triangle.has_value())
    throw py::value_error("Grip: expected either node, for a node, or triangle, for a point of a triangle");
  palpate_grip grip = palpate_default_grip();
  grip.kind = node ? PALPATE_GRIP_NODE : PALPATE_GRIP_SURFACE_POINT;
  grip.node = node.value_or(-1), grip.triangle = triangle.value_or(-1), grip.axes = axes;
  set_numbers(grip.displacement, displacement, "displacement");
  set_numbers(grip.barycentric, barycentric, "barycentric");
  return grip;
}

// The tool's own copy, of shape [P, 3]; [3] counts as one point.
py::array own_points(const Numbers& from) {
  const bool one = from.ndim() == 1 && from.size() == 3;
  if (!one && from.size() != 0 && (from.ndim() != 2 || from.shape(1) != 3))
    throw py::value_error("points: expected shape [P, 3], found " + shape_of(from));
  py::array_t<double> own(std::vector<py::ssize_t>{from.size() / 3, 3});
  std::copy_n(from.data(), from.size(), own.mutable_data());
  return own;
}

HeldTool make_tool(const Numbers& points, const py::iterable& grips, bool hold, double disc_radius, double friction,
                   std::int32_t id, std::optional<std::array<double, 3>> torque_about, const py::object& grasp,
                   const py::object& needle, const py::object& given_force, std::int32_t organ) {
  return {own_points(points), py::list(grips), hold,   disc_radius, friction, id,
          torque_about,       grasp,           needle, given_force, organ};
}

palpate_given_force make_given_force(const Numbers& force, double speed) {
  palpate_given_force given = palpate_default_given_force();
  set_numbers(given.force, force, "force");
  given.speed = speed;
  return given;
}

// The caller holds the same array and may have changed its shape.
bool are_points(const py::array& points) {
  return py::isinstance<py::array_t<double>>(points) && points.ndim() == 2 && points.shape(1) == 3 &&
         (points.flags() & py::array::c_style) != 0;
}

void check_number(const char* name, double value, double most, const char* unit, bool obeyed, const char* effect) {
  if (!(value >= 0 && value <= most))
    throw py::value_error(std::string(name) + ": expected 0 to " + std::to_string(static_cast<int>(most)) + unit +
                          ", found " + std::string(py::str(py::float_(value))));
  if (value > 0 && !obeyed)
    throw py::value_error(std::string(name) + ": expected " + effect +
                          ", without which the scene takes no account of it, or 0");
}

}  // namespace

void set_numbers(double* to, py::ssize_t count, const Numbers& from, const char* name) {
  if (from.ndim() != 1 || from.shape(0) != count)
    throw py::value_error(std::string(name) + ": expected " + std::to_string(count) + " numbers, found shape " +
                          shape_of(from));
  std::copy_n(from.data(), count, to);
}

void ToolCopies::take(const py::iterable& tools, const Obeyed& obeyed) {
  tools_.clear();
  points_.clear();
  grips_.clear();
  grasps_.clear();
  needles_.clear();
  given_forces_.clear();
  for (const py::handle each : tools) {
    const auto& tool = each.cast<const HeldTool&>();
    if (!are_points(tool.points))
      throw py::value_error(
          "points: expected shape [P, 3], but the array's shape was changed; assign a new array to tool.points");
    check_number("disc_radius", tool.disc_radius, 1, " m", obeyed.disc_radius, "contact=\"patch\"");
    check_number("friction", tool.friction, 100, "", obeyed.friction, "law=\"coulomb\"");
    const auto* numbers = static_cast<const double*>(tool.points.data());
    points_.insert(points_.end(), numbers, numbers + tool.points.size());
    for (const py::handle grip : tool.grips) grips_.push_back(grip.cast<const palpate_grip&>());
    palpate_tool& copy = tools_.emplace_back(palpate_default_tool());
    grasps_.emplace_back();
    needles_.emplace_back();
    given_forces_.emplace_back();
    if (!tool.given_force.is_none()) given_forces_.back() = tool.given_force.cast<const palpate_given_force&>();
    if (!tool.needle.is_none()) needles_.back() = tool.needle.cast<const palpate_needle&>();
    if (!tool.grasp.is_none()) grasps_.back() = tool.grasp.cast<const palpate_grasp&>();
    copy.id = tool.id, copy.organ = tool.organ;
    copy.point_count = static_cast<std::int32_t>(tool.points.shape(0));
    copy.grip_count = static_cast<std::int32_t>(tool.grips.size());
    copy.has_torque = tool.torque_about.has_value();
    if (tool.torque_about) std::copy_n(tool.torque_about->data(), 3, copy.reference);
    copy.hold = tool.hold, copy.disc_radius = tool.disc_radius, copy.friction = tool.friction;
  }
  // The vectors no longer grow, so pointers into them stay valid.
  const double* point = points_.data();
  const palpate_grip* grip = grips_.data();
  for (std::size_t t = 0; t < tools_.size(); ++t) {
    if (grasps_[t]) palpate_add_part(&tools_[t].parts, &grasps_[t]->part);
    if (needles_[t]) palpate_add_part(&tools_[t].parts, &needles_[t]->part);
    if (given_forces_[t]) palpate_add_part(&tools_[t].parts, &given_forces_[t]->part);
  }
  for (palpate_tool& tool : tools_) {
    tool.points = point;
    tool.grips = grip;
    point += 3 * tool.point_count;
    grip += tool.grip_count;
  }
}

void add_tools(py::module_& module) {
  const auto zero = [] { return py::make_tuple(0.0, 0.0, 0.0); };
  py::class_<palpate_grip> grip(module, "Grip",
                                "Holds the organ at a displacement: at a touchable node or at a point of a triangle.");
  grip.def(py::init(&make_grip), py::kw_only(), py::arg("node") = py::none(), py::arg("displacement") = zero(),
           py::arg("triangle") = py::none(), py::arg("barycentric") = py::make_tuple(1.0 / 3, 1.0 / 3, 1.0 / 3),
           py::arg("axes") = 7,
           "node or triangle: what the grip holds; give one of them.\n"
           "displacement: 3 numbers, m, from rest; barycentric: 3 weights that sum to 1; axes: bits 1, 2, 4 impose\n"
           "x, y, z; along the others the grip is force-free.")
      .def_property_readonly(
          "kind", [](const palpate_grip& self) { return self.kind == PALPATE_GRIP_NODE ? "node" : "surface_point"; },
          "\"node\" or \"surface_point\"")
      .def_readwrite("node", &palpate_grip::node, "a touchable node, of the kind \"node\"")
      .def_readwrite("triangle", &palpate_grip::triangle, "0 .. F-1, of the kind \"surface_point\"")
      .def_readwrite("axes", &palpate_grip::axes, "bits 1, 2, 4 impose x, y, z");
  add_numbers_of(grip, "displacement", &palpate_grip::displacement, "float64 [3], m, a view that you may write to");
  add_numbers_of(grip, "barycentric", &palpate_grip::barycentric, "float64 [3], a view that you may write to");
  py::class_<palpate_given_force> given(
      module, "GivenForce",
      "The force with which a tool presses the organ; Scene.given_force_state tells where it stands.");
  given
      .def(py::init(&make_given_force), py::arg("force"), py::kw_only(), py::arg("speed") = 0.25,
           "force: 3 numbers, N, on the organ, in the world; speed: m/s, of the tool at most.")
      .def_readwrite("speed", &palpate_given_force::speed, "m/s, above 0");
  add_numbers_of(given, "force", &palpate_given_force::force, "float64 [3], N, a view that you may write to");
  py::class_<HeldTool>(module, "Tool", "An instrument: points that are tested against the surface, and grips.")
      .def(py::init(&make_tool), py::arg("points") = py::tuple(), py::kw_only(), py::arg("grips") = py::tuple(),
           py::arg("hold") = false, py::arg("disc_radius") = 0.0, py::arg("friction") = 0.0, py::arg("id") = -1,
           py::arg("torque_about") = py::none(), py::arg("grasp") = py::none(), py::arg("needle") = py::none(),
           py::arg("given_force") = py::none(), py::arg("organ") = 0,
           "points: [P, 3] or [3], m, copied; grips: Grip objects; hold: contacts stay when the point has come out, "
           "and pull;\n"
           "disc_radius: m, of the flat disc that each point presses (contact=\"patch\"); friction: for "
           "law=\"coulomb\"; id: 0 or more, by which the scene knows the tool from step to step; -1: its index;\n"
           "torque_about: None, or the 3 coordinates of a point, m: contacts.tools then has the torque about it.\n"
           "grasp: None, or a Grasp: the jaws are closed in each touch of the tool that has it (grasps=True).\n"
           "needle: None, or a Needle: it is in or before the tissue in each touch of the tool that has it "
           "(needles=True).\n"
           "given_force: None, or a GivenForce: the tool presses with it, wherever that brings it "
           "(force_control=True).\n"
           "organ: in a World, the organ that grips, grasp and needle hold.")
      .def_property(
          "points", [](const HeldTool& self) { return self.points; },
          [](HeldTool& self, const Numbers& to) { self.points = own_points(to); },
          "float64 [P, 3], m: the tool's own array; write to it between touches")
      .def_readwrite("grips", &HeldTool::grips, "list of Grip")
      .def_readwrite("hold", &HeldTool::hold, "True: contacts stay when the point has come out, and pull")
      .def_readwrite("disc_radius", &HeldTool::disc_radius,
                     "m, 0 .. 1: radius of the flat disc that each point presses on the organ (contact=\"patch\")")
      .def_readwrite("id", &HeldTool::id, "0 or more, another one for each tool of a touch; -1: its index")
      .def_readwrite("grasp", &HeldTool::grasp, "None, or a Grasp")
      .def_readwrite("needle", &HeldTool::needle, "None, or a Needle")
      .def_readwrite("given_force", &HeldTool::given_force, "None, or a GivenForce")
      .def_readwrite("organ", &HeldTool::organ, "in a World, the organ that grips, grasp and needle hold")
      .def_readwrite("torque_about", &HeldTool::torque_about, "None, or the point about which the torque is taken, m")
      .def_readwrite("friction", &HeldTool::friction, "0 .. 100: Coulomb's coefficient (law=\"coulomb\")");
}

}  // namespace palpate::python
