#include "formats/scene_cuts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "formats/scene_holds.h"
#include "formats/scene_organs.h"

namespace palpate {
namespace {

constexpr double kMostToughness = 1e6, kMostFriction = 1e6;  // J/m^2; Pa: as palpate_cut.h

// A name that no other table of its kind has, and the table's line.
template <class Table>
Table begin(TomlTable& table, const std::vector<Table>& others, const char* key, const char* example) {
  Table one;
  one.line = table.line();
  one.name = table.text("name", example);
  for (const Table& other : others)
    if (other.name == one.name) table.wrong("name", fmt::format("a name that no other [[{}]] has", key));
  return one;
}

}  // namespace

SceneConfig::Blade read_blade(TomlTable table, const SceneConfig& scene) {
  SceneConfig::Blade blade = begin(table, scene.blades, "blade", "\"scalpel\"");
  const double scale = scene.metres_per_unit;
  for (const auto& point : table.points("edge")) blade.edge.push_back(scaled(point, scale));
  if (blade.edge.size() < 2 || blade.edge.size() > PALPATE_MAX_BLADE_POINTS)
    table.wrong("edge", fmt::format("2 to {} points [x, y, z]", PALPATE_MAX_BLADE_POINTS));
  if (std::ranges::adjacent_find(blade.edge) != blade.edge.end())
    table.wrong("edge", "points that each differ from the one before");
  blade.path = read_way(table, scale, "a blade's path");
  if (table.has("turn")) blade.turn = read_turn(table);
  if (table.has("cuts")) blade.cuts = read_spans(table, "cuts");
  if (table.has("toughness")) {
    blade.toughness = table.number("toughness");
    if (!(blade.toughness > 0 && blade.toughness <= kMostToughness))
      table.wrong("toughness", "a work of an area, above 0 and at most 1e6 J/m^2");
    blade.direction = table.vector("direction");
    const auto& [x, y, z] = blade.direction;
    if (!(std::hypot(x, y, z) > 0)) table.wrong("direction", "a direction that is not zero");
    if (table.has("friction")) {
      blade.friction = table.number("friction");
      if (!(blade.friction > 0 && blade.friction <= kMostFriction))
        table.wrong("friction", "a shear stress, above 0 and at most 1e6 Pa");
      blade.width = scale * table.number("width");
      if (!(blade.width > 0 && blade.width <= 1)) table.wrong("width", "a length above 0 and at most 1 m");
    } else if (table.has("width")) {
      table.wrong("width", "friction beside it, without which the flanks feel nothing");
    }
  }
  for (const char* const key : {"direction", "friction", "width"})
    if (blade.toughness == 0 && table.has(key))
      table.wrong(key, "toughness beside it, without which the blade feels nothing");
  blade.organ = read_organ_of(table, scene, true);
  table.finish();
  return blade;
}

SceneConfig::Removal read_removal(TomlTable table, const SceneConfig& scene) {
  SceneConfig::Removal removal = begin(table, scene.removals, "removal", "\"hook\"");
  removal.radius = read_radius(table, scene.metres_per_unit);
  if (!table.has("position") && !table.has("path") && !table.has("path_csv"))
    table.wrong("position", "position = [x, y, z], or path = [[t, x, y, z], ...] or path_csv = \"FILE.csv\"");
  removal.path = read_way(table, scene.metres_per_unit, "a removal's path");
  if (table.has("time") == table.has("times"))
    table.wrong(table.has("time") ? "times" : "time", "either time = t or times = [[from, until], ...], not both");
  if (table.has("times")) {
    removal.times = read_spans(table, "times");
    if (removal.times.empty()) table.wrong("times", "one row [from, until] or more");
  } else {
    const double time = table.number("time");
    if (!(time >= 0)) table.wrong("time", "a time of at least 0 s");
    removal.times = {{time, time}};
  }
  if (table.has("every")) removal.every = positive(table, "every", "a time above 0 s");
  if (table.has("contact_time")) {
    removal.contact_time = table.number("contact_time");
    if (!(removal.contact_time >= 0 && removal.contact_time <= 1e6))
      table.wrong("contact_time", "a time from 0 to 1e6 s");
    if (removal.contact_time > 0 && table.has("time"))
      table.wrong("contact_time", "times = [[from, until], ...] beside it, during which the tissue is held");
  }
  removal.organ = read_organ_of(table, scene, true);
  table.finish();
  return removal;
}

void check_cuts(SceneConfig& scene, const TomlTable& root, NamedEffects named) {
  const bool cuts = !scene.blades.empty(), removes = !scene.removals.empty();
  if (cuts || removes) {
    const char* const key = cuts ? "blade" : "removal";
    const int line = cuts ? scene.blades[0].line : scene.removals[0].line;
    if (!named.cut) scene.def.cut.cut = PALPATE_CUT_ON;
    if (scene.def.cut.cut == PALPATE_CUT_OFF)
      root.contradicts(key, line, fmt::format("cut = true in [effects], since the scene has [[{}]] tables", key),
                       "cut = false");
  }
  if (scene.blades.size() > PALPATE_MAX_BLADES)
    root.contradicts("blade", scene.blades[PALPATE_MAX_BLADES].line,
                     fmt::format("at most {} blades of an organ", PALPATE_MAX_BLADES),
                     std::to_string(scene.blades.size()));
  if (scene.def.cut.cut == PALPATE_CUT_OFF) return;
  if (!named.collision) scene.def.collision = PALPATE_COLLISION_DEFORMED;
  if (scene.def.collision != PALPATE_COLLISION_DEFORMED)
    root.contradicts("effects", 0,
                     "collision = \"deformed\" beside cut, since the lips of a cut are where forces have moved them",
                     in_words("collision", scene.def));
}

}  // namespace palpate
