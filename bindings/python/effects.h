// The effects and limits of a scene as the keywords of Python give them.
#pragma once

#include <palpate/palpate_scene_def.hpp>

#include <algorithm>
#include <array>
#include <cstring>
#include <iomanip>
#include <optional>
#include <sstream>
#include <string>
#include <type_traits>
#include <vector>

#include "bindings/python/tools.h"

namespace palpate::python {

inline std::vector<std::string> words_of(const palpate_key& key) {
  std::istringstream list(key.words);
  std::vector<std::string> words;
  for (std::string word; std::getline(list >> std::ws, word, ',');) words.push_back(word);
  return words;
}

// The index of a word among the key's.
inline std::int32_t choose(const palpate_key& key, const std::string& word) {
  const std::vector<std::string> words = words_of(key);
  const auto at = std::find(words.begin(), words.end(), word);
  if (at == words.end())
    throw py::value_error(std::string(key.name) + ": expected one of " + key.words + "; found \"" + word + "\"");
  return static_cast<std::int32_t>(at - words.begin());
}

// Stores the value of a keyword; of two words it may be a bool as well. Throws cast_error where the value has another type.
inline void set_field(const palpate_key& key, const py::handle& value, SceneDef& def) {
  const bool is_bool = key.most == 1 && py::isinstance<py::bool_>(value);
  const double number = key.type == PALPATE_KEY_NUMBER               ? value.cast<double>()
                        : key.type == PALPATE_KEY_CHOICE && !is_bool ? choose(key, value.cast<std::string>())
                                                                     : static_cast<double>(value.cast<std::int64_t>());
  if (!palpate_set_key(&key, &def, number)) throw py::cast_error();
}

// The keys that are keywords as they are: neither pointers nor parts of a struct.
template <class Each>
void for_each_keyword(Each each) {
  for (std::int32_t k = 0; const palpate_key* key = palpate_scene_key(k); ++k)
    if (key->type != PALPATE_KEY_POINTER && !std::strchr(key->name, '.')) each(*key);
}

inline palpate_relaxation_def relaxation_of(const py::object& terms) {
  palpate_relaxation_def relaxation = palpate_default_relaxation_def();
  if (terms.is_none()) return relaxation;
  for (const py::handle each : terms) {
    const auto term = each.cast<std::pair<double, double>>();
    if (relaxation.terms == PALPATE_MAX_RELAXATION_TERMS)
      throw py::value_error("relaxation: expected at most " + std::to_string(PALPATE_MAX_RELAXATION_TERMS) + " terms");
    relaxation.share[relaxation.terms] = term.first;
    relaxation.time[relaxation.terms++] = term.second;
  }
  return relaxation;
}

inline palpate_loads_def loads_of(const py::object& patches) {
  palpate_loads_def loads = palpate_default_loads_def();
  if (patches.is_none()) return loads;
  for (const py::handle each : patches) {
    const auto [centre, radius] = each.cast<std::pair<std::array<double, 3>, double>>();
    if (loads.count == PALPATE_MAX_LOADS)
      throw py::value_error("loads: expected at most " + std::to_string(PALPATE_MAX_LOADS) + " patches");
    std::copy(centre.begin(), centre.end(), loads.centre[loads.count]);
    loads.radius[loads.count++] = radius;
  }
  return loads;
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

  explicit FineSurface(const py::object& from, const char* name = "fine_surface") {
    if (!py::isinstance<py::tuple>(from) || from.cast<py::tuple>().size() != 2) refuse(name);
    take(from.cast<py::tuple>()[0], positions, name), take(from.cast<py::tuple>()[1], triangles, name);
    surface.positions = positions.data(), surface.triangles = triangles.data();
    surface.vertex_count = static_cast<std::int32_t>(positions.shape(0));
    surface.triangle_count = static_cast<std::int32_t>(triangles.shape(0));
  }
  [[noreturn]] static void refuse(const std::string& name) {
    throw py::value_error(name +
                          ": expected a tuple of positions [vertices, 3] and triangles [triangles, 3], whole numbers");
  }
  template <class Array>
  static void take(const py::handle& from, Array& array, const char* name) {
    const py::array given = py::array::ensure(from);
    if (!given || given.ndim() != 2 || given.shape(1) != 3 || given.shape(0) > INT32_MAX) refuse(name);
    if (std::is_same_v<typename Array::value_type, std::int32_t> && given.dtype().kind() != 'i' &&
        given.dtype().kind() != 'u')
      refuse(name);
    array = Array::ensure(given);
    if (!array) refuse(name);
  }
};

// An obstacle with its mesh, where it has one.
struct HeldObstacle {
  palpate_obstacle given = palpate_default_obstacle();
  std::optional<FineSurface> mesh;
};

inline HeldObstacle make_obstacle(const std::string& kind, const py::object& size, const py::object& mesh,
                                  double friction, double depth, const Numbers& position, const Numbers& orientation) {
  HeldObstacle obstacle;
  palpate_obstacle& given = obstacle.given;
  const auto words = {"rectangle", "disc", "mesh"};
  const auto at = std::find(words.begin(), words.end(), kind);
  if (at == words.end()) throw py::value_error("kind: expected one of rectangle, disc, mesh; found \"" + kind + "\"");
  given.kind = static_cast<palpate_obstacle_kind>(PALPATE_OBSTACLE_RECTANGLE + (at - words.begin()));
  if (given.kind == PALPATE_OBSTACLE_RECTANGLE) {
    const auto lengths = size.cast<std::array<double, 2>>();
    std::copy(lengths.begin(), lengths.end(), given.size);
  }
  if (given.kind == PALPATE_OBSTACLE_DISC) given.size[0] = size.cast<double>();
  if (given.kind == PALPATE_OBSTACLE_MESH) obstacle.mesh.emplace(mesh, "mesh");
  given.friction = friction, given.depth = depth;
  set_numbers(given.position, position, "position");
  set_numbers(given.orientation, orientation, "orientation");
  return obstacle;
}

// A scene's definition, and the caller's arrays that it names until the scene is created.
struct Effects {
  SceneDef def;
  std::optional<RenderMesh> render_mesh;
  std::optional<FineSurface> fine_surface;
  std::vector<HeldObstacle> held_obstacles;
  std::vector<palpate_obstacle> obstacles;
};

inline void take_obstacles(const py::object& from, Effects& effects) {
  for (const py::handle each : from) {
    const HeldObstacle& held = effects.held_obstacles.emplace_back(each.cast<const HeldObstacle&>());
    palpate_obstacle& obstacle = effects.obstacles.emplace_back(held.given);
    if (!held.mesh) continue;
    const palpate_fine_surface& mesh = held.mesh->surface;
    obstacle.positions = mesh.positions, obstacle.triangles = mesh.triangles;
    obstacle.vertex_count = mesh.vertex_count, obstacle.triangle_count = mesh.triangle_count;
  }
  effects.def.obstacles.count = static_cast<std::int32_t>(effects.obstacles.size());
  effects.def.obstacles.list = effects.obstacles.data();
}

inline constexpr const char* kOtherArguments = "__init__(): incompatible constructor arguments";

// named: the keywords of Scene and Organ. What it refuses in pybind11's words is worded anew by palpate/__init__.py.
inline Effects effects_of(const py::kwargs& named) {
  Effects effects;
  const auto take = [&](const char* name) -> py::object { return named.attr("pop")(name, py::none()); };
  try {
    effects.def.relaxation = relaxation_of(take("relaxation"));
    effects.def.loads = loads_of(take("loads"));
    if (const py::object mesh = take("render_mesh"); !mesh.is_none())
      effects.def.render_mesh = effects.render_mesh.emplace(mesh).mesh;
    if (const py::object surface = take("fine_surface"); !surface.is_none())
      effects.def.fine_surface = effects.fine_surface.emplace(surface).surface;
    if (const py::object obstacles = take("obstacles"); !obstacles.is_none()) take_obstacles(obstacles, effects);
    for_each_keyword([&](const palpate_key& key) {
      if (named.contains(key.name)) set_field(key, take(key.name), effects.def);
    });
  } catch (const py::cast_error&) {
    throw py::type_error(kOtherArguments);
  }
  if (!named.empty()) throw py::type_error(kOtherArguments);
  return effects;
}

// A line for each keyword: its default, unit and words.
inline std::string lines_of_keywords() {
  const SceneDef start;
  std::ostringstream lines;
  for_each_keyword([&](const palpate_key& key) {
    const double number = palpate_key_number(&key, &start);
    lines << key.name << " = ";
    if (key.type == PALPATE_KEY_CHOICE)
      lines << '"' << words_of(key)[static_cast<std::size_t>(number)] << '"';
    else
      lines << std::fixed << std::setprecision(0) << number << (key.unit[0] ? " " : "") << key.unit;
    lines << (key.words[0] ? ": " : "") << key.words << '\n';
  });
  return lines.str();
}

inline constexpr const char* kAboutEffects =
    "Takes all memory and maps the sections that the effects need, and no other. Raises Error.\n"
    "\n"
    "contact patch: a disc of the tool's disc_radius\n"
    "queries: for cast_ray, closest_point, signed_distance\n"
    "dent discs: skin sinks the render mesh to the discs of the report\n"
    "deformation large: a hyperelastic body, solved in the touch; the bundle must have been made for it; "
    "large-beside,\n"
    "large-renewed: the same, solved by deform; large-auto: large or large-beside, by the number of nodes\n"
    "relaxation: None, or up to 8 pairs (share, seconds), the shares together below 1\n"
    "loads: None, or up to 4 patches of the surface that bear loads (set_load), each a pair of a place, m, and a\n"
    "radius, m (collision=\"deformed\" or \"off\")\n"
    "render_mesh: None, or a finer mesh that skin moves with the surface: positions [vertices, 3], m, or a tuple of\n"
    "positions and normals; read now and no longer\n"
    "fine_surface: None, or a closed surface that tools meet in place of the bundle's triangles: a tuple of positions\n"
    "[vertices, 3], m, and triangles [triangles, 3], counter-clockwise from outside; read now and no longer\n"
    "max_tools, max_points, max_contact_nodes: limits that memory is taken for\n"
    "force_limit, force_slew, torque_limit, torque_slew: on each tool's force and torque, for a device\n"
    "max_tool_speed, release_distance: beyond them a point is TRACKING_LOST\n"
    "max_operations: counted operations of a touch; what does not fit is put off (WORK_DEFERRED)\n"
    "max_links: links that set_links may give; grasps: whether tools may have a Grasp (contact=\"patch\")\n"
    "motions: whether the bundle's motions move the organ (set_motions; collision=\"deformed\" or \"off\")\n"
    "inside: whether inside and inside_at tell strain and stress, and carry moves points of the tissue\n"
    "(shape=\"volume\")\n"
    "needles: whether tools may have a Needle (a bundle with a corridor); needle_places: of\n"
    "the tissue that each of them holds at most\n"
    "force_control: whether tools may have a GivenForce in place of a position\n"
    "crossings: whether crossings tells where the surface passes through itself; crossings_calls: calls from the begin "
    "of one\n"
    "check to the next; crossings_operations: counted operations of a call\n"
    "obstacles: None, or up to 16 of Obstacle (set_obstacle_pose; collision=\"deformed\"); obstacle_nodes: nodes "
    "that all\n"
    "of them may hold\n"
    "cut: whether blades cut the organ (set_blade; a bundle with a region that may be cut, collision=\"deformed\");\n"
    "cut_nodes: new nodes at most, 0: as many as the bundle reserves; cut_rank: rank of what the cuts may add to the\n"
    "compliance; cut_operations: counted operations of a touch for it; cut_points: at which tissue holds an edge;\n"
    "cut_lips: pairs of nodes across from one another on lips that may press in a touch, 0: lips pass through;\n"
    "cut_rebase: the rank from which on touches re-base the compliance, 0: never\n"
    "\n";

// Gives a class of Python its constructor Class(bundle, **effects).
template <class Class>
void takes_effects(Class& type, const std::string& about) {
  type.def(py::init([](std::shared_ptr<HeldBundle> bundle, const py::kwargs& effects) {
             return std::make_shared<typename Class::type>(std::move(bundle), effects_of(effects));
           }),
           py::arg("bundle"), about.c_str());
}

}  // namespace palpate::python
