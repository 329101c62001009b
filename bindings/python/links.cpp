// palpate.Link, palpate.WorldLink, palpate.Grasp and palpate.Needle: what holds tissue.
#include <algorithm>
#include <string>

#include "bindings/python/tools.h"

namespace palpate::python {
namespace {

// (triangle, (k0, k1, k2)).
void set_surface_point(std::int32_t* triangle, double (&barycentric)[3], const py::handle& from, const char* name) {
  const py::sequence pair = from.cast<py::sequence>();
  if (pair.size() != 2)
    throw py::value_error(std::string(name) + ": expected (triangle, weights), found " +
                          std::string(py::str(py::repr(from))));
  *triangle = py::handle(pair[0]).cast<std::int32_t>();
  set_numbers(barycentric, py::object(pair[1]).cast<Numbers>(), name);
}

// (triangle, (k0, k1, k2)) of the surface, or (x, y, z) in the world.
palpate_link_end end_of(const py::handle& from) {
  palpate_link_end end = {};
  if (!py::isinstance<py::sequence>(from) && !py::isinstance<py::array>(from))
    throw py::type_error("ends: expected (triangle, weights) on the surface or (x, y, z) in the world, found " +
                         std::string(py::str(py::repr(from))));
  if (py::len(from) == 3) {
    end.kind = PALPATE_END_WORLD;
    set_numbers(end.point, from.cast<Numbers>(), "ends");
  } else {
    end.kind = PALPATE_END_SURFACE_POINT;
    set_surface_point(&end.triangle, end.barycentric, from, "ends");
  }
  return end;
}

palpate_link_kind kind_of(const std::string& word) {
  if (word == "thread") return PALPATE_LINK_THREAD;
  if (word == "spring") return PALPATE_LINK_SPRING;
  if (word == "clip") return PALPATE_LINK_CLIP;
  throw py::value_error("kind: expected one of thread, spring, clip; found \"" + word + "\"");
}

void expect_two(const py::sequence& list, const char* name) {
  if (list.size() != 2)
    throw py::value_error(std::string(name) + ": expected two, found " + std::to_string(list.size()));
}

// link: with its defaults.
template <class Link>
Link filled(Link link, const std::string& kind, const py::sequence& ends, double rest_length, double stiffness,
            double breaking_force, double radius, bool runs_on, std::int32_t id) {
  expect_two(ends, "ends");
  link.kind = kind_of(kind);
  for (std::size_t e = 0; e < 2; ++e) link.ends[e] = end_of(py::object(ends[e]));
  link.rest_length = rest_length, link.stiffness = stiffness, link.breaking_force = breaking_force;
  link.radius = radius, link.runs_on = runs_on, link.id = id;
  return link;
}

palpate_link make_link(const std::string& kind, const py::sequence& ends, double rest_length, double stiffness,
                       double breaking_force, double radius, bool runs_on, std::int32_t id) {
  return filled(palpate_default_link(), kind, ends, rest_length, stiffness, breaking_force, radius, runs_on, id);
}

palpate_world_link make_world_link(const std::string& kind, const py::sequence& organs, const py::sequence& ends,
                                   double rest_length, double stiffness, double breaking_force, double radius,
                                   bool runs_on, std::int32_t id) {
  palpate_world_link link =
      filled(palpate_default_world_link(), kind, ends, rest_length, stiffness, breaking_force, radius, runs_on, id);
  expect_two(organs, "organs");
  for (std::size_t e = 0; e < 2; ++e) link.organ[e] = py::object(organs[e]).cast<std::int32_t>();
  return link;
}

// What a caller may read and change of either kind of link.
template <class Link>
void add_numbers(py::class_<Link>* type) {
  type->def_readwrite("rest_length", &Link::rest_length, "m")
      .def_readwrite("stiffness", &Link::stiffness, "N/m")
      .def_readwrite("breaking_force", &Link::breaking_force, "N")
      .def_readonly("radius", &Link::radius, "m")
      .def_property(
          "runs_on", [](const Link& self) { return self.runs_on != 0; }, [](Link& self, bool to) { self.runs_on = to; },
          "the thread runs on into the next link")
      .def_readwrite("id", &Link::id, "0 or more, another one for each link; -1: its index");
}

palpate_grasp make_grasp(const py::object& place, double radius, const Numbers& position, const Numbers& orientation,
                         const py::object& opposite, double closing, double friction, double clamp_force,
                         std::int32_t id) {
  palpate_grasp grasp = palpate_default_grasp();
  set_surface_point(&grasp.triangle, grasp.barycentric, place, "place");
  if (!opposite.is_none())
    set_surface_point(&grasp.opposite_triangle, grasp.opposite_barycentric, opposite, "opposite");
  set_numbers(grasp.position, position, "position");
  set_numbers(grasp.orientation, orientation, "orientation");
  grasp.radius = radius, grasp.closing = closing, grasp.friction = friction, grasp.clamp_force = clamp_force;
  grasp.id = id;
  return grasp;
}

palpate_needle make_needle(const py::object& place, double radius, const Numbers& tip, const Numbers& direction,
                           double friction, double cutting_force, double puncture_force, double spacing,
                           std::int32_t id) {
  palpate_needle needle = palpate_default_needle();
  set_surface_point(&needle.triangle, needle.barycentric, place, "place");
  set_numbers(needle.tip, tip, "tip");
  set_numbers(needle.direction, direction, "direction");
  needle.radius = radius, needle.friction = friction, needle.spacing = spacing;
  needle.cutting_force = cutting_force, needle.puncture_force = puncture_force, needle.id = id;
  return needle;
}

void add_needle(py::module_& module) {
  const palpate_needle start = palpate_default_needle();
  py::class_<palpate_needle> needle(module, "Needle", "A straight, stiff needle that pierces the organ.");
  needle
      .def(py::init(&make_needle), py::arg("place"), py::arg("radius"), py::arg("tip"), py::arg("direction"),
           py::kw_only(), py::arg("friction") = start.friction, py::arg("cutting_force") = start.cutting_force,
           py::arg("puncture_force") = start.puncture_force, py::arg("spacing") = start.spacing, py::arg("id") = 0,
           "place: (triangle, weights), where it enters; radius: m, of the shaft.\n"
           "tip, direction: in the world, m and a vector of length 1 from the handle to the tip; move them between\n"
           "touches.\n"
           "friction: N/m, along the shaft for its length in the tissue; puncture_force, cutting_force: N, at which\n"
           "the tip pierces the surface and cuts its way; spacing: m, of the places of tissue that it holds.\n"
           "id: of this piercing; the needle enters anew where it changes.")
      .def_readwrite("radius", &palpate_needle::radius, "m, above 0 .. 0.01")
      .def_readwrite("friction", &palpate_needle::friction, "N/m")
      .def_readwrite("cutting_force", &palpate_needle::cutting_force, "N")
      .def_readwrite("puncture_force", &palpate_needle::puncture_force, "N")
      .def_readwrite("spacing", &palpate_needle::spacing, "m")
      .def_readwrite("id", &palpate_needle::id, "of this piercing");
  add_numbers_of(needle, "tip", &palpate_needle::tip, "float64 [3], m, a view that you may write to");
  add_numbers_of(needle, "direction", &palpate_needle::direction,
                 "float64 [3], of length 1, a view that you may write to");
}

}  // namespace

void add_links(py::module_& module) {
  PYBIND11_NUMPY_DTYPE(palpate_link_state, id, condition, broken, rest_length, length, tension, force, ends);
  PYBIND11_NUMPY_DTYPE(palpate_grasp_state, condition, force, torque, place, slipped, friction_limit);
  PYBIND11_NUMPY_DTYPE(palpate_given_force_state, condition, displacement, force, missed);
  PYBIND11_NUMPY_DTYPE(palpate_needle_state, condition, places, slipping, force, torque, tip_force, shaft_force, depth,
                       tip_at_rest);
  py::class_<palpate_link> link(
      module, "Link", "A suture, clip, ligament or spring between two places of the organ, or from one to the world.");
  link.def(py::init(&make_link), py::arg("kind"), py::arg("ends"), py::kw_only(), py::arg("rest_length") = 0.0,
           py::arg("stiffness") = INFINITY, py::arg("breaking_force") = INFINITY, py::arg("radius") = 0.0,
           py::arg("runs_on") = false, py::arg("id") = -1,
           "kind: \"thread\" pulls alone, \"spring\" pulls and pushes, \"clip\" brings both ends to one place.\n"
           "ends: two; each is (triangle, weights), which moves with the tissue, or (x, y, z), m, in the world.\n"
           "rest_length: m; stiffness: N/m; breaking_force: N; radius: m, of the disc that each end takes hold of\n"
           "(contact=\"patch\"); runs_on: the thread runs on into the next link; id: 0 or more; -1: its index.");
  add_numbers(&link);
  py::class_<palpate_world_link> world_link(
      module, "WorldLink", "A link of a World: between places of two organs, of one, or from one to the world.");
  world_link.def(py::init(&make_world_link), py::arg("kind"), py::arg("organs"), py::arg("ends"), py::kw_only(),
                 py::arg("rest_length") = 0.0, py::arg("stiffness") = INFINITY, py::arg("breaking_force") = INFINITY,
                 py::arg("radius") = 0.0, py::arg("runs_on") = false, py::arg("id") = -1,
                 "organs: two indices, of the organ of each end; that of an end in the world is not read.\n"
                 "The others: as those of Link.");
  add_numbers(&world_link);
  py::class_<palpate_grasp> grasp(module, "Grasp",
                                  "Jaws that hold tissue, which follows them in six degrees of freedom.");
  grasp
      .def(
          py::init(&make_grasp), py::arg("place"), py::arg("radius"), py::arg("position"), py::kw_only(),
          py::arg("orientation") = py::make_tuple(1.0, 0.0, 0.0, 0.0), py::arg("opposite") = py::none(),
          py::arg("closing") = 0.0, py::arg("friction") = INFINITY, py::arg("clamp_force") = INFINITY,
          py::arg("id") = 0,
          "place, opposite: (triangle, weights), where the discs' middles are; radius: m, of each disc.\n"
          "position, orientation: of the tool in the world, m and a quaternion w, x, y, z; move them between touches.\n"
          "closing: m, by how much two discs have come nearer; friction, clamp_force (N, of one disc): beyond them it "
          "slips.\n"
          "id: of this closing; the jaws close anew where it changes.")
      .def_readwrite("closing", &palpate_grasp::closing, "m")
      .def_readwrite("friction", &palpate_grasp::friction, "0 or more")
      .def_readwrite("clamp_force", &palpate_grasp::clamp_force, "N")
      .def_readwrite("id", &palpate_grasp::id, "of this closing");
  add_numbers_of(grasp, "position", &palpate_grasp::position, "float64 [3], m, a view that you may write to");
  add_numbers_of(grasp, "orientation", &palpate_grasp::orientation,
                 "float64 [4], w, x, y, z, a view that you may write to");
  add_needle(module);
}

}  // namespace palpate::python
