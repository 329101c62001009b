#include "formats/scene_holds.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "formats/scene_organs.h"

namespace palpate {
namespace {

using Rows = std::vector<std::array<double, 2>>;

constexpr double kMaxRadius = 1;          // m, as palpate.h
constexpr std::size_t kMaxPlaces = 1000;  // of one link; as many as palpate.h has links

// Rows [t, value]: values of `least` or more; with `above`, above it.
Rows read_rows(TomlTable& table, const char* key, const char* shown, double scale, bool above) {
  Rows rows = timed_rows<2>(table, key, shown);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    double& value = rows[i][1];
    if (above ? !(value > 0) : !(value >= 0))
      table.wrong_row(key, i, above ? "a number above 0" : "a number of at least 0");
    value *= scale;
  }
  return rows;
}

// A number, or rows of it, or neither: no rows.
Rows number_or_rows(TomlTable& table, const char* number, const char* rows, const char* shown, double scale,
                    bool above) {
  const bool one = table.has(number), many = table.has(rows);
  if (one && many) table.wrong(rows, fmt::format("either {} or {}, not both", number, rows));
  if (many) return read_rows(table, rows, shown, scale, above);
  if (!one) return {};
  const double value = table.number(number);
  if (above ? !(value > 0) : !(value >= 0)) table.wrong(number, above ? "a number above 0" : "a number of at least 0");
  return {{0, value * scale}};
}

}  // namespace

double read_radius(TomlTable& table, double scale) {
  const double radius = positive(table, "radius", "a length above 0") * scale;
  if (radius > kMaxRadius) table.wrong("radius", "a length of at most 1 m");
  return radius;
}

SceneConfig::Link read_link(TomlTable table, const SceneConfig& scene) {
  using Kind = SceneConfig::Link::Kind;
  const double scale = scene.metres_per_unit;
  SceneConfig::Link link;
  link.line = table.line();
  link.name = table.text("name", "\"suture\"");
  link.kind = table.choice<Kind>("kind", {{"thread", Kind::thread}, {"spring", Kind::spring}, {"clip", Kind::clip}});
  for (const auto& place : table.points("places")) link.places.push_back(scaled(place, scale));
  if (table.has("world")) link.world = scaled(table.vector("world"), scale);
  link.rest_length = number_or_rows(table, "rest_length", "rest_lengths", "[t, length]", scale, false);
  link.stiffness = number_or_rows(table, "stiffness", "stiffnesses", "[t, stiffness]", 1, true);
  if (table.has("breaking_force")) link.breaking_force = positive(table, "breaking_force", "a force above 0 N");
  if (table.has("radius")) link.radius = read_radius(table, scale);
  link.organs = read_organs_of(table, scene, link.places.size());
  link.organ = read_organ_of(table, scene, link.organs.empty());
  const int stretches = stretches_of(link);
  if (link.places.size() > kMaxPlaces) table.wrong("places", fmt::format("at most {} places", kMaxPlaces));
  if (stretches < 1) table.wrong("places", "two places or more, or one place and world = [x, y, z]");
  if (stretches > 1 && link.kind != Kind::thread)
    table.wrong("places", "two ends in all, places and world; only a thread runs through more");
  if (link.kind == Kind::clip && !link.rest_length.empty())
    table.wrong(table.has("rest_length") ? "rest_length" : "rest_lengths",
                "no rest length of a clip, which brings its ends to one place");
  table.finish();
  return link;
}

namespace {

SceneConfig::Motion::Sine read_sine(TomlTable table) {
  SceneConfig::Motion::Sine sine;
  sine.amplitude = table.number("amplitude");
  sine.period = positive(table, "period", "a time above 0 s");
  if (table.has("mean")) sine.mean = table.number("mean");
  table.finish();
  return sine;
}

}  // namespace

SceneConfig::Motion read_motion(TomlTable table, const SceneConfig& scene) {
  SceneConfig::Motion motion;
  motion.line = table.line();
  motion.name = table.text("name", "\"diaphragm\"");
  motion.organ = read_organ_of(table, scene, true);
  const int ways = table.has("sine") + table.has("amounts") + table.has("amounts_csv");
  if (ways != 1)
    table.wrong("name",
                "exactly one of sine = { amplitude, period }, amounts = [[t, amount], ...] and amounts_csv = "
                "\"FILE.csv\" beside the name");
  if (table.has("sine")) motion.sine = read_sine(table.table("sine"));
  if (table.has("amounts")) {
    motion.amounts = timed_rows<2>(table, "amounts", "[t, amount]");
    if (motion.amounts.empty()) table.wrong("amounts", "one row [t, amount] or more");
  }
  if (table.has("amounts_csv"))
    motion.amounts = timed_csv_rows<2>(table.path("amounts_csv", "\"breath.csv\""), "a motion's amounts", "two numbers",
                                       "time,amount");
  table.finish();
  return motion;
}

SceneConfig::Place::At read_at(TomlTable& table) {
  using At = SceneConfig::Place::At;
  return table.choice<At>("at", {{"foremost", At::foremost},
                                 {"hindmost", At::hindmost},
                                 {"leftmost", At::leftmost},
                                 {"rightmost", At::rightmost},
                                 {"uppermost", At::uppermost},
                                 {"lowest", At::lowest}});
}

SceneConfig::Load read_load(TomlTable table, const SceneConfig& scene) {
  SceneConfig::Load load;
  load.line = table.line();
  load.name = table.text("name", "\"weight\"");
  load.organ = read_organ_of(table, scene, true);
  if (table.has("at") == table.has("near"))
    table.wrong(table.has("at") ? "near" : "at", "either at = \"foremost\" or near = [x, y, z], not both");
  if (table.has("at")) load.at = read_at(table);
  if (table.has("near")) load.near = scaled(table.vector("near"), scene.metres_per_unit);
  load.radius = read_radius(table, scene.metres_per_unit);
  const char* given = nullptr;
  for (const char* key : {"force", "forces", "traction", "tractions"}) {
    if (!table.has(key)) continue;
    if (given) table.wrong(key, fmt::format("no {} beside {}, since a load is given once", key, given));
    given = key;
  }
  if (!given)
    table.wrong(
        "force",
        "force = [x, y, z] or forces = [[t, x, y, z], ...], in N; or traction or tractions in Pa in their place");
  const std::string key = given;
  load.per_area = key.starts_with("traction");
  if (key.ends_with('s'))
    load.vectors = key_frames(timed_rows<4>(table, given, "[t, x, y, z]"), 1);
  else
    load.vectors = {{0, table.vector(given)}};
  if (load.vectors.empty()) table.wrong(given, "one row [t, x, y, z] or more");
  if (table.has("frame")) load.in_world = table.choice<bool>("frame", {{"world", true}, {"organ", false}});
  table.finish();
  return load;
}

namespace {

// What the obstacle's surface is, by its kind.
void read_kind(TomlTable& table, double scale, SceneConfig::Obstacle& obstacle) {
  using Kind = SceneConfig::Obstacle::Kind;
  obstacle.kind =
      table.choice<Kind>("kind", {{"rectangle", Kind::rectangle}, {"disc", Kind::disc}, {"mesh", Kind::mesh}});
  constexpr std::pair<const char*, Kind> keys[] = {
      {"size", Kind::rectangle}, {"radius", Kind::disc}, {"file", Kind::mesh}, {"unit", Kind::mesh}};
  for (const auto& [key, kind] : keys)
    if (table.has(key) && kind != obstacle.kind)
      table.wrong(
          key,
          "none, since it belongs to another kind: size to a rectangle, radius to a disc, file and unit to a mesh");
  if (obstacle.kind == Kind::rectangle) {
    const std::vector<double> size = table.numbers("size");
    if (size.size() != 2 || !(size[0] > 0 && size[1] > 0)) table.wrong("size", "two lengths above 0");
    obstacle.size = {scale * size[0], scale * size[1]};
  }
  if (obstacle.kind == Kind::disc) obstacle.size[0] = read_radius(table, scale);
  if (obstacle.kind == Kind::mesh) {
    obstacle.surface = {table.path("file", "\"rib.stl\""), scale};
    if (table.has("unit")) obstacle.surface->metres_per_unit = table.choice("unit", scene_lengths());
  }
  if (table.has("normal")) {
    if (obstacle.kind == Kind::mesh) table.wrong("normal", "none of a mesh, whose triangles say which side is outside");
    obstacle.normal = table.vector("normal");
  }
  const auto& [x, y, z] = obstacle.normal;
  if (!(std::hypot(x, y, z) > 0)) table.wrong("normal", "a direction that is not zero");
}

}  // namespace

SceneConfig::Obstacle read_obstacle(TomlTable table, const SceneConfig& scene) {
  const double scale = scene.metres_per_unit;
  SceneConfig::Obstacle obstacle;
  obstacle.line = table.line();
  obstacle.name = table.text("name", "\"table\"");
  for (const SceneConfig::Obstacle& other : scene.obstacles)
    if (other.name == obstacle.name) table.wrong("name", "a name that no other [[obstacle]] has");
  read_kind(table, scale, obstacle);
  obstacle.path = read_way(table, scale, "an obstacle's path");
  if (table.has("turn")) obstacle.turn = read_turn(table);
  if (table.has("friction")) obstacle.friction = friction(table);
  if (table.has("depth")) obstacle.depth = positive(table, "depth", "a length above 0") * scale;
  obstacle.organs = read_held_off(table, scene);
  table.finish();
  return obstacle;
}

SceneConfig::Grasp read_grasp(TomlTable table, double scale) {
  SceneConfig::Grasp grasp;
  grasp.line = table.line();
  grasp.near = scaled(table.vector("near"), scale);
  if (table.has("opposite")) grasp.opposite = scaled(table.vector("opposite"), scale);
  grasp.radius = read_radius(table, scale);
  if (table.has("closing")) grasp.closing = read_rows(table, "closing", "[t, length]", scale, false);
  if (!grasp.closing.empty() && !grasp.opposite)
    table.wrong("closing", "opposite = [x, y, z] as well, since two discs close on tissue between them");
  if (table.has("friction")) grasp.friction = friction(table);
  if (table.has("clamp_force")) {
    grasp.clamp_force = table.number("clamp_force");
    if (!(*grasp.clamp_force >= 0)) table.wrong("clamp_force", "a force of at least 0 N");
    if (grasp.opposite)
      table.wrong("clamp_force", "no clamp_force beside opposite, since the force between the two discs is known");
    if (!grasp.friction) table.wrong("clamp_force", "friction as well, without which the grasp never slips");
  }
  if (table.has("closed")) grasp.closed = read_spans(table, "closed");
  table.finish();
  return grasp;
}

namespace {

// As palpate.h: a force, or a force over a length.
void up_to_most(TomlTable& table, const char* key, const char* expected, double& value) {
  constexpr double most = 1e6;
  if (table.has(key)) value = table.number(key);
  if (!(value >= 0 && value <= most)) table.wrong(key, expected);
}

}  // namespace

SceneConfig::Needle read_needle(TomlTable table, double scale, bool has_place) {
  constexpr double most_radius = 0.01, least_spacing = 1e-4, most_spacing = 1;  // m, as palpate.h
  SceneConfig::Needle needle;
  needle.line = table.line();
  const bool has_entry = table.has("entry");
  if (has_entry && has_place) table.wrong("entry", "no entry, since the needle enters where the tool is placed");
  if (!has_entry && !has_place)
    table.wrong("entry", "entry = [x, y, z], or a tool with at or near, where the needle enters");
  if (has_entry) needle.entry = scaled(table.vector("entry"), scale);
  if (table.has("direction")) {
    needle.direction = table.vector("direction");
    const auto& [x, y, z] = *needle.direction;
    if (!(std::hypot(x, y, z) > 0)) table.wrong("direction", "a direction that is not zero");
  }
  needle.radius = positive(table, "radius", "a length above 0") * scale;
  if (needle.radius > most_radius) table.wrong("radius", "a length of at most 10 mm");
  up_to_most(table, "friction", "a friction of 0 to 1e6 N/m", needle.friction);
  up_to_most(table, "puncture_force", "a force of 0 to 1e6 N", needle.puncture_force);
  up_to_most(table, "cutting_force", "a force of 0 to 1e6 N", needle.cutting_force);
  if (table.has("spacing")) needle.spacing = table.number("spacing") * scale;
  if (!(needle.spacing >= least_spacing && needle.spacing <= most_spacing))
    table.wrong("spacing", "a length of 0.1 mm to 1 m");
  table.finish();
  return needle;
}

SceneConfig::GivenForce read_given_force(TomlTable table, double scale) {
  constexpr double most_force = 1e6;  // N, as palpate_force_control.h
  SceneConfig::GivenForce given;
  given.line = table.line();
  if (table.has("force") == table.has("forces"))
    table.wrong(table.has("force") ? "forces" : "force",
                "either force = [x, y, z] or forces = [[t, x, y, z], ...], in N");
  if (table.has("force"))
    given.forces = {{0, table.vector("force")}};
  else
    given.forces = key_frames(timed_rows<4>(table, "forces", "[t, x, y, z]"), 1);
  const char* key = table.has("force") ? "force" : "forces";
  if (given.forces.empty()) table.wrong(key, "one row [t, x, y, z] or more");
  for (const SceneConfig::KeyFrame& frame : given.forces)
    for (const double force : frame.position)
      if (!(std::fabs(force) <= most_force)) table.wrong(key, "forces of at most 1e6 N");
  if (table.has("speed")) given.speed = positive(table, "speed", "a speed above 0") * scale;
  table.finish();
  return given;
}

std::vector<SceneConfig::KeyFrame> key_frames(const std::vector<std::array<double, 4>>& rows, double scale) {
  std::vector<SceneConfig::KeyFrame> frames;
  for (const auto& [time, x, y, z] : rows) frames.push_back({time, scaled({x, y, z}, scale)});
  return frames;
}

std::vector<SceneConfig::KeyFrame> read_path(TomlTable& table, double scale, const char* what, const char* otherwise) {
  const bool csv = table.has("path_csv"), inline_rows = table.has("path");
  if (csv == inline_rows)
    table.wrong("path",
                fmt::format("either path = [[t, x, y, z], ...] or path_csv = \"FILE.csv\", not both{}", otherwise));
  return key_frames(inline_rows
                        ? timed_rows<4>(table, "path", "[t, x, y, z]")
                        : timed_csv_rows<4>(table.path("path_csv", "\"path.csv\""), what, "four numbers", "time,x,y,z"),
                    scale);
}

std::vector<SceneConfig::KeyFrame> read_way(TomlTable& table, double scale, const char* what) {
  const bool has_path = table.has("path"), has_csv = table.has("path_csv");
  if (table.has("position")) {
    if (has_path || has_csv) table.wrong(has_path ? "path" : "path_csv", "no path beside position, where it stays");
    return {{0, scaled(table.vector("position"), scale)}};
  }
  if (!has_path && !has_csv) return {{0, {}}};
  std::vector<SceneConfig::KeyFrame> path = read_path(table, scale, what, "");
  if (path.empty()) table.wrong("path", "one row [t, x, y, z] or more");
  return path;
}

std::vector<SceneConfig::KeyFrame> read_turn(TomlTable& tool) {
  const auto rows = timed_rows<4>(tool, "turn", "[t, x, y, z]");
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (!(std::hypot(rows[i][1], rows[i][2], rows[i][3]) <= kMostDegrees))
      tool.wrong_row("turn", i, "a turn of at most 1e6 degrees");
  return key_frames(rows, 1);
}

std::vector<std::array<double, 2>> read_spans(TomlTable& table, const char* key) {
  const Rows spans = table.rows<2>(key, "[from, until]");
  for (std::size_t i = 0; i < spans.size(); ++i)
    if (!(spans[i][0] >= (i > 0 ? spans[i - 1][1] : 0) && spans[i][1] > spans[i][0]))
      table.wrong_row(key, i, "two ascending times, of at least 0 s and not before the row before");
  return spans;
}

int stretches_of(const SceneConfig::Link& link) {
  return static_cast<int>(link.places.size() + (link.world ? 1 : 0)) - 1;
}

double value_at(const Rows& rows, double time) {
  const auto after =
      std::upper_bound(rows.begin(), rows.end(), time, [](double t, const auto& row) { return t < row[0]; });
  if (after == rows.begin()) return rows.front()[1];
  if (after == rows.end()) return rows.back()[1];
  const auto& before = *(after - 1);
  const double share = (time - before[0]) / ((*after)[0] - before[0]);
  return before[1] + share * ((*after)[1] - before[1]);
}

}  // namespace palpate
