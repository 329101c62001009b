#include "formats/scene_organs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "formats/scene_holds.h"

namespace palpate {
namespace {

constexpr std::size_t kMaxOrgans = 32;  // of palpate_world.h
constexpr int kMaxPairs = 1000;         // of palpate_world.h
constexpr int kMaxLinks = 1000;         // of palpate_world.h

// The index of the organ of that name.
std::size_t find_organ(const TomlTable& table, const char* key, const std::string& name, const SceneConfig& scene) {
  std::string names;
  for (std::size_t k = 0; k < scene.organs.size(); ++k) {
    if (scene.organs[k].name == name) return k;
    names += fmt::format("{}\"{}\"", k ? ", " : "", scene.organs[k].name);
  }
  table.wrong(key, fmt::format("the name of an [[organ]]: {}", names));
}

void read_world(TomlTable table, SceneConfig& scene) {
  if (table.has("pairs")) scene.pairs = count(table, "pairs", 0, kMaxPairs);
  if (table.has("friction")) {
    scene.organ_friction = friction(table);
    if (scene.organ_friction > 0 && scene.pairs == 0)
      table.wrong("friction", "pairs above 0 beside it, without which organs do not touch one another");
  }
  table.finish();
}

SceneConfig::Organ read_organ(TomlTable& table, const SceneConfig& scene, NamedEffects& named) {
  SceneConfig::Organ organ;
  organ.line = table.line();
  organ.name = table.text("name", "\"liver\"");
  if (!is_plain(organ.name)) table.wrong("name", "letters, digits, - and _ alone");
  for (const SceneConfig::Organ& other : scene.organs)
    if (other.name == organ.name) table.wrong("name", "a name that no other [[organ]] has");
  if (table.has("bundle")) organ.bundle = table.file().parent_path() / table.text("bundle", "\"bundle.h5\"");
  if (table.has("position")) organ.position = scaled(table.vector("position"), scene.metres_per_unit);
  if (table.has("turn")) organ.turn = table.vector("turn");
  for (const double angle : organ.turn)
    if (std::abs(angle) > kMostDegrees) table.wrong("turn", fmt::format("angles of at most {} degrees", kMostDegrees));
  organ.effects = scene;
  if (scene.pairs > 0 && !named.collision) organ.effects.def.collision = PALPATE_COLLISION_DEFORMED;
  if (table.has("effects")) named.add(table.table("effects")), read_effects(table.table("effects"), organ.effects);
  if (table.has("relaxation")) read_relaxation(table.table("relaxation"), organ.effects);
  if (table.has("surface")) organ.surface = read_surface(table.table("surface"));
  table.finish();
  return organ;
}

}  // namespace

std::vector<NamedEffects> read_organs(TomlTable& root, SceneConfig& scene, NamedEffects named) {
  if (!root.has("organ")) {
    if (root.has("world")) root.wrong("world", "[[organ]] tables beside it; a scene of one organ has no [world]");
    return {};
  }
  if (!scene.bundle.empty()) root.wrong("bundle", "no bundle here, since each [[organ]] has its own");
  if (scene.surface) root.wrong("surface", "no [surface] here, since an [[organ]] has its own: [organ.surface]");
  if (root.has("world")) read_world(root.table("world"), scene);
  std::vector<NamedEffects> named_by_organs;
  for (TomlTable& table : root.tables("organ")) {
    named_by_organs.push_back(named);
    scene.organs.push_back(read_organ(table, scene, named_by_organs.back()));
  }
  if (scene.organs.size() > kMaxOrgans)
    root.contradicts("organ", 0, fmt::format("at most {} organs", kMaxOrgans), std::to_string(scene.organs.size()));
  return named_by_organs;
}

std::size_t read_organ_of(TomlTable& table, const SceneConfig& scene, bool on_one) {
  if (!table.has("organ") && !(on_one && scene.organs.size() > 1)) return 0;
  if (scene.organs.empty()) table.wrong("organ", "no organ, since the scene has no [[organ]] tables");
  return find_organ(table, "organ", table.text("organ", fmt::format("\"{}\"", scene.organs[0].name).c_str()), scene);
}

std::vector<std::size_t> read_organs_of(TomlTable& table, const SceneConfig& scene, std::size_t places) {
  std::vector<std::size_t> organs;
  if (!table.has("organs")) return organs;
  if (scene.organs.empty()) table.wrong("organs", "no organs, since the scene has no [[organ]] tables");
  if (table.has("organ")) table.wrong("organ", "no organ beside organs, which name that of each place");
  for (const std::string& name : table.texts("organs")) organs.push_back(find_organ(table, "organs", name, scene));
  if (organs.size() != places) table.wrong("organs", fmt::format("as many names as places: {}", places));
  return organs;
}

std::vector<std::size_t> read_held_off(TomlTable& table, const SceneConfig& scene) {
  std::vector<std::size_t> organs(scene.organs.size());
  std::iota(organs.begin(), organs.end(), std::size_t{0});
  if (!table.has("organs")) return organs;
  if (scene.organs.empty()) table.wrong("organs", "no organs, since the scene has no [[organ]] tables");
  organs.clear();
  for (const std::string& name : table.texts("organs")) organs.push_back(find_organ(table, "organs", name, scene));
  if (organs.empty()) table.wrong("organs", "the name of one [[organ]] or more");
  return organs;
}

void check_links_between_organs(const SceneConfig& scene, const TomlTable& root) {
  int stretches = 0;
  for (const SceneConfig::Link& link : scene.links) {
    if (link.organs.empty()) continue;
    stretches += stretches_of(link);
    for (const std::size_t k : link.organs)
      if (link.radius > 0 && scene.organs[k].effects.def.contact != PALPATE_CONTACT_PATCH)
        root.contradicts("link", link.line,
                         fmt::format("of organ \"{}\" contact = \"patch\" in [effects], since link \"{}\" has a radius",
                                     scene.organs[k].name, link.name),
                         "another one");
  }
  if (stretches > kMaxLinks)
    root.contradicts("link", 0, fmt::format("at most {} stretches of all links between organs together", kMaxLinks),
                     std::to_string(stretches));
}

void check_pairs(const SceneConfig& scene, const TomlTable& root) {
  if (scene.pairs == 0) return;
  for (const SceneConfig::Organ& organ : scene.organs)
    if (organ.effects.def.collision != PALPATE_COLLISION_DEFORMED)
      root.contradicts("world", 0,
                       fmt::format("pairs = 0, or of organ \"{}\" collision = \"deformed\" in [effects]", organ.name),
                       fmt::format("pairs = {} and another one", scene.pairs));
}

SceneConfig organ_scene(const SceneConfig& scene, std::size_t organ) {
  SceneConfig one = scene;
  const SceneConfig::Organ& of = scene.organs[organ];
  static_cast<SceneEffects&>(one) = of.effects;
  one.bundle = of.bundle, one.surface = of.surface;
  for (SceneConfig::Tool& tool : one.tools)
    if (tool.organ != organ)
      tool.grips.clear(), tool.grasp.reset(), tool.needle.reset(), tool.place.reset(), tool.given_force.reset();
  const auto of_another = [organ](const auto& holds) { return holds.organ != organ; };
  std::erase_if(one.links, [&](const SceneConfig::Link& link) { return !link.organs.empty() || of_another(link); });
  std::erase_if(one.motions, of_another);
  std::erase_if(one.loads, of_another);
  std::erase_if(one.carried, of_another);
  std::erase_if(one.blades, of_another);
  std::erase_if(one.removals, of_another);
  std::erase_if(one.obstacles, [&](const SceneConfig::Obstacle& obstacle) {
    return std::ranges::find(obstacle.organs, organ) == obstacle.organs.end();
  });
  for (SceneConfig::Obstacle& obstacle : one.obstacles) obstacle.organs.clear();
  one.organs.clear();
  return one;
}

}  // namespace palpate
