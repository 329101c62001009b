#include "formats/scene_keys.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <list>

namespace palpate {
namespace {

constexpr std::string_view kNotInFiles[] = {"queries",       "report",    "motions",   "grasps",       "needles",
                                            "force_control", "max_tools", "max_links", "torque_limit", "torque_slew"};

bool is_in_files(const palpate_key& field) {
  const std::string_view name = field.name;
  return field.type != PALPATE_KEY_POINTER && name.find('.') == name.npos &&
         std::find(std::begin(kNotInFiles), std::end(kNotInFiles), name) == std::end(kNotInFiles);
}

// A text that stays.
const char* kept(std::string text) {
  static std::list<std::string> texts;
  return texts.emplace_back(std::move(text)).c_str();
}

// "force" of force_limit, "points" of max_points.
const char* name_of(const palpate_key& field) {
  std::string name = field.name;
  if (name.starts_with("max_")) name.erase(0, 4);
  if (name.ends_with("_limit")) name.erase(name.size() - 6);
  return kept(name);
}

std::string limits_of(const palpate_key& field) {
  if (field.least > 0 && field.least < 1e-300) return "above 0";
  return field.most < 1e300 ? fmt::format("{:.0f} to {:.0f}", field.least, field.most)
                            : fmt::format("{:.0f} or above", field.least);
}

ConfigKey key_of(const palpate_key& field) {
  const SceneDef start = default_of_scene_file();
  const double number = palpate_key_number(&field, &start);
  constexpr ConfigFile file = ConfigFile::scene;
  if (field.type != PALPATE_KEY_CHOICE)
    return {file,
            "limits",
            name_of(field),
            field.type == PALPATE_KEY_COUNT ? "integer" : "number",
            field.unit[0] ? field.unit : "-",
            number == 0 ? "-" : kept(fmt::format("{}", number)),
            kept(limits_of(field)),
            &field};
  if (std::string_view(field.words) == "off, on")
    return {file, "effects", field.name, "boolean", "-", number == 0 ? "false" : "true", "", &field};
  const char* const standard = kept('"' + word_of(field, start) + '"');
  return {file, "effects", field.name, "choice", "-", standard, field.words, &field};
}

}  // namespace

const std::vector<ConfigKey>& scene_keys() {
  static const std::vector<ConfigKey> keys = [] {
    std::vector<ConfigKey> all = config_keys();
    for (std::int32_t k = 0; const palpate_key* field = palpate_scene_key(k); ++k)
      if (is_in_files(*field)) all.push_back(key_of(*field));
    return all;
  }();
  return keys;
}

std::string word_of(const palpate_key& field, const SceneDef& def) {
  std::string words = field.words;
  for (double skip = palpate_key_number(&field, &def); skip > 0; --skip) words.erase(0, words.find(", ") + 2);
  return words.substr(0, words.find(','));
}

std::string word_of(const char* name, const SceneDef& def) {
  return word_of(*find_config_key(scene_keys(), ConfigFile::scene, "effects", name)->field, def);
}

std::string in_words(const char* name, const SceneDef& def) {
  return fmt::format("{} = \"{}\"", name, word_of(name, def));
}

bool have_equal_fields(const SceneDef& a, const SceneDef& b) {
  return std::ranges::all_of(scene_keys(), [&](const ConfigKey& key) {
    return !key.field || palpate_key_number(key.field, &a) == palpate_key_number(key.field, &b);
  });
}

SceneDef default_of_scene_file() {
  SceneDef def;
  def.contact = PALPATE_CONTACT_POINT;
  def.max_points = def.max_contact_nodes = 0;
  return def;
}

void read_fields(TomlTable& table, const std::string& name, SceneDef& def) {
  for (const ConfigKey& key : scene_keys()) {
    if (!key.field || name != key.table || !table.has(key.key)) continue;
    const std::string type = key.type;
    const double number = type == "boolean"   ? table.boolean(key.key)
                          : type == "choice"  ? static_cast<double>(table.choice(key.key))
                          : type == "integer" ? static_cast<double>(table.integer(key.key))
                                              : table.number(key.key);
    if (!(number >= key.field->least && number <= key.field->most))
      table.wrong(key.key,
                  (type == "integer" ? "a whole number of " : fmt::format("a number in {}, ", key.unit)) + key.limits);
    palpate_set_key(key.field, &def, number);
  }
}

}  // namespace palpate
