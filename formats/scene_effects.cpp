#include "formats/scene_effects.h"

#include <fmt/format.h>

#include "formats/scene_holds.h"
#include "formats/scene_organs.h"

namespace palpate {
namespace {

constexpr std::size_t kMaxRelaxationTerms = 8;
constexpr int kMaxLinks = 1000;

// An absent key leaves `out` as it is.
template <typename Value>
void optional_choice(TomlTable& table, const char* key, const std::vector<std::pair<std::string, Value>>& choices,
                     Value& out) {
  if (table.has(key)) out = table.choice(key, choices);
}

// What an effect is, as a scene file would say it: law = "sticking".
template <typename Value>
std::string in_words(const char* key, Value value) {
  std::string words = find_config_key(ConfigFile::scene, "effects", key)->limits;  // in the order of the enumerators
  for (int skip = static_cast<int>(value); skip > 0; --skip) words.erase(0, words.find(", ") + 2);
  return fmt::format("{} = \"{}\"", key, words.substr(0, words.find(',')));
}

// A radius selects the contact model patch; with another contact model named, the radius would be ignored, so it is refused.
void choose_contact(SceneConfig& scene, const TomlTable& root, bool names_contact) {
  const auto needs_patch = [&](const char* key, int line, const std::string& why) {
    if (!names_contact) scene.contact = SceneConfig::Contact::patch;
    if (scene.contact != SceneConfig::Contact::patch)
      root.contradicts(key, line, fmt::format("contact = \"patch\" in [effects], since {}", why),
                       in_words("contact", scene.contact));
  };
  for (const auto& tool : scene.tools) {
    if (tool.disc_radius > 0) needs_patch("tool", tool.line, fmt::format("tool \"{}\" has a disc_radius", tool.name));
    if (tool.grasp) needs_patch("tool", tool.line, fmt::format("tool \"{}\" has a grasp", tool.name));
  }
  for (const auto& link : scene.links)
    if (link.radius > 0) needs_patch("link", link.line, fmt::format("link \"{}\" has a radius", link.name));
}

// Sutures, grasps and needles hold the linear organ alone.
void check_holds(const SceneConfig& scene, const TomlTable& root) {
  const bool linear = scene.deformation == SceneConfig::Deformation::linear;
  for (const auto& tool : scene.tools)
    if ((tool.grasp || tool.needle) && !linear)
      root.contradicts("tool", tool.line,
                       fmt::format("deformation = \"linear\" in [effects], since tool \"{}\" has a {}", tool.name,
                                   tool.grasp ? "grasp" : "needle"),
                       in_words("deformation", scene.deformation));
  if (!scene.links.empty() && !linear)
    root.contradicts("link", scene.links[0].line, "deformation = \"linear\" in [effects], since the scene has links",
                     in_words("deformation", scene.deformation));
  int stretches = 0;
  for (const auto& link : scene.links) stretches += stretches_of(link);
  if (stretches > kMaxLinks)
    root.contradicts("link", 0, fmt::format("at most {} stretches between places of all links together", kMaxLinks),
                     std::to_string(stretches));
}

// Motions move the linear organ, and tools meet it where it is.
void check_motions(SceneConfig& scene, const TomlTable& root, bool names_collision) {
  if (scene.motions.empty()) return;
  for (std::size_t i = 0; i < scene.motions.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (scene.motions[i].name == scene.motions[j].name)
        root.contradicts("motion", scene.motions[i].line, "a name that no other [[motion]] has",
                         fmt::format("\"{}\" again", scene.motions[i].name));
  if (scene.deformation != SceneConfig::Deformation::linear)
    root.contradicts("motion", scene.motions[0].line,
                     "deformation = \"linear\" in [effects], since the scene has motions",
                     in_words("deformation", scene.deformation));
  if (!names_collision) scene.collision = SceneConfig::Collision::deformed;
  if (scene.collision == SceneConfig::Collision::rest)
    root.contradicts("motion", scene.motions[0].line,
                     "collision = \"deformed\" or \"off\" in [effects], since the scene has motions",
                     in_words("collision", scene.collision));
}

void check_inside(const SceneConfig& scene, const TomlTable& root) {
  if (scene.inside && scene.shape != SceneConfig::Shape::volume)
    root.contradicts("effects", 0, "shape = \"volume\" beside inside = true, which needs the displacement of all nodes",
                     in_words("shape", scene.shape));
  if (!scene.carried.empty() && !scene.inside)
    root.contradicts("carried", scene.carried[0].line,
                     fmt::format("inside = true in [effects], since \"{}\" is carried", scene.carried[0].name),
                     "inside = false");
}

void check_dent_and_friction(const SceneConfig& scene, const TomlTable& root) {
  if (scene.dent == SceneConfig::Dent::discs && scene.contact != SceneConfig::Contact::patch)
    root.contradicts("effects", 0, "no dent = \"discs\", or a tool with a disc_radius, whose dent is drawn",
                     in_words("contact", scene.contact));
  for (const auto& tool : scene.tools)
    if (tool.friction > 0 && scene.law != SceneConfig::Law::coulomb)
      root.contradicts("tool", tool.line,
                       fmt::format("law = \"coulomb\" in [effects], since tool \"{}\" has a friction", tool.name),
                       in_words("law", scene.law));
}

}  // namespace

void read_effects(TomlTable table, SceneEffects& effects) {
  using S = SceneEffects;
  optional_choice<S::Collision>(
      table, "collision",
      {{"off", S::Collision::off}, {"rest", S::Collision::rest}, {"deformed", S::Collision::deformed}},
      effects.collision);
  optional_choice<S::Contact>(table, "contact",
                              {{"node", S::Contact::node},
                               {"triangle", S::Contact::triangle},
                               {"point", S::Contact::point},
                               {"patch", S::Contact::patch}},
                              effects.contact);
  optional_choice<S::Law>(table, "law",
                          {{"sticking", S::Law::sticking},
                           {"sliding", S::Law::sliding},
                           {"unilateral", S::Law::unilateral},
                           {"coulomb", S::Law::coulomb}},
                          effects.law);
  optional_choice<S::Force>(table, "force",
                            {{"off", S::Force::off}, {"linear", S::Force::linear}, {"response", S::Force::response}},
                            effects.force);
  optional_choice<S::Shape>(table, "shape",
                            {{"off", S::Shape::off}, {"surface", S::Shape::surface}, {"volume", S::Shape::volume}},
                            effects.shape);
  optional_choice<S::Radial>(table, "radial", {{"off", S::Radial::off}, {"response", S::Radial::response}},
                             effects.radial);
  optional_choice<S::Deformation>(table, "deformation",
                                  {{"linear", S::Deformation::linear},
                                   {"large", S::Deformation::large},
                                   {"large-beside", S::Deformation::large_beside},
                                   {"large-renewed", S::Deformation::large_renewed}},
                                  effects.deformation);
  optional_choice<S::Dent>(table, "dent", {{"off", S::Dent::off}, {"discs", S::Dent::discs}}, effects.dent);
  if (table.has("preload")) effects.preload = table.boolean("preload");
  if (table.has("inside")) effects.inside = table.boolean("inside");
  table.finish();
}

SceneConfig::Relaxation read_relaxation(TomlTable table) {
  SceneConfig::Relaxation relaxation;
  relaxation.terms = table.rows<2>("terms", "[share, seconds]");
  double sum = 0;
  for (std::size_t i = 0; i < relaxation.terms.size(); ++i) {
    const auto [share, time] = relaxation.terms[i];
    sum += share;
    if (!(share >= 0 && time > 0 && sum < 1))
      table.wrong_row("terms", i, "a share of at least 0, all together below 1, and a time above 0 s");
  }
  if (relaxation.terms.size() > kMaxRelaxationTerms)
    table.wrong("terms", fmt::format("at most {} terms", kMaxRelaxationTerms));
  relaxation.source = table.text("source", "\"Author year, table 1\"");
  table.finish();
  return relaxation;
}

SceneConfig::Surface read_surface(TomlTable table) {
  SceneConfig::Surface surface;
  surface.file = table.path("file", "\"fine.ply\"");
  optional_choice(table, "unit", scene_lengths(), surface.metres_per_unit);
  table.finish();
  return surface;
}

SceneConfig::Carried read_carried(TomlTable table, const SceneConfig& scene) {
  SceneConfig::Carried carried;
  carried.line = table.line();
  carried.name = table.text("name", "\"tumour\"");
  if (carried.name.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_") !=
      std::string::npos)
    table.wrong("name", "letters, digits, - and _, since files have the name");
  for (const SceneConfig::Carried& other : scene.carried)
    if (other.name == carried.name) table.wrong("name", "a name that no other [[carried]] has");
  carried.organ = read_organ_of(table, scene, true);
  carried.file = table.path("file", "\"tumour.ply\"");
  optional_choice(table, "unit", scene_lengths(), carried.metres_per_unit);
  if (table.has("within")) carried.within = table.number("within") * scene.metres_per_unit;
  if (!(carried.within >= 0)) table.wrong("within", "a length of at least 0");
  table.finish();
  return carried;
}

void settle_effects(SceneConfig& scene, const TomlTable& root, NamedEffects named) {
  choose_contact(scene, root, named.contact);
  check_motions(scene, root, named.collision);
  check_holds(scene, root);
  check_dent_and_friction(scene, root);
  check_inside(scene, root);
  if (scene.surface && scene.collision == SceneConfig::Collision::off)
    root.contradicts("surface", 0, "collision = \"rest\" or \"deformed\" in [effects], since tools meet that surface",
                     in_words("collision", scene.collision));
}

}  // namespace palpate
