// palpate.Scene, PlanPass and Hit for Python.
#include "bindings/python/scene.h"

#include <cstdint>

namespace palpate::python {
namespace {

void add_plan_pass(py::module_& module) {
  py::class_<PlanPass>(module, "PlanPass", "One pass of a scene's plan and the sections that it maps.")
      .def_readonly("name", &PlanPass::name, "\"collision: rest\", \"superposition: surface\", ...")
      .def_readonly("half", &PlanPass::half, "\"create\", \"touch\" or \"shape\"")
      .def_readonly("sections", &PlanPass::sections, "bundle sections that it reads")
      .def_readonly("mapped_bytes", &PlanPass::mapped_bytes, "of those sections")
      .def_readonly("memory_bytes", &PlanPass::memory_bytes, "that the scene has taken for it")
      .def("__repr__", [](const PlanPass& self) {
        return "<palpate.PlanPass: " + self.half + ", " + self.name + ", " + self.sections + ">";
      });
}

void add_hit(py::module_& module) {
  const auto three = [](double(palpate_surface_hit::*member)[3]) {
    return [member](const palpate_surface_hit& self) { return py::array_t<double>(3, self.*member); };
  };
  py::class_<palpate_surface_hit>(module, "Hit", "A surface point that a query found.")
      .def_readonly("triangle", &palpate_surface_hit::triangle, "index of its triangle")
      .def_property_readonly("barycentric", three(&palpate_surface_hit::barycentric), "weights of its three vertices")
      .def_property_readonly("point", three(&palpate_surface_hit::point), "m")
      .def_property_readonly("normal", three(&palpate_surface_hit::normal), "outward unit normal of the triangle")
      .def_readonly("distance", &palpate_surface_hit::distance, "m")
      .def("__repr__", [](const palpate_surface_hit& self) {
        return "<palpate.Hit: triangle " + std::to_string(self.triangle) + ", " + std::to_string(self.distance) +
               " m away>";
      });
}

}  // namespace

void add_scene(py::module_& module) {
  PYBIND11_NUMPY_DTYPE(palpate_motion_state, amount, volume);
  PYBIND11_NUMPY_DTYPE(palpate_load_state, force, place, displacement, area);
  PYBIND11_NUMPY_DTYPE(palpate_crossing, triangle, place, rest);
  PYBIND11_NUMPY_DTYPE(palpate_obstacle_state, force, torque, position, orientation, deepest, nodes, slips);
  PYBIND11_NUMPY_DTYPE(palpate_blade_state, force, torque, work, area, in_tissue, cuts, friction_work);
  PYBIND11_NUMPY_DTYPE(palpate_cut_state, surface, area, faces, removed, nodes, pieces, waiting, left, rank, is_full,
                       rebased, rebasing);
  py::class_<HeldObstacle>(module, "Obstacle",
                           "A rigid surface that the organ does not enter: a table, a rib, a plate.")
      .def(py::init(&make_obstacle), py::arg("kind"), py::arg("size") = py::none(), py::kw_only(),
           py::arg("mesh") = py::none(), py::arg("friction") = 0.0, py::arg("depth") = palpate_default_obstacle().depth,
           py::arg("position") = py::make_tuple(0.0, 0.0, 0.0),
           py::arg("orientation") = py::make_tuple(1.0, 0.0, 0.0, 0.0),
           "kind: \"rectangle\", \"disc\" or \"mesh\". size: m, of a rectangle its lengths along x and y, of a disc "
           "its radius;\n"
           "the organ is on the side of z. mesh: a tuple of positions [vertices, 3], m, and triangles [triangles, 3],\n"
           "counter-clockwise from outside. friction: the largest tangential force over the normal force. depth: m; a "
           "node\n"
           "that is farther inside is not held. position, orientation (w x y z): in the world, when the scene begins.");
  PYBIND11_NUMPY_DTYPE(palpate_inside_place, tetrahedron, reserved, weight, distance);
  add_plan_pass(module);
  add_hit(module);
  py::class_<HeldScene, std::shared_ptr<HeldScene>> type(
      module, "Scene",
      "One organ under one set of effects. It keeps its bundle open. touch and shape run without the\n"
      "interpreter's lock, so one thread may touch while another draws. Each is for one thread at a time.");
  takes_effects(type, kAboutEffects + lines_of_keywords());
  py::list keywords;
  for (const char* own : {"relaxation", "loads", "obstacles", "render_mesh", "fine_surface"}) keywords.append(own);
  for_each_keyword([&](const palpate_key& key) { keywords.append(key.name); });
  module.attr("EFFECTS") = keywords;
  type.def_property_readonly("bundle", &HeldScene::bundle, "the Bundle that it was made on")
      .def_property_readonly("shape_node_count", &HeldScene::shape_node_count,
                             "nodes that shape fills: the surface's, all (shape=\"volume\"), or 0")
      .def_property_readonly(
          "plan",
          [](const HeldScene& self) {
            py::list plan;
            for (PlanPass& pass : self.plan()) plan.append(std::move(pass));
            return plan;
          },
          "list of PlanPass, in the order that they run")
      .def_property_readonly("most_operations", &HeldScene::most_operations,
                             "that a touch may count, whatever the tools do")
      .def("make_contacts", &HeldScene::make_contacts, "Contacts of this scene's size.")
      .def("touch", &HeldScene::touch, py::arg("tools"), py::arg("dt"), py::arg("contacts"),
           "The haptic half: collision, contacts, forces. tools: of Tool, known by their id; dt: s since the last\n"
           "touch. Fills contacts and returns StepFlags; 0 is full trust. Microseconds.")
      .def("deform", &HeldScene::deform,
           "With deformation=\"large-beside\" or \"large-renewed\": solves the body under the contacts of the newest\n"
           "touch, a little further in each call, in a thread of its own. Returns the evaluations of the energy that\n"
           "it took; 0: nothing to do. Neither save nor restore the scene meanwhile.")
      .def(
          "shape", &HeldScene::shape, py::arg("contacts"), py::arg("positions") = py::none(),
          py::arg("displacements") = py::none(),
          "The render half: writes the deformed nodes into the caller's arrays, float32 [shape_node_count, 3] or more\n"
          "rows, contiguous, m; nothing is allocated. Returns StepFlags; 0 is full trust.")
      .def_property_readonly("vertex_count", &HeldScene::vertex_count, "vertices that skin fills: the render mesh's")
      .def("skin", &HeldScene::skin, py::arg("displacements"), py::arg("positions") = py::none(),
           py::arg("normals") = py::none(), py::arg("report") = py::none(), py::arg("disc_normals") = py::none(),
           "The render mesh under a shape: displacements as shape wrote them. Fills the caller's arrays, float32\n"
           "[vertex_count, 3] or more rows, contiguous; m. Returns StepFlags; 0 is full trust.\n"
           "report: report_bytes of the touch that made the shape; a scene with dent=\"discs\" then sinks the mesh to\n"
           "its discs. disc_normals: float32 [contacts of the report, 3]; filled with the unit normal of the plane\n"
           "that each disc is drawn in, through the contact's tool_point; zero: no disc. Rows beyond the contacts\n"
           "keep what they held.")
      .def("normals", &HeldScene::normals, py::arg("positions"), py::arg("normals"),
           "Normals of the surface's vertices, the mean of the triangles around each, weighted by their angles:\n"
           "positions as shape wrote them. Fills the caller's array, float32 [surface_node_count, 3]. Returns "
           "StepFlags.")
      .def("locate", &HeldScene::locate, py::arg("points"), py::arg("farthest") = 0.0,
           "With inside=True: the place of each point [points, 3], m, of the organ as it was meshed: a structured\n"
           "array of tetrahedron (-1: none within farthest, m), weight and distance. Once; any thread may call it.")
      .def("inside", &HeldScene::inside, py::arg("displacements"), py::arg("strains") = py::none(),
           py::arg("stresses") = py::none(), py::arg("pressures") = py::none(), py::arg("von_mises") = py::none(),
           py::arg("principal") = py::none(),
           "Strain and stress of a shape: displacements of all nodes as shape wrote them. Keeps the field for "
           "inside_at and\n"
           "fills the caller's float32 arrays: strains and stresses [shape_node_count, 6], xx yy zz xy yz xz, Pa;\n"
           "pressures and von_mises [shape_node_count]; principal [shape_node_count, 3]. Returns StepFlags.")
      .def("inside_at", &HeldScene::inside_at, py::arg("places"), py::arg("displacements") = py::none(),
           py::arg("strains") = py::none(), py::arg("stresses") = py::none(), py::arg("pressures") = py::none(),
           py::arg("von_mises") = py::none(), py::arg("principal") = py::none(),
           "The same at places of locate, of the shape of the last inside, with a row for each place.")
      .def("carry", &HeldScene::carry, py::arg("positions"), py::arg("places"), py::arg("moved"),
           "Where the places of locate are in a shape: positions of all nodes as shape wrote them. Fills moved,\n"
           "float32 [places, 3], m. Returns StepFlags.")
      .def("crossings", &HeldScene::crossings, py::arg("positions"),
           "With crossings=True: goes on with the check whether the surface crosses itself; positions as shape wrote\n"
           "them. Returns StepFlags (SURFACE_CROSSES), how many checks have ended, how many pairs of triangles cross "
           "in\n"
           "the last of these, and the first 64 of them: a structured array of triangle [2], place [3] (m) and rest\n"
           "[2, 3] (m, the place of each triangle at rest).")
      .def("cast_ray", &HeldScene::cast_ray, py::arg("origin"), py::arg("direction"), py::arg("contacts") = py::none(),
           py::arg("longest") = INFINITY,
           "The first Hit of a ray with the surface as the contacts deform it, from outside or inside, or None.\n"
           "contacts: None for the surface at rest; longest: m along the ray. For one thread at a time, beside touch "
           "and shape.")
      .def("closest_point", &HeldScene::closest_point, py::arg("point"), py::arg("contacts") = py::none(),
           py::arg("farthest") = INFINITY, "The nearest point of that surface, if it is nearer than farthest, or None.")
      .def("signed_distance", &HeldScene::signed_distance, py::arg("point"), py::arg("contacts") = py::none(),
           "The distance of a point from that surface, m, below zero inside.")
      .def("report", &HeldScene::report,
           "Contacts and events of the last touch: two structured arrays, copies, with the fields of palpate_contact\n"
           "and palpate_contact_event. state: 0 sticks, 1 slips, 2 frictionless, 3 released. kind: 1 begin, 2 end, 3\n"
           "slip start, 4 stick start; of links 5 taut, 6 slack, 7 broke; of grasps 8 closed, 9 slips, 10 holds, 11\n"
           "let go, 12 opened. Read it after every touch.")
      .def("report_bytes", &HeldScene::report_bytes, "The same report as bytes, a copy, for skin.")
      .def("set_pose", &HeldScene::set_pose, py::arg("position") = py::make_tuple(0.0, 0.0, 0.0),
           py::arg("orientation") = py::make_tuple(1.0, 0.0, 0.0, 0.0), py::kw_only(),
           py::arg("velocity") = py::make_tuple(0.0, 0.0, 0.0),
           py::arg("angular_velocity") = py::make_tuple(0.0, 0.0, 0.0),
           "Where the organ is in the world at the next touch: m; a quaternion w, x, y, z; m/s and rad/s, with which\n"
           "each later touch moves it on. Points of tools and forces on tools are in the world. Raises Error.")
      .def("set_motions", &HeldScene::set_motions, py::arg("amounts"),
           "By how much each of Bundle.motions moves the organ from the next touch on: float64 [motions], m, rad, 1,\n"
           "Pa or m/s^2. Call it before each touch of an organ that breathes. Raises Error.")
      .def("hold_volume", &HeldScene::hold_volume, py::arg("motion"), py::arg("volume"),
           "For a motion of kind \"pressure\": holds what its surface has swept, m^3, in place of its pressure; None:\n"
           "the pressure is given again. Raises Error.")
      .def("motion_states", &HeldScene::motion_states,
           "After a touch: structured [motions], a copy: amount (of a held volume the pressure, Pa), volume (m^3, of a "
           "pressure).")
      .def("set_load", &HeldScene::set_load, py::arg("load"), py::arg("vector"), py::kw_only(),
           py::arg("per_area") = false, py::arg("in_world") = false,
           "What a patch of `loads` bears from the next touch on: N in all, or per_area Pa; along the axes of the "
           "organ, or\n"
           "in_world of the world, as a weight. Raises Error.")
      .def("load_states", &HeldScene::load_states,
           "After a touch: structured [loads], a copy, in the world: force (N), place and displacement of the patch "
           "(m), "
           "area\n(m^2).")
      .def("set_links", &HeldScene::set_links, py::arg("links"),
           "Gives the scene its links, of Link, in place of those that it had; each later touch holds them. One that\n"
           "was there before with its id, kind and ends keeps its state, and takes its new numbers. Raises Error.")
      .def("link_states", &HeldScene::link_states,
           "After a touch: structured [links], a copy: id, condition (0 slack, 1 taut, 2 broken), broken (the touch),\n"
           "rest_length, length, tension (N), force ([3], N, on the first end), ends ([2, 3], m).")
      .def("set_obstacle_pose", &HeldScene::set_obstacle_pose, py::arg("obstacle"),
           py::arg("position") = py::make_tuple(0.0, 0.0, 0.0),
           py::arg("orientation") = py::make_tuple(1.0, 0.0, 0.0, 0.0), py::kw_only(),
           py::arg("velocity") = py::make_tuple(0.0, 0.0, 0.0),
           py::arg("angular_velocity") = py::make_tuple(0.0, 0.0, 0.0),
           "Where an obstacle is in the world from the next touch on, as set_pose says it of the organ.")
      .def("obstacle_states", &HeldScene::obstacle_states,
           "After a touch: structured [obstacles], a copy, in the world: force (N) and torque (N m) on the obstacle, "
           "position,\n"
           "orientation, deepest (m, a pressing node inside), nodes that press, slips of these.")
      .def(
          "set_blade", &HeldScene::set_blade, py::arg("blade"), py::arg("points"), py::arg("direction") = py::none(),
          py::arg("toughness") = 0.0, py::kw_only(), py::arg("friction") = 0.0, py::arg("width") = 0.0,
          "Where blade 0 .. 3 is at the next touch: points [2 .. 16, 3], m, in the world, along its edge. It cuts what "
          "lies\n"
          "between there and where it was in the touch before. toughness: J/m^2, of tissue that holds the edge and "
          "pushes\n"
          "it back; above 0 direction says where the edge looks, of length 1. friction: Pa, on the flanks, which "
          "reach\n"
          "width m behind the edge. Raises Error.")
      .def("withdraw_blade", &HeldScene::withdraw_blade, py::arg("blade"),
           "Takes a blade out: it cuts nothing from the next touch on. Raises Error.")
      .def("blade_state", &HeldScene::blade_state, py::arg("blade"),
           "After a touch: a record, a copy, in the world: force (N) and torque (N m, about the first point) on the "
           "blade,\n"
           "work, friction_work (J) and area (m^2) since it came, points in_tissue, cuts (of these); None where the "
           "scene has no such "
           "blade.")
      .def("remove_tissue", &HeldScene::remove_tissue, py::arg("centre"), py::arg("radius"), py::kw_only(),
           py::arg("held") = 0.0, py::arg("needed") = 0.0,
           "Removes the tetrahedra whose middle lies within radius (m) of centre (m, in the world) at the next touch. "
           "With\n"
           "needed (s) each goes once it has been in such balls for so long, held (s) of it in this one. Raises Error.")
      .def("cut_state", &HeldScene::cut_state,
           "After a touch: a record, a copy: surface (goes up where the surface has changed), area (m^2, at rest), "
           "faces,\n"
           "removed (tetrahedra), nodes (new), pieces, waiting (faces that cannot be cut yet), left (changes that the\n"
           "compliance does not have yet), rank, is_full, rebased (how often the compliance was), rebasing; None where "
           "the scene does not cut.")
      .def(
          "cut_surface", &HeldScene::cut_surface,
          "The surface of what is left: triangles, int32 [triangles, 3], nodes of shape, and is_lip, bool [triangles]: "
          "whether\n"
          "a cut made it. Copies; empty where the scene does not cut. Needed anew where surface of cut_state has "
          "changed.")
      .def("grasp_state", &HeldScene::grasp_state, py::arg("id"),
           "After a touch, of the tool with that id: a record, a copy: condition (0 open, 1 holds, 2 slips, 3 let go), "
           "force (N)\n"
           "and torque (N m) on the tool, place (m), slipped (m), friction_limit (N); None where no tool has it.")
      .def("needle_state", &HeldScene::needle_state, py::arg("id"),
           "After a touch, of the tool with that id: a record, a copy: condition (0 none, 1 outside, 2 presses, 3\n"
           "inside, 4 cuts, 5 stuck), places that it holds, slipping (of these), force (N) and torque (N m) on the\n"
           "tool, tip_force, shaft_force (N), depth (m), tip_at_rest (m); None where no tool has the id, or no tool\n"
           "may have a needle.")
      .def(
          "given_force_state", &HeldScene::given_force_state, py::arg("id"),
          "After a touch, of the tool with that id: a record, a copy: condition (0 free, 1 carried, 2 part, 3 moves),\n"
          "displacement (m, from where the host sends it), force (N, on the organ), missed (N, of what was given); "
          "None\n"
          "where no tool has the id, or no tool may have a force.")
      .def("reset", &HeldScene::reset, "Forgets contacts, last positions and forces; the pose stays.")
      .def("save", &HeldScene::save,
           "bytes: what the touches have left in the scene. Restored, the next touches give the same bits.")
      .def(
          "restore", &HeldScene::restore, py::arg("state"),
          "Takes over the state of a scene with the same effects, limits and bundle. Raises Error where it is damaged\n"
          "or of another scene, which leaves this one as it was.")
      .def("reset_tool", &HeldScene::reset_tool, py::arg("id"),
           "The same for the tool of that id alone; an id that is not in use changes nothing.");
}

}  // namespace palpate::python
