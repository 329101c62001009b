// The effects and limits of a scene as the keywords of Python give them.
#pragma once

#include <optional>
#include <string>
#include <type_traits>

#include "bindings/python/tools.h"

namespace palpate::python {

// The value of an enum from a word; words are in the order of the enum's values.
template <class Enum>
Enum choose(const char* effect, const std::string& word, std::initializer_list<const char*> words) {
  int value = 0;
  std::string all;
  for (const char* each : words) {
    if (word == each) return static_cast<Enum>(value);
    all += (value++ ? ", " : "") + std::string(each);
  }
  throw py::value_error(std::string(effect) + ": expected one of " + all + "; found \"" + word + "\"");
}

inline palpate_relaxation relaxation_of(const py::object& terms) {
  palpate_relaxation relaxation = {};
  if (terms.is_none()) return relaxation;
  relaxation.model = PALPATE_RELAXATION_PRONY;
  for (const py::handle each : terms) {
    const auto term = each.cast<std::pair<double, double>>();
    if (relaxation.terms == PALPATE_MAX_RELAXATION_TERMS)
      throw py::value_error("relaxation: expected at most " + std::to_string(PALPATE_MAX_RELAXATION_TERMS) + " terms");
    relaxation.share[relaxation.terms] = term.first;
    relaxation.time[relaxation.terms++] = term.second;
  }
  return relaxation;
}

// A render mesh while its scene is created: positions, or a tuple (positions, normals), each [vertices, 3].
struct RenderMesh {
  using Array = py::array_t<float, py::array::c_style | py::array::forcecast>;
  Array positions, normals;
  palpate_render_mesh mesh = palpate_default_render_mesh();

  explicit RenderMesh(const py::object& from) {
    const bool both = py::isinstance<py::tuple>(from);
    positions = rows(both ? from.cast<py::tuple>()[0] : from);
    if (both) normals = rows(from.cast<py::tuple>()[1]);
    if (both && normals.shape(0) != positions.shape(0))
      throw py::value_error("render_mesh: expected a normal for every position");
    mesh.positions = positions.data(), mesh.normals = both ? normals.data() : nullptr;
    mesh.vertex_count = static_cast<std::int32_t>(positions.shape(0));
  }
  static Array rows(const py::handle& from) {
    Array array = Array::ensure(from);
    if (!array || array.ndim() != 2 || array.shape(1) != 3 || array.shape(0) > INT32_MAX)
      throw py::value_error(
          "render_mesh: expected positions, or a tuple of positions and normals, of shape [vertices, 3]");
    return array;
  }
};

// A fine surface while its scene is created: a tuple of positions [vertices, 3] and triangles [triangles, 3].
struct FineSurface {
  py::array_t<float, py::array::c_style | py::array::forcecast> positions;
  py::array_t<std::int32_t, py::array::c_style | py::array::forcecast> triangles;
  palpate_fine_surface surface = palpate_default_fine_surface();

  explicit FineSurface(const py::object& from) {
    if (!py::isinstance<py::tuple>(from) || from.cast<py::tuple>().size() != 2) refuse();
    take(from.cast<py::tuple>()[0], positions), take(from.cast<py::tuple>()[1], triangles);
    surface.positions = positions.data(), surface.triangles = triangles.data();
    surface.vertex_count = static_cast<std::int32_t>(positions.shape(0));
    surface.triangle_count = static_cast<std::int32_t>(triangles.shape(0));
  }
  [[noreturn]] static void refuse() {
    throw py::value_error(
        "fine_surface: expected a tuple of positions [vertices, 3] and triangles [triangles, 3], whole numbers");
  }
  template <class Array>
  static void take(const py::handle& from, Array& array) {
    const py::array given = py::array::ensure(from);
    if (!given || given.ndim() != 2 || given.shape(1) != 3 || given.shape(0) > INT32_MAX) refuse();
    if (std::is_same_v<typename Array::value_type, std::int32_t> && given.dtype().kind() != 'i' &&
        given.dtype().kind() != 'u')
      refuse();
    array = Array::ensure(given);
    if (!array) refuse();
  }
};

// A scene's definition, and the caller's arrays that it names until the scene is created.
struct Effects {
  palpate_scene_def def = palpate_default_scene_def();
  std::optional<RenderMesh> render_mesh;
  std::optional<FineSurface> fine_surface;

  // With its pointers: valid as long as this object stays where it is.
  const palpate_scene_def& whole() {
    def.render_mesh = render_mesh ? &render_mesh->mesh : nullptr;
    def.fine_surface = fine_surface ? &fine_surface->surface : nullptr;
    return def;
  }
};

inline Effects effects_of(const std::string& collision, const std::string& contact, const std::string& law,
                          const std::string& force, const std::string& shape, const std::string& radial,
                          const std::string& preload, const std::string& queries, const std::string& deformation,
                          const std::string& report, const std::string& dent, const py::object& relaxation,
                          const py::object& render_mesh, const py::object& fine_surface, std::int32_t max_tools,
                          std::int32_t max_points, std::int32_t max_contact_nodes, double force_limit,
                          double force_slew, double max_tool_speed, double release_distance, double torque_limit,
                          double torque_slew, std::int64_t max_operations, std::int32_t max_links, bool grasps,
                          bool motions, bool inside, bool needles, std::int32_t needle_places) {
  Effects effects;
  palpate_scene_def& def = effects.def;
  def.collision = choose<palpate_collision>("collision", collision, {"off", "rest", "deformed"});
  def.contact = choose<palpate_contact_model>("contact", contact, {"node", "triangle", "point", "patch"});
  def.law = choose<palpate_contact_law>("law", law, {"sticking", "sliding", "unilateral", "coulomb"});
  def.force = choose<palpate_force_model>("force", force, {"off", "linear", "response"});
  def.shape = choose<palpate_shape_model>("shape", shape, {"off", "surface", "volume"});
  def.radial = choose<palpate_radial_model>("radial", radial, {"off", "response"});
  def.preload = choose<palpate_preload_model>("preload", preload, {"off", "on"});
  def.queries = choose<palpate_query_model>("queries", queries, {"off", "on"});
  def.deformation = choose<palpate_deformation_model>("deformation", deformation,
                                                      {"linear", "large", "large-beside", "large-renewed"});
  def.report = choose<palpate_report_model>("report", report, {"off", "contacts"});
  def.dent = choose<palpate_dent_model>("dent", dent, {"off", "discs"});
  def.relaxation = relaxation_of(relaxation);
  if (!render_mesh.is_none()) effects.render_mesh.emplace(render_mesh);
  if (!fine_surface.is_none()) effects.fine_surface.emplace(fine_surface);
  def.max_tools = max_tools;
  def.max_points = max_points;
  def.max_contact_nodes = max_contact_nodes;
  def.force_limit = force_limit;
  def.force_slew = force_slew;
  def.max_tool_speed = max_tool_speed;
  def.release_distance = release_distance;
  def.torque_limit = torque_limit;
  def.torque_slew = torque_slew;
  def.max_operations = max_operations;
  def.max_links = max_links;
  def.grasps = grasps;
  def.motions = motions;
  def.inside = inside ? PALPATE_INSIDE_ON : PALPATE_INSIDE_OFF;
  def.needles = needles;
  def.needle_places = needle_places;
  return effects;
}

inline constexpr const char* kAboutEffects =
    "Takes all memory and maps the sections that the effects need, and no other. Raises Error.\n"
    "\n"
    "collision: off, rest, deformed        contact: node, triangle, point, patch (a disc of the tool's disc_radius)\n"
    "law: sticking, sliding, unilateral, coulomb          force: off, linear, response\n"
    "shape: off, surface, volume           radial: off, response           preload: off, on\n"
    "queries: off, on (cast_ray, closest_point, signed_distance)          report: off, contacts\n"
    "dent: off, discs (skin sinks the render mesh to the discs of the report)\n"
    "deformation: linear; large (a hyperelastic body, solved in the touch; the bundle must have been made for it);\n"
    "large-beside, large-renewed (the same, solved by deform)\n"
    "relaxation: None, or up to 8 pairs (share, seconds), the shares together below 1\n"
    "render_mesh: None, or a finer mesh that skin moves with the surface: positions [vertices, 3], m, or a tuple of\n"
    "positions and normals; read now and no longer\n"
    "fine_surface: None, or a closed surface that tools meet in place of the bundle's triangles: a tuple of positions\n"
    "[vertices, 3], m, and triangles [triangles, 3], counter-clockwise from outside; read now and no longer\n"
    "max_tools, max_points, max_contact_nodes: limits that memory is taken for\n"
    "force_limit, N; force_slew, N/s: on each tool's force, for a device; torque_limit, N m; torque_slew, N m/s: on\n"
    "its torque\n"
    "max_tool_speed, m/s; release_distance, m (0: from the organ's size): beyond them a point is TRACKING_LOST\n"
    "max_operations: counted operations of a touch; what does not fit is put off (WORK_DEFERRED)\n"
    "max_links: links that set_links may give; grasps: whether tools may have a Grasp (contact=\"patch\",\n"
    "deformation=\"linear\")\n"
    "motions: whether the bundle's motions move the organ (set_motions; collision=\"deformed\" or \"off\")\n"
    "inside: whether inside and inside_at tell strain and stress, and carry moves points of the tissue\n"
    "(shape=\"volume\")\n"
    "needles: whether tools may have a Needle (deformation=\"linear\"; a bundle with a corridor); needle_places: of\n"
    "the tissue that each of them holds at most, 2 .. 64";

// Gives a class of Python its constructor Class(bundle, *, ...): the bundle, and the keywords of effects_of.
template <class Held, class... Choices>
auto maker_with(Effects (*choose_effects)(Choices...)) {
  return [choose_effects](std::shared_ptr<HeldBundle> bundle, Choices... choices) {
    return std::make_shared<Held>(std::move(bundle), choose_effects(choices...));
  };
}
template <class Class>
void takes_effects(Class& type, const char* about) {
  const palpate_scene_def start = palpate_default_scene_def();
  type.def(
      py::init(maker_with<typename Class::type>(&effects_of)), py::arg("bundle"), py::kw_only(),
      py::arg("collision") = "rest", py::arg("contact") = "patch", py::arg("law") = "sticking",
      py::arg("force") = "linear", py::arg("shape") = "surface", py::arg("radial") = "off", py::arg("preload") = "off",
      py::arg("queries") = "off", py::arg("deformation") = "linear", py::arg("report") = "off", py::arg("dent") = "off",
      py::arg("relaxation") = py::none(), py::arg("render_mesh") = py::none(), py::arg("fine_surface") = py::none(),
      py::arg("max_tools") = start.max_tools, py::arg("max_points") = start.max_points,
      py::arg("max_contact_nodes") = start.max_contact_nodes, py::arg("force_limit") = start.force_limit,
      py::arg("force_slew") = start.force_slew, py::arg("max_tool_speed") = start.max_tool_speed,
      py::arg("release_distance") = start.release_distance, py::arg("torque_limit") = start.torque_limit,
      py::arg("torque_slew") = start.torque_slew, py::arg("max_operations") = start.max_operations,
      py::arg("max_links") = start.max_links, py::arg("grasps") = false, py::arg("motions") = false,
      py::arg("inside") = false, py::arg("needles") = false, py::arg("needle_places") = start.needle_places, about);
}

}  // namespace palpate::python
