#include "formats/scene_effects.h"

#include <fmt/format.h>

#include "formats/scene_cuts.h"
#include "formats/scene_holds.h"
#include "formats/scene_organs.h"

namespace palpate {
namespace {

constexpr int kMaxLinks = 1000;

// A radius selects the contact model patch; with another contact model named, the radius would be ignored, so it is refused.
void choose_contact(SceneConfig& scene, const TomlTable& root, bool names_contact) {
  const auto needs_patch = [&](const char* key, int line, const std::string& why) {
    if (!names_contact) scene.def.contact = PALPATE_CONTACT_PATCH;
    if (scene.def.contact != PALPATE_CONTACT_PATCH)
      root.contradicts(key, line, fmt::format("contact = \"patch\" in [effects], since {}", why),
                       in_words("contact", scene.def));
  };
  for (const auto& tool : scene.tools) {
    if (tool.disc_radius > 0) needs_patch("tool", tool.line, fmt::format("tool \"{}\" has a disc_radius", tool.name));
    if (tool.grasp) needs_patch("tool", tool.line, fmt::format("tool \"{}\" has a grasp", tool.name));
  }
  for (const auto& link : scene.links)
    if (link.radius > 0) needs_patch("link", link.line, fmt::format("link \"{}\" has a radius", link.name));
}

void check_links(const SceneConfig& scene, const TomlTable& root) {
  int stretches = 0;
  for (const auto& link : scene.links) stretches += stretches_of(link);
  if (stretches > kMaxLinks)
    root.contradicts("link", 0, fmt::format("at most {} stretches between places of all links together", kMaxLinks),
                     std::to_string(stretches));
}

// Motions or loads. Tools meet an organ that moves where it is. key: "motion" of [[motion]].
template <class Moves>
void check_moves(const std::vector<Moves>& moves, const char* key, SceneConfig& scene, const TomlTable& root,
                 bool names_collision) {
  if (moves.empty()) return;
  for (std::size_t i = 0; i < moves.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (moves[i].name == moves[j].name)
        root.contradicts(key, moves[i].line, fmt::format("a name that no other [[{}]] has", key),
                         fmt::format("\"{}\" again", moves[i].name));
  if (!names_collision) scene.def.collision = PALPATE_COLLISION_DEFORMED;
  if (scene.def.collision == PALPATE_COLLISION_REST)
    root.contradicts(key, moves[0].line,
                     fmt::format("collision = \"deformed\" or \"off\" in [effects], since the scene has {}s", key),
                     in_words("collision", scene.def));
}

void check_loads(const SceneConfig& scene, const TomlTable& root) {
  if (scene.loads.size() > PALPATE_MAX_LOADS)
    root.contradicts("load", scene.loads[PALPATE_MAX_LOADS].line,
                     fmt::format("at most {} loads on an organ", PALPATE_MAX_LOADS),
                     std::to_string(scene.loads.size()));
}

// Obstacles meet an organ where forces have moved it.
void check_obstacles(SceneConfig& scene, const TomlTable& root, bool names_collision) {
  if (scene.obstacles.empty()) return;
  if (!names_collision) scene.def.collision = PALPATE_COLLISION_DEFORMED;
  const SceneConfig::Obstacle& first = scene.obstacles[0];
  if (scene.def.collision != PALPATE_COLLISION_DEFORMED)
    root.contradicts(
        "obstacle", first.line,
        fmt::format("collision = \"deformed\" in [effects], since \"{}\" meets a surface that has moved", first.name),
        in_words("collision", scene.def));
  if (scene.obstacles.size() > PALPATE_MAX_OBSTACLES)
    root.contradicts("obstacle", scene.obstacles[PALPATE_MAX_OBSTACLES].line,
                     fmt::format("at most {} obstacles of an organ", PALPATE_MAX_OBSTACLES),
                     std::to_string(scene.obstacles.size()));
}

void check_inside(const SceneConfig& scene, const TomlTable& root) {
  if (scene.def.inside.inside == PALPATE_INSIDE_ON && scene.def.shape != PALPATE_SHAPE_VOLUME)
    root.contradicts("effects", 0, "shape = \"volume\" beside inside = true, which needs the displacement of all nodes",
                     in_words("shape", scene.def));
  if (!scene.carried.empty() && scene.def.inside.inside == PALPATE_INSIDE_OFF)
    root.contradicts("carried", scene.carried[0].line,
                     fmt::format("inside = true in [effects], since \"{}\" is carried", scene.carried[0].name),
                     "inside = false");
}

void check_dent_and_friction(const SceneConfig& scene, const TomlTable& root) {
  if (scene.def.dent.dent == PALPATE_DENT_DISCS && scene.def.contact != PALPATE_CONTACT_PATCH)
    root.contradicts("effects", 0, "no dent = \"discs\", or a tool with a disc_radius, whose dent is drawn",
                     in_words("contact", scene.def));
  for (const auto& tool : scene.tools)
    if (tool.friction > 0 && scene.def.law != PALPATE_LAW_COULOMB)
      root.contradicts("tool", tool.line,
                       fmt::format("law = \"coulomb\" in [effects], since tool \"{}\" has a friction", tool.name),
                       in_words("law", scene.def));
}

}  // namespace

void read_effects(TomlTable table, SceneEffects& effects) {
  read_fields(table, "effects", effects.def);
  table.finish();
}

void read_relaxation(TomlTable table, SceneEffects& effects) {
  const std::vector<std::array<double, 2>> terms = table.rows<2>("terms", "[share, seconds]");
  if (terms.size() > PALPATE_MAX_RELAXATION_TERMS)
    table.wrong("terms", fmt::format("at most {} terms", PALPATE_MAX_RELAXATION_TERMS));
  palpate_relaxation_def& relaxation = effects.def.relaxation;
  relaxation.terms = 0;
  double sum = 0;
  for (const auto& [share, time] : terms) {
    sum += share;
    if (!(share >= 0 && time > 0 && sum < 1))
      table.wrong_row("terms", static_cast<std::size_t>(relaxation.terms),
                      "a share of at least 0, all together below 1, and a time above 0 s");
    relaxation.share[relaxation.terms] = share, relaxation.time[relaxation.terms++] = time;
  }
  effects.relaxation_source = table.text("source", "\"Author year, table 1\"");
  table.finish();
}

SceneConfig::Surface read_surface(TomlTable table) {
  SceneConfig::Surface surface;
  surface.file = table.path("file", "\"fine.ply\"");
  if (table.has("unit")) surface.metres_per_unit = table.choice("unit", scene_lengths());
  table.finish();
  return surface;
}

SceneConfig::Carried read_carried(TomlTable table, const SceneConfig& scene) {
  SceneConfig::Carried carried;
  carried.line = table.line();
  carried.name = table.text("name", "\"tumour\"");
  if (!is_plain(carried.name)) table.wrong("name", "letters, digits, - and _, since files have the name");
  for (const SceneConfig::Carried& other : scene.carried)
    if (other.name == carried.name) table.wrong("name", "a name that no other [[carried]] has");
  carried.organ = read_organ_of(table, scene, true);
  carried.file = table.path("file", "\"tumour.ply\"");
  if (table.has("unit")) carried.metres_per_unit = table.choice("unit", scene_lengths());
  if (table.has("within")) carried.within = table.number("within") * scene.metres_per_unit;
  if (!(carried.within >= 0)) table.wrong("within", "a length of at least 0");
  table.finish();
  return carried;
}

void settle_effects(SceneConfig& scene, const TomlTable& root, NamedEffects named) {
  choose_contact(scene, root, named.contact);
  check_moves(scene.motions, "motion", scene, root, named.collision);
  check_moves(scene.loads, "load", scene, root, named.collision);
  check_loads(scene, root);
  check_obstacles(scene, root, named.collision);
  check_cuts(scene, root, named);
  check_links(scene, root);
  check_dent_and_friction(scene, root);
  check_inside(scene, root);
  if (scene.surface && scene.def.collision == PALPATE_COLLISION_OFF)
    root.contradicts("surface", 0, "collision = \"rest\" or \"deformed\" in [effects], since tools meet that surface",
                     in_words("collision", scene.def));
}

}  // namespace palpate
