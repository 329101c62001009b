// palpate.ToolShape: the surface of a rigid instrument as tool points.
#include <palpate/palpate_complete.h>

#include <algorithm>
#include <string>

#include "bindings/python/tools.h"

namespace palpate::python {
namespace {

struct DestroyShape {
  void operator()(palpate_tool_shape* shape) const noexcept { palpate_tool_shape_destroy(shape); }
};

class HeldShape {
 public:
  explicit HeldShape(const palpate_tool_shape_def& def) {
    palpate_tool_shape* created = nullptr;
    throw_unless_ok([&](palpate_error* error) { return palpate_tool_shape_create(&def, &created, error); });
    shape_.reset(created);
  }
  std::int32_t count() const { return palpate_tool_shape_point_count(shape_.get()); }
  const double* points() const { return palpate_tool_shape_points(shape_.get()); }
  double patch_radius() const { return palpate_tool_shape_patch_radius(shape_.get()); }

  void place(HeldTool& tool, const Numbers& position, const Numbers& orientation) {
    double at[3], turn[4];
    set_numbers(at, position, "position");
    set_numbers(turn, orientation, "orientation");
    palpate_tool placed = palpate_default_tool();
    palpate_tool_shape_place(shape_.get(), at, turn, &placed);
    py::array_t<double> own(std::vector<py::ssize_t>{placed.point_count, 3});
    std::copy_n(placed.points, 3 * static_cast<std::ptrdiff_t>(placed.point_count), own.mutable_data());
    tool.points = own;
    tool.disc_radius = placed.disc_radius;
    tool.torque_about = std::array<double, 3>{at[0], at[1], at[2]};
  }

 private:
  std::unique_ptr<palpate_tool_shape, DestroyShape> shape_;
};

using Triangles = py::array_t<std::int32_t, py::array::c_style | py::array::forcecast>;

template <class Array>
std::int32_t rows_of_three(const Array& array, const char* name) {
  if (array.size() == 0) return 0;
  if (array.ndim() != 2 || array.shape(1) != 3 || array.shape(0) > INT32_MAX)
    throw py::value_error(std::string(name) + ": expected shape [rows, 3]");
  return static_cast<std::int32_t>(array.shape(0));
}

std::unique_ptr<HeldShape> make_shape(const std::string& kind, double spacing, double radius, double length,
                                      const Numbers& vertices, const Triangles& triangles, std::int32_t max_points) {
  static constexpr const char* kKinds[] = {"point", "sphere", "capsule", "hull", "mesh"};
  const auto* found = std::find(std::begin(kKinds), std::end(kKinds), kind);
  if (found == std::end(kKinds))
    throw py::value_error("kind: expected one of point, sphere, capsule, hull, mesh; found \"" + kind + "\"");
  palpate_tool_shape_def def = palpate_default_tool_shape_def();
  def.kind = static_cast<palpate_tool_shape_kind>(found - kKinds);
  def.spacing = spacing, def.radius = radius, def.length = length, def.max_points = max_points;
  def.vertices = vertices.data(), def.vertex_count = rows_of_three(vertices, "vertices");
  def.triangles = triangles.data(), def.triangle_count = rows_of_three(triangles, "triangles");
  return std::make_unique<HeldShape>(def);
}

}  // namespace

void add_tool_shape(py::module_& module) {
  const palpate_tool_shape_def start = palpate_default_tool_shape_def();
  py::class_<HeldShape>(module, "ToolShape", "The surface of a rigid instrument, sampled with tool points.")
      .def(py::init(&make_shape), py::arg("kind"), py::kw_only(), py::arg("spacing") = 0.0, py::arg("radius") = 0.0,
           py::arg("length") = 0.0, py::arg("vertices") = py::tuple(), py::arg("triangles") = py::tuple(),
           py::arg("max_points") = start.max_points,
           "kind: point, sphere, capsule (along z), hull (vertices) or mesh (vertices, triangles); m. No place of the\n"
           "surface is farther than spacing from a point. Raises Error where more than max_points are needed.")
      .def_property_readonly(
          "points",
          [](const py::object& self) {
            const auto& shape = self.cast<HeldShape&>();
            return view_of(self, shape.points(), {shape.count(), 3});
          },
          "float64 [points, 3], m, in the shape's frame")
      .def_property_readonly("patch_radius", &HeldShape::patch_radius, "m, of the disc of each point")
      .def("place", &HeldShape::place, py::arg("tool"), py::arg("position"),
           py::arg("orientation") = py::make_tuple(1.0, 0.0, 0.0, 0.0),
           "Sets points, disc_radius and torque_about of a Tool to the shape at a pose: m; a quaternion w, x, y, z.");
}

}  // namespace palpate::python
