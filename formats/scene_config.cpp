#include "formats/scene_config.h"

#include <fmt/format.h>

#include <cmath>

#include "formats/scene_cuts.h"
#include "formats/scene_effects.h"
#include "formats/scene_holds.h"
#include "formats/scene_organs.h"
#include "formats/toml_reader.h"

namespace palpate {
namespace {

constexpr std::size_t kMaxTools = 8;
constexpr int kMaxPoints = 1 << 16;
constexpr double kMaxRadius = 1;   // m
constexpr double kSlowest = 1e-6;  // Hz

// ---- paths ---------------------------------------------------------------------------------------------------------

SceneConfig::Place read_place(TomlTable& tool, double scale) {
  SceneConfig::Place place;
  if (tool.has("at")) place.at = read_at(tool);
  if (tool.has("near")) place.near = scaled(tool.vector("near"), scale);
  place.depth = timed_rows<2>(tool, "depth", "[t, depth]");
  for (auto& row : place.depth) row[1] *= scale;
  return place;
}

// ---- tools ---------------------------------------------------------------------------------------------------------

SceneConfig::Capsule read_capsule(TomlTable table, double scale) {
  SceneConfig::Capsule capsule;
  capsule.radius = positive(table, "radius", "a length above 0") * scale;
  capsule.length = table.number("length") * scale;
  if (capsule.length < 0) table.wrong("length", "a length of at least 0");
  if (table.has("axis")) capsule.axis = table.vector("axis");
  const double norm = std::hypot(capsule.axis[0], capsule.axis[1], capsule.axis[2]);
  if (!(norm > 0)) table.wrong("axis", "a direction that is not zero");
  capsule.axis = scaled(capsule.axis, 1 / norm);
  capsule.samples = count(table, "samples", 2, kMaxPoints);
  table.finish();
  return capsule;
}

unsigned read_axes(TomlTable& grip) {
  const char* expected = "any of x, y, z, each once";
  unsigned axes = 0;
  for (const char c : grip.text("axes", "\"xyz\"")) {
    const unsigned bit = c == 'x' ? 1 : c == 'y' ? 2 : c == 'z' ? 4 : 0;
    if (bit == 0 || (axes & bit)) grip.wrong("axes", expected);
    axes |= bit;
  }
  return axes;
}

SceneConfig::Grip read_grip(TomlTable& table, double scale) {
  SceneConfig::Grip grip;
  grip.line = table.line();
  const bool nearest = table.has("nearest"), box = table.has("box");
  if (nearest == box) table.wrong("nearest", "either nearest = [x, y, z] or box = { min, max }, not both");
  if (nearest) grip.nearest = scaled(table.vector("nearest"), scale);
  if (box) {
    TomlTable corners = table.table("box");
    grip.box_min = scaled(corners.vector("min"), scale);
    grip.box_max = scaled(corners.vector("max"), scale);
    for (int d = 0; d < 3; ++d)
      if (grip.box_min[d] > grip.box_max[d]) corners.wrong("max", "a corner that is nowhere below min");
    corners.finish();
  }
  if (table.has("axes")) grip.axes = read_axes(table);
  table.finish();
  return grip;
}

SceneConfig::Tool read_tool(TomlTable& table, const SceneConfig& scene) {
  const double scale = scene.metres_per_unit;
  SceneConfig::Tool tool;
  tool.line = table.line();
  tool.name = table.text("name", "\"probe\"");
  if (table.has("points"))
    for (const auto& point : table.points("points")) tool.points.push_back(scaled(point, scale));
  if (table.has("capsule")) tool.capsule = read_capsule(table.table("capsule"), scale);
  if (table.has("disc_radius")) {
    tool.disc_radius = positive(table, "disc_radius", "a length above 0") * scale;
    if (tool.disc_radius > kMaxRadius) table.wrong("disc_radius", "a length of at most 1 m");
  }
  if (table.has("friction")) tool.friction = friction(table);
  if (table.has("hold")) tool.hold = table.boolean("hold");
  const bool at = table.has("at"), near = table.has("near"), depth = table.has("depth");
  if (at || near || depth) {
    if (at == near) table.wrong(at ? "near" : "at", "either at = \"foremost\" or near = [x, y, z], not both");
    for (const char* other : {"path", "path_csv"})
      if (table.has(other)) table.wrong(other, "no path, since the tool's place is given by at or near, with depth");
    tool.place = read_place(table, scale);
    for (const auto& row : tool.place->depth) tool.path.push_back({row[0], {}});
  } else {
    tool.path = read_path(table, scale, "a tool's path",
                          "; or a place on the organ: at = \"foremost\" or near = [x, y, z], with depth = [[t, depth], "
                          "...]");
  }
  if (table.has("away")) tool.away = read_spans(table, "away");
  for (TomlTable& grip : table.tables("grip")) tool.grips.push_back(read_grip(grip, scale));
  if (table.has("turn")) tool.turn = read_turn(table);
  if (table.has("grasp")) tool.grasp = read_grasp(table.table("grasp"), scale);
  if (table.has("needle")) tool.needle = read_needle(table.table("needle"), scale, tool.place.has_value());
  if (table.has("given_force")) {
    tool.given_force = read_given_force(table.table("given_force"), scale);
    if (tool.grasp || tool.needle)
      table.wrong("given_force", "no force beside a grasp or a needle, which stand where the tool's path has them");
  }
  tool.organ =
      read_organ_of(table, scene, tool.place || tool.grasp || tool.needle || tool.given_force || !tool.grips.empty());
  if (tool.points.empty() && !tool.capsule && tool.grips.empty() && !tool.grasp && !tool.needle)
    table.wrong("points",
                "points, a capsule, a [[tool.grip]], a [tool.grasp] or a [tool.needle], so that the tool can touch "
                "something");
  table.finish();
  return tool;
}

// ---- the rest ------------------------------------------------------------------------------------------------------

void read_rate(TomlTable table, SceneConfig& scene) {
  if (table.has("touch")) scene.touch_hz = table.number("touch");
  if (table.has("shape")) scene.shape_hz = table.number("shape");
  if (!(scene.touch_hz >= kSlowest && scene.touch_hz <= 1e6))
    table.wrong("touch", "a rate of at least 1e-6 Hz and up to 1e6 Hz");
  if (!(scene.shape_hz >= kSlowest && scene.shape_hz <= scene.touch_hz))
    table.wrong("shape", fmt::format("a rate of at least 1e-6 Hz and up to the touch rate, {} Hz", scene.touch_hz));
  if (table.has("deform"))
    scene.deform_hz = table.number("deform");
  else
    scene.deform_hz = std::min(scene.deform_hz, scene.touch_hz);
  if (!(scene.deform_hz >= kSlowest && scene.deform_hz <= scene.touch_hz))
    table.wrong("deform", fmt::format("a rate of at least 1e-6 Hz and up to the touch rate, {} Hz", scene.touch_hz));
  table.finish();
}

void read_limits(TomlTable table, SceneConfig& scene) {
  read_fields(table, "limits", scene.def);
  if (table.has("displacement")) scene.displacement = positive(table, "displacement", "a length above 0 m");
  table.finish();
}

}  // namespace

SceneConfig read_scene_config(const std::filesystem::path& file) {
  TomlTable root(file, ConfigFile::scene, scene_keys());
  SceneConfig scene;
  scene.file = file;
  scene.name = root.text("name", "\"push\"");
  if (root.has("bundle")) scene.bundle = file.parent_path() / root.text("bundle", "\"bundle.h5\"");
  const double scale = root.choice("unit", scene_lengths());
  scene.metres_per_unit = scale;
  if (root.has("csv_unit")) scene.csv_metres_per_unit = root.choice("csv_unit", scene_lengths());
  NamedEffects named;
  if (root.has("effects")) named.add(root.table("effects")), read_effects(root.table("effects"), scene);
  if (root.has("relaxation")) read_relaxation(root.table("relaxation"), scene);
  if (root.has("surface")) scene.surface = read_surface(root.table("surface"));
  if (root.has("rate")) read_rate(root.table("rate"), scene);
  if (root.has("limits")) read_limits(root.table("limits"), scene);
  std::vector<NamedEffects> named_by_organs = read_organs(root, scene, named);
  if (!root.has("tool")) root.wrong("tool", "one [[tool]] or more");
  for (TomlTable& tool : root.tables("tool")) scene.tools.push_back(read_tool(tool, scene));
  for (TomlTable& link : root.tables("link")) scene.links.push_back(read_link(link, scene));
  for (TomlTable& motion : root.tables("motion")) scene.motions.push_back(read_motion(motion, scene));
  for (TomlTable& load : root.tables("load")) scene.loads.push_back(read_load(load, scene));
  for (TomlTable& obstacle : root.tables("obstacle")) scene.obstacles.push_back(read_obstacle(obstacle, scene));
  for (TomlTable& blade : root.tables("blade")) scene.blades.push_back(read_blade(blade, scene));
  for (TomlTable& removal : root.tables("removal")) scene.removals.push_back(read_removal(removal, scene));
  for (TomlTable& carried : root.tables("carried")) scene.carried.push_back(read_carried(carried, scene));
  if (scene.tools.size() > kMaxTools)
    root.contradicts("tool", 0, fmt::format("at most {} tools", kMaxTools), std::to_string(scene.tools.size()));
  if (scene.organs.empty()) settle_effects(scene, root, named);
  for (std::size_t k = 0; k < scene.organs.size(); ++k) {
    SceneConfig of_organ = organ_scene(scene, k);
    settle_effects(of_organ, root, named_by_organs[k]);
    scene.organs[k].effects = of_organ;
  }
  check_pairs(scene, root);
  check_links_between_organs(scene, root);
  root.finish();
  return scene;
}

}  // namespace palpate
