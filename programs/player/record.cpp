#include "programs/player/record.h"

#include <fmt/format.h>

#include <toml++/toml.h>
#include <charconv>
#include <fstream>
#include <iterator>
#include <sstream>

#include "formats/atomic_file.h"
#include "formats/errors.h"
#include "formats/scene_holds.h"
#include "programs/player/bundle_fields.h"
#include "programs/player/scene_bundle.h"
#include "programs/player/tool_points.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

// ---- the scene in the record ---------------------------------------------------------------------------------------

toml::array numbers(const SceneConfig::Vector& v) {
  return toml::array{v[0], v[1], v[2]};
}

constexpr const char* kLinkKinds[] = {"thread", "spring", "clip"};
constexpr const char* kObstacleKinds[] = {"rectangle", "disc", "mesh"};
constexpr const char* kSides[] = {"foremost", "hindmost", "leftmost", "rightmost", "uppermost", "lowest"};

// The keys of a table that set fields. What is 0 of the limits follows from the scene.
toml::table fields_of(const std::string& name, const SceneDef& def) {
  toml::table table;
  for (const ConfigKey& key : scene_keys()) {
    if (!key.field || name != key.table) continue;
    const double number = palpate_key_number(key.field, &def);
    const std::string type = key.type;
    if (type == "boolean")
      table.insert(key.key, number != 0);
    else if (type == "choice")
      table.insert(key.key, word_of(*key.field, def));
    else if (type == "integer" && number != 0)
      table.insert(key.key, static_cast<std::int64_t>(number));
    else if (number != 0)
      table.insert(key.key, number);
  }
  return table;
}

// Without what changes no number of a record.
toml::table effects_of(const SceneConfig& scene) {
  toml::table table = fields_of("effects", scene.def);
  table.erase("dent"), table.erase("inside"), table.erase("crossings");
  if (scene.def.cut.cut == PALPATE_CUT_OFF) table.erase("cut");
  return table;
}

toml::table limits_of(const SceneConfig& scene) {
  toml::table table = fields_of("limits", scene.def);
  table.erase("crossings_calls"), table.erase("crossings_operations");
  if (scene.obstacles.empty()) table.erase("obstacle_nodes");
  if (scene.def.cut.cut == PALPATE_CUT_OFF)
    for (const char* key : {"cut_nodes", "cut_rank", "cut_operations", "cut_points", "cut_lips", "cut_rebase"})
      table.erase(key);
  if (scene.displacement) table.insert("displacement", *scene.displacement);
  return table;
}

toml::table relaxation_of(const SceneConfig& scene) {
  toml::array terms;
  const palpate_relaxation_def& relaxation = scene.def.relaxation;
  for (std::int32_t i = 0; i < relaxation.terms; ++i)
    terms.push_back(toml::array{relaxation.share[i], relaxation.time[i]});
  return toml::table{{"terms", std::move(terms)}, {"source", scene.relaxation_source}};
}

toml::table surface_of(const SceneConfig::Surface& surface, const fs::path& file) {
  return toml::table{{"file", file.lexically_normal().string()}, {"unit", unit_of(surface.metres_per_unit)}};
}

// The tool's position at each touch step, computed as the player computes it, so that the bits are the same.
toml::array path_of(const SceneConfig::Tool& tool, const SceneConfig& scene, std::uint64_t touches) {
  toml::array path;
  for (std::uint64_t step = 0; step < touches; ++step) {
    const double time = static_cast<double>(step) / scene.touch_hz;
    const SceneConfig::Vector p = position_at(tool.path, time);
    path.push_back(toml::array{time, p[0], p[1], p[2]});
  }
  return path;
}

template <std::size_t count>
toml::array rows_of(const std::vector<std::array<double, count>>& from) {
  toml::array rows;
  for (const auto& row : from) {
    toml::array one;
    for (const double x : row) one.push_back(x);
    rows.push_back(std::move(one));
  }
  return rows;
}

toml::array frames_of(const std::vector<SceneConfig::KeyFrame>& frames) {
  toml::array rows;
  for (const auto& [time, v] : frames) rows.push_back(toml::array{time, v[0], v[1], v[2]});
  return rows;
}

// Places as the scene names them: on the same bundle they are found anew.
toml::table grasp_of(const SceneConfig::Grasp& grasp) {
  toml::table table{{"near", numbers(grasp.near)}, {"radius", grasp.radius}};
  if (grasp.opposite) table.insert("opposite", numbers(*grasp.opposite));
  if (!grasp.closing.empty()) table.insert("closing", rows_of(grasp.closing));
  if (grasp.friction) table.insert("friction", *grasp.friction);
  if (grasp.clamp_force) table.insert("clamp_force", *grasp.clamp_force);
  if (!grasp.closed.empty()) table.insert("closed", rows_of(grasp.closed));
  return table;
}

toml::table given_force_of(const SceneConfig::GivenForce& given) {
  toml::table table{{"forces", frames_of(given.forces)}};
  if (given.speed) table.insert("speed", *given.speed);
  return table;
}

// The direction as the scene gives it: it gets length 1 alike when it is read anew.
toml::table needle_of(const SceneConfig::Needle& needle, const SceneConfig::Vector& entry) {
  toml::table table{{"entry", numbers(entry)},
                    {"radius", needle.radius},
                    {"friction", needle.friction},
                    {"puncture_force", needle.puncture_force},
                    {"cutting_force", needle.cutting_force},
                    {"spacing", needle.spacing}};
  if (needle.direction) table.insert("direction", numbers(*needle.direction));
  return table;
}

toml::array links_of(const SceneConfig& scene) {
  toml::array list;
  for (const SceneConfig::Link& link : scene.links) {
    toml::array places;
    for (const auto& place : link.places) places.push_back(numbers(place));
    toml::table table{{"name", link.name}, {"kind", kLinkKinds[static_cast<std::size_t>(link.kind)]}};
    table.insert("places", std::move(places));
    if (link.world) table.insert("world", numbers(*link.world));
    if (!link.rest_length.empty()) table.insert("rest_lengths", rows_of(link.rest_length));
    if (!link.stiffness.empty()) table.insert("stiffnesses", rows_of(link.stiffness));
    if (link.breaking_force) table.insert("breaking_force", *link.breaking_force);
    if (link.radius > 0) table.insert("radius", link.radius);
    list.push_back(std::move(table));
  }
  return list;
}

// Places as the scene names them.
toml::array loads_of(const SceneConfig& scene) {
  toml::array list;
  for (const SceneConfig::Load& load : scene.loads) {
    toml::table table{{"name", load.name}, {"radius", load.radius}, {"frame", load.in_world ? "world" : "organ"}};
    if (load.at) table.insert("at", kSides[static_cast<std::size_t>(*load.at)]);
    if (load.near) table.insert("near", numbers(*load.near));
    table.insert(load.per_area ? "tractions" : "forces", frames_of(load.vectors));
    list.push_back(std::move(table));
  }
  return list;
}

// In their own files where they are meshes, whose names are those that the scene found.
toml::array obstacles_of(const SceneConfig& scene, const fs::path& folder) {
  using Kind = SceneConfig::Obstacle::Kind;
  toml::array list;
  for (const SceneConfig::Obstacle& obstacle : scene.obstacles) {
    toml::table table{{"name", obstacle.name},
                      {"kind", kObstacleKinds[static_cast<std::size_t>(obstacle.kind)]},
                      {"path", frames_of(obstacle.path)},
                      {"friction", obstacle.friction}};
    if (obstacle.kind == Kind::rectangle) table.insert("size", toml::array{obstacle.size[0], obstacle.size[1]});
    if (obstacle.kind == Kind::disc) table.insert("radius", obstacle.size[0]);
    if (obstacle.kind != Kind::mesh) table.insert("normal", numbers(obstacle.normal));
    if (obstacle.surface) {
      const fs::path file = fs::absolute(obstacle.surface->file);
      for (auto&& [key, value] :
           surface_of(*obstacle.surface, folder.empty() ? file : file.lexically_proximate(folder)))
        table.insert(key, value);
    }
    if (!obstacle.turn.empty()) table.insert("turn", frames_of(obstacle.turn));
    if (obstacle.depth) table.insert("depth", *obstacle.depth);
    list.push_back(std::move(table));
  }
  return list;
}

toml::array blades_of(const SceneConfig& scene) {
  toml::array list;
  for (const SceneConfig::Blade& blade : scene.blades) {
    toml::array edge;
    for (const auto& point : blade.edge) edge.push_back(numbers(point));
    toml::table table{{"name", blade.name}, {"path", frames_of(blade.path)}};
    table.insert("edge", std::move(edge));
    if (!blade.turn.empty()) table.insert("turn", frames_of(blade.turn));
    if (!blade.cuts.empty()) table.insert("cuts", rows_of(blade.cuts));
    if (blade.toughness > 0)
      table.insert("toughness", blade.toughness), table.insert("direction", numbers(blade.direction));
    if (blade.friction > 0) table.insert("friction", blade.friction), table.insert("width", blade.width);
    list.push_back(std::move(table));
  }
  return list;
}

toml::array removals_of(const SceneConfig& scene) {
  toml::array list;
  for (const SceneConfig::Removal& removal : scene.removals) {
    toml::table table{{"name", removal.name},
                      {"path", frames_of(removal.path)},
                      {"radius", removal.radius},
                      {"every", removal.every}};
    if (removal.contact_time > 0) table.insert("contact_time", removal.contact_time);
    if (removal.times[0][0] == removal.times[0][1])
      table.insert("time", removal.times[0][0]);
    else
      table.insert("times", rows_of(removal.times));
    list.push_back(std::move(table));
  }
  return list;
}

toml::array motions_of(const Player& player) {
  toml::array list;
  const auto& motions = player.scene().motions;
  for (std::size_t i = 0; i < motions.size(); ++i) {
    const double metres = player.motions().metres_of(i);
    toml::table table{{"name", motions[i].name}};
    if (const auto& sine = motions[i].sine)
      table.insert("sine", toml::table{{"mean", metres * sine->mean},
                                       {"amplitude", metres * sine->amplitude},
                                       {"period", sine->period}});
    std::vector<std::array<double, 2>> amounts = motions[i].amounts;
    for (auto& row : amounts) row[1] *= metres;
    if (!amounts.empty()) table.insert("amounts", rows_of(amounts));
    list.push_back(std::move(table));
  }
  return list;
}

// Each gripped node is written as its own position, to which no other node is nearer.
toml::array grips_of(const std::vector<palpate_grip>& grips, const palpate_bundle* bundle) {
  toml::array list;
  for (const palpate_grip& grip : grips) {
    const double* p = palpate_bundle_nodes(bundle) + 3 * static_cast<std::size_t>(grip.node);
    std::string axes;
    for (int d = 0; d < 3; ++d)
      if (grip.axes >> d & 1u) axes += "xyz"[d];
    list.push_back(toml::table{{"nearest", numbers({p[0], p[1], p[2]})}, {"axes", axes}});
  }
  return list;
}

toml::table tool_of(const Player& player, std::size_t t) {
  const SceneConfig::Tool& tool = player.scene().tools[t];
  toml::table table{
      {"name", tool.name}, {"hold", tool.hold}, {"path", path_of(tool, player.scene(), player.touch_count())}};
  toml::array points;
  for (const auto& point : tool_points(tool)) points.push_back(numbers(point));
  if (!points.empty()) table.insert("points", std::move(points));
  if (tool.disc_radius > 0) table.insert("disc_radius", tool.disc_radius);
  if (tool.friction > 0) table.insert("friction", tool.friction);
  if (!tool.away.empty()) table.insert("away", rows_of(tool.away));
  if (!tool.turn.empty()) table.insert("turn", frames_of(tool.turn));
  if (tool.grasp) table.insert("grasp", grasp_of(*tool.grasp));
  if (tool.given_force) table.insert("given_force", given_force_of(*tool.given_force));
  if (tool.needle) table.insert("needle", needle_of(*tool.needle, player.needles().near(t)));
  if (!player.grips()[t].empty()) table.insert("grip", grips_of(player.grips()[t], player.bundle()));
  return table;
}

// Without the bundle.
toml::table resolved_scene(const Player& player) {
  const SceneConfig& scene = player.scene();
  toml::table table{{"name", scene.name},
                    {"unit", "m"},
                    {"effects", effects_of(scene)},
                    {"limits", limits_of(scene)},
                    {"rate", toml::table{{"touch", scene.touch_hz}, {"shape", scene.shape_hz}}}};
  if (scene.csv_metres_per_unit != 1) table.insert("csv_unit", unit_of(scene.csv_metres_per_unit));
  if (scene.def.large.deformation >= PALPATE_DEFORMATION_LARGE_BESIDE)
    table["rate"].as_table()->insert("deform", scene.deform_hz);
  if (scene.def.relaxation.terms > 0) table.insert("relaxation", relaxation_of(scene));
  if (scene.surface) table.insert("surface", surface_of(*scene.surface, fs::absolute(scene.surface->file)));
  toml::array tools;
  for (std::size_t t = 0; t < scene.tools.size(); ++t) tools.push_back(tool_of(player, t));
  table.insert("tool", std::move(tools));
  if (!scene.links.empty()) table.insert("link", links_of(scene));
  if (!scene.motions.empty()) table.insert("motion", motions_of(player));
  if (!scene.loads.empty()) table.insert("load", loads_of(scene));
  if (!scene.obstacles.empty()) table.insert("obstacle", obstacles_of(scene, {}));
  if (!scene.blades.empty()) table.insert("blade", blades_of(scene));
  if (!scene.removals.empty()) table.insert("removal", removals_of(scene));
  return table;
}

// ---- the file ------------------------------------------------------------------------------------------------------

constexpr const char* kFirstLine = "# palpate-run record 1\n";

std::string head_lines(std::uint64_t bundle, const OutputHash& output) {
  return fmt::format("{}# bundle {:016x}\n# output {:016x} {:016x}\n", kFirstLine, bundle, output.contacts,
                     output.shapes);
}

std::string own_line(std::uint64_t hash) {
  return fmt::format("# record {:016x}\n", hash);
}

std::uint64_t hash_of(const std::string& head, const std::string& scene) {
  formats::Xxh64 hash;
  hash.update(head.data(), head.size());
  hash.update(scene.data(), scene.size());
  return hash.digest();
}

// Sixteen hexadecimal digits at a byte of the text.
bool read_hash(const std::string& text, std::size_t at, std::uint64_t* hash) {
  if (text.size() < at + 16) return false;
  const char* end = text.data() + at + 16;
  return std::from_chars(text.data() + at, end, *hash, 16).ptr == end;
}

void check_bundle(const Player& player, const fs::path& bundle) {
  palpate_error error{};
  if (palpate_bundle_check(player.bundle(), &error) != PALPATE_OK)
    throw InputError(fmt::format("{}: byte {}: {}", bundle.string(), error.byte_offset, error.text));
}

void refuse_other_scene(const fs::path& record, const Player& recorded, const fs::path& file, const fs::path& bundle) {
  const toml::table expected = resolved_scene(recorded);
  const toml::table found = resolved_scene(Player(read_scene_config(file), bundle));
  for (const char* key : {"name", "effects", "limits", "rate", "relaxation", "surface", "tool", "link", "motion",
                          "load", "obstacle", "blade", "removal"}) {
    const toml::node *a = expected.get(key), *b = found.get(key);
    const bool same = a && b ? a->visit([&](const auto& node) {
      const auto* other = b->as<std::decay_t<decltype(node)>>();
      return other && *other == node;
    })
                             : a == b;
    if (!same)
      throw InputError(
          fmt::format("{}: expected the scene that {} was recorded from, found another \"{}\"; replay without a scene, "
                      "or record this one",
                      file.string(), record.string(), key));
  }
}

}  // namespace

void OutputHasher::add(const ShapeRecord& shape) {
  const std::size_t bytes = 3 * sizeof(float) * static_cast<std::size_t>(shape.node_count);
  shapes_.update(shape.displacements, bytes);
  shapes_.update(shape.positions, bytes);
  any_ = true;
}

void write_record(const fs::path& record, const Player& player, const fs::path& bundle, const OutputHash& output) {
  check_bundle(player, bundle);
  toml::table scene = resolved_scene(player);
  const fs::path folder = fs::absolute(record).parent_path();
  scene.insert("bundle", fs::absolute(bundle).lexically_proximate(folder).string());
  if (const auto& surface = player.scene().surface)
    scene.insert_or_assign("surface", surface_of(*surface, fs::absolute(surface->file).lexically_proximate(folder)));
  if (!player.scene().obstacles.empty()) scene.insert_or_assign("obstacle", obstacles_of(player.scene(), folder));
  std::ostringstream text;
  text << scene << '\n';
  const std::string head = head_lines(read_bundle_fields(bundle).identity, output);
  write_text_atomically(record, head + own_line(hash_of(head, text.str())) + text.str());
}

Record read_record(const fs::path& record) {
  std::ifstream stream(record, std::ios::binary);
  if (!stream || !fs::is_regular_file(record))
    throw InputError(fmt::format("{}: expected a record, found no file that can be read", record.string()));
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  if (text.compare(0, std::string(kFirstLine).size(), kFirstLine) != 0)
    throw InputError(
        fmt::format("{}: expected a record of palpate-run, version 1, found another first line; make one "
                    "with palpate-run SCENE.toml --record FILE",
                    record.string()));
  Record said;
  std::uint64_t hash = 0;
  const std::size_t bundle = std::string(kFirstLine).size() + std::string("# bundle ").size();
  const std::size_t output = bundle + 17 + std::string("# output ").size();
  const std::size_t own = output + 2 * 17 + std::string("# record ").size(), scene = own + 17;
  // The head must be exactly these lines, so it is written again from the numbers and compared.
  const bool whole = read_hash(text, bundle, &said.bundle) && read_hash(text, output, &said.output.contacts) &&
                     read_hash(text, output + 17, &said.output.shapes) && read_hash(text, own, &hash) &&
                     text.size() > scene &&
                     text.substr(0, scene) == head_lines(said.bundle, said.output) + own_line(hash) &&
                     hash == hash_of(head_lines(said.bundle, said.output), text.substr(scene));
  if (!whole)
    throw InputError(
        fmt::format("{}: expected a whole record, found {} bytes that differ from its own hash; copy it again",
                    record.string(), text.size()));
  return said;
}

std::string replay(const fs::path& record, const std::vector<std::string>& bundles, const fs::path& scene) {
  const Record expected = read_record(record);
  const SceneConfig recorded = read_scene_config(record);
  const fs::path bundle = bundle_of(recorded, bundles);
  if (const std::uint64_t found = read_bundle_fields(bundle).identity; found != expected.bundle)
    throw InputError(
        fmt::format("{}: expected the bundle that {} was recorded on, index {:016x}, found {:016x}; give that one with "
                    "--bundle",
                    bundle.string(), record.string(), expected.bundle, found));
  Player player(recorded, bundle);
  check_bundle(player, bundle);
  if (!scene.empty()) refuse_other_scene(record, player, scene, bundle);
  OutputHasher hasher;
  player.play([&](const TouchRecord& touch) { hasher.add(touch); },
              [&](const ShapeRecord& shape) { hasher.add(shape); });
  const OutputHash found = hasher.hash();
  if (found != expected.output)
    throw VerificationError(
        fmt::format("{}: expected contacts {:016x} and shapes {:016x}, found {:016x} and {:016x}: this build or "
                    "processor computes other numbers",
                    record.string(), expected.output.contacts, expected.output.shapes, found.contacts, found.shapes));
  return fmt::format("{}: {} touches replayed, contacts {:016x}, shapes {:016x}: as recorded\n", record.string(),
                     player.touch_count(), found.contacts, found.shapes);
}

}  // namespace palpate
