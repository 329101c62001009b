// Compares docs/files.md with the readers: its tables are printed from the list of keys, its examples are read, and its
// defaults are those that the readers take.
#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "formats/organ_config.h"
#include "formats/scene_config.h"
#include "formats/scene_keys.h"
#include "tests/support/test_files.h"
#include "tests/support/texts.h"

namespace palpate {
namespace {

using tests::fresh_folder;

const std::map<std::string, ConfigFile> kFiles = {
    {"organ.toml", ConfigFile::organ}, {"boundary", ConfigFile::boundary}, {"scene.toml", ConfigFile::scene}};

std::string page() {
  std::ifstream in(PALPATE_SOURCE_FOLDER "/docs/files.md");
  return {std::istreambuf_iterator<char>(in), {}};
}

// As a cell of a Markdown table.
std::string cell(std::string text) {
  for (std::size_t at = 0; (at = text.find('|', at)) != std::string::npos; at += 2) text.insert(at, 1, '\\');
  return text;
}

// What a key means: the last cell of its row in the page's own table.
std::string meaning_of(const std::string& key, const std::string& table) {
  const auto row = table.find("\n| `" + key + "` | ");
  if (row == std::string::npos) return "";
  const auto end = table.find(" |\n", row), cell = table.rfind(" | ", end - 1) + 3;
  return table.substr(cell, end - cell);
}

std::string keys_of(ConfigFile file, const std::string& table, const std::string& own) {
  std::ostringstream out;
  out << "| key | type | unit | default | limits | meaning |\n|---|---|---|---|---|---|\n";
  for (const ConfigKey& key : scene_keys()) {
    if (key.file != file || table != key.table) continue;
    const std::string standard = key.standard;
    const bool word = standard == "required" || standard == "-";
    const std::string limits = std::string(key.type) == "choice" ? "one of " + std::string(key.limits) : key.limits;
    out << "| `" << key.key << "` | " << key.type << " | " << key.unit << " | "
        << (word ? standard : "`" + standard + "`") << " | " << cell(limits.empty() ? "-" : limits) << " | "
        << meaning_of(key.key, own) << " |\n";
    EXPECT_GT(meaning_of(key.key, own).size(), 5u)
        << "docs/files.md: what does " << table << "." << key.key << " mean?";
  }
  return out.str();
}

// Returns the page with every table of keys printed anew; fills `tables` with the tables that it has.
std::string printed(const std::string& text, std::multiset<std::pair<ConfigFile, std::string>>& tables) {
  static const std::regex marker(R"(<!-- keys: (\S+) ?(\S*) -->\n)");
  std::string out;
  std::size_t at = 0;
  for (std::sregex_iterator i(text.begin(), text.end(), marker), end; i != end; ++i) {
    const std::size_t begin = static_cast<std::size_t>(i->position() + i->length());
    const std::size_t close = text.find("<!-- end of keys -->", begin);
    const auto file = kFiles.find((*i)[1]);
    if (close == std::string::npos || file == kFiles.end()) {
      ADD_FAILURE() << "docs/files.md: what does this line mean? " << (*i)[0];
      return text;
    }
    tables.emplace(file->second, (*i)[2]);
    out +=
        text.substr(at, begin - at) + "\n" + keys_of(file->second, (*i)[2], text.substr(begin, close - begin)) + "\n";
    at = close;
  }
  return out + text.substr(at);
}

TEST(FilesPage, HasEachTableOfKeysOnceAndAsTheListSays) {
  const std::string text = page();
  std::multiset<std::pair<ConfigFile, std::string>> tables;
  const std::string expected = printed(text, tables);
  for (const ConfigKey& key : scene_keys())
    EXPECT_EQ(tables.count({key.file, key.table}), 1u) << "docs/files.md: keys of table \"" << key.table << '"';
  if (text == expected) return;
  const std::filesystem::path printed_page = fresh_folder() / "files.md";
  std::ofstream(printed_page) << expected;
  ADD_FAILURE() << "docs/files.md does not say what the list of keys says; replace it: cp " << printed_page.string()
                << " docs/files.md";
}

// The page's ```toml blocks, by the file name in their first line.
std::map<std::string, std::string> examples() {
  static const std::regex block(R"(```toml\n# (\S+)\n([^`]*)```)");
  const std::string text = page();
  std::map<std::string, std::string> found;
  for (std::sregex_iterator i(text.begin(), text.end(), block), end; i != end; ++i) found[(*i)[1]] = (*i)[2];
  return found;
}

TEST(FilesPage, HasAnExampleOfEachFileThatTheReaderAcceptsAndThatShowsEveryKey) {
  const std::filesystem::path folder = fresh_folder();
  auto text = examples();
  ASSERT_EQ(text.size(), 4u);
  const auto written = [&](const std::string& name) {
    std::filesystem::create_directories((folder / name).parent_path());
    std::ofstream(folder / name) << text.at(name);
    return folder / name;
  };
  EXPECT_EQ(read_organ_config(written("organ.toml")).regions.size(), 4u);
  EXPECT_EQ(read_boundary_config(written("boundary/held.toml")).fixed.size(), 3u);
  std::ofstream(folder / "rod.csv") << "time,x,y,z\n0,0,0,0\n";
  EXPECT_EQ(read_scene_config(written("scene.toml")).tools.size(), 7u);
  EXPECT_EQ(read_scene_config(written("scenes/organs.toml")).organs.size(), 2u);
  const std::map<ConfigFile, std::string> shown = {
      {ConfigFile::organ, text.at("organ.toml")},
      {ConfigFile::boundary, text.at("boundary/held.toml")},
      {ConfigFile::scene, text.at("scene.toml") + text.at("scenes/organs.toml")}};
  for (const ConfigKey& key : scene_keys())
    EXPECT_TRUE(std::regex_search(shown.at(key.file), std::regex("\\b" + std::string(key.key) + "\\b")))
        << "docs/files.md: no example shows the key " << key.key;
}

// The refusal of a text of that kind, or nothing where the reader accepts it.
std::string refusal(ConfigFile kind, const std::filesystem::path& file, const std::string& text) {
  std::ofstream(file) << text;
  return tests::input_error([&] {
    if (kind == ConfigFile::organ) read_organ_config(file);
    if (kind == ConfigFile::boundary) read_boundary_config(file);
    if (kind == ConfigFile::scene) read_scene_config(file);
  });
}

TEST(FilesPage, ARefusalOfAMissingKeyShowsALineWithWhichTheExampleIsReadAgain) {
  const std::filesystem::path folder = fresh_folder();
  std::ofstream(folder / "rod.csv") << "time,x,y,z\n0,0,0,0\n";
  const auto text = examples();
  std::set<std::string> tried;
  for (const auto& [name, kind] : std::map<std::string, ConfigFile>{{"organ.toml", ConfigFile::organ},
                                                                    {"boundary/held.toml", ConfigFile::boundary},
                                                                    {"scene.toml", ConfigFile::scene}})
    for (const ConfigKey& key : scene_keys()) {
      if (key.file != kind || std::string(key.standard) != "required") continue;
      const std::string& whole = text.at(name);
      const std::regex own_line("(^|\n)" + std::string(key.key) + " = [^\n]*[^\\[\n]\n");
      std::smatch line;
      if (!std::regex_search(whole, line, own_line)) continue;  // within another line, or over several
      const std::string before = line.prefix().str() + line[1].str(), after = line.suffix();
      const std::string sentence = refusal(kind, folder / "example.toml", before + after);
      const std::string begin = "the key \"" + std::string(key.key) + "\" is missing; add it, for example: ";
      const auto at = sentence.find(begin);
      ASSERT_NE(at, std::string::npos) << name << ": " << key.key << ": " << sentence;
      EXPECT_EQ(refusal(kind, folder / "example.toml", before + sentence.substr(at + begin.size()) + "\n" + after), "")
          << sentence;
      tried.insert(key.key);
    }
  for (const char* key : {"young", "mesh_unit", "unit", "height", "gravity", "select", "terms"})
    EXPECT_EQ(tried.count(key), 1u) << key;
}

// Each @table.key@ of the text becomes the key with its default, or an empty line.
std::string filled(ConfigFile file, const std::string& text, bool with_defaults, std::set<std::string>& seen) {
  std::istringstream in(text);
  std::string out, line;
  while (std::getline(in, line)) {
    static const std::regex place(R"(@(\w*)\.(\w+)(,?)@)");
    std::smatch found;
    while (std::regex_search(line, found, place)) {
      const ConfigKey* key = find_config_key(scene_keys(), file, found[1].str(), found[2].str());
      EXPECT_NE(key, nullptr) << line;
      if (key) seen.insert(found[1].str() + "." + found[2].str());
      const std::string value = key && with_defaults ? found[2].str() + " = " + key->standard : std::string();
      const std::string comma = with_defaults ? found[3].str() : std::string();
      line = found.prefix().str() + value + comma + found.suffix().str();
    }
    out += line + "\n";
  }
  return out;
}

template <class Config>
void expect_the_defaults(ConfigFile file, const std::function<Config(const std::filesystem::path&)>& read,
                         const std::string& text, const std::set<std::string>& left_out = {},
                         const std::set<std::string>& alone = {}) {
  const std::filesystem::path toml = fresh_folder() / "config.toml";
  std::set<std::string> seen;
  std::ofstream(toml) << filled(file, text, true, seen);
  const Config stated = read(toml);
  std::ofstream(toml) << filled(file, text, false, seen);
  EXPECT_TRUE(stated == read(toml)) << "a default of formats/config_keys.cpp is not the reader's:\n" << text;
  for (const ConfigKey& key : scene_keys()) {
    const std::string standard = key.standard;
    if (left_out.count(key.table) || (!alone.empty() && !alone.count(key.table))) continue;
    if (key.file == file && standard != "required" && standard != "-") {
      EXPECT_TRUE(seen.count(std::string(key.table) + "." + key.key)) << key.table << "." << key.key;
    }
  }
}

TEST(FilesPage, StatesTheDefaultsThatTheReadersTake) {
  expect_the_defaults<OrganConfig>(ConfigFile::organ, read_organ_config, R"(name = "liver"
mesh_unit = "mm"
frame = "LPS"
element = "p1"
[[region]]
name = "liver"
young = { value = 5.4, unit = "kPa", source = "a" }
poisson = { value = 0.45, source = "b" }
[response]
curve = "c.csv"
source = "d"
height = { value = 13, unit = "mm" }
radius = { value = 15, unit = "mm" }
young = { value = 3156, unit = "Pa", source = "e" }
poisson = { value = 0.3, source = "f" }
@response.degree@
)");
  expect_the_defaults<BoundaryConfig>(ConfigFile::boundary, read_boundary_config, R"(name = "back"
[[fixed]]
dofs = "xyz"
select = { @select.where,@ everything = true }
[touchable]
select = { label = { @label.within,@ labels = [1] } }
[store]
@store.interior@
@store.large_deformation@
)");
  expect_the_defaults<SceneConfig>(ConfigFile::scene, read_scene_config, R"(name = "push"
unit = "mm"
@.csv_unit@
[effects]
@effects.collision@
@effects.contact@
@effects.law@
@effects.force@
@effects.shape@
@effects.radial@
@effects.deformation@
@effects.dent@
@effects.preload@
@effects.inside@
@effects.crossings@
@effects.cut@
[surface]
file = "fine.ply"
@surface.unit@
[rate]
@rate.touch@
@rate.shape@
@rate.deform@
[limits]
@limits.needle_places@
@limits.obstacle_nodes@
@limits.force@
@limits.force_slew@
@limits.tool_speed@
@limits.operations@
@limits.crossings_calls@
@limits.crossings_operations@
@limits.cut_rank@
@limits.cut_operations@
@limits.cut_points@
@limits.cut_lips@
[[tool]]
name = "probe"
capsule = { radius = 4, length = 60, @capsule.axis,@ samples = 4 }
path = [[0, 0, 0, 0]]
@tool.friction@
@tool.hold@
[[tool.grip]]
nearest = [0, 0, 0]
@grip.axes@
[tool.needle]
entry = [0, 0, 0]
radius = 0.5
@needle.friction@
@needle.puncture_force@
@needle.cutting_force@
)",
                                   {"organ", "world", "carried", "load", "obstacle", "blade", "removal"});
  expect_the_defaults<SceneConfig>(ConfigFile::scene, read_scene_config, R"(name = "push"
unit = "mm"
[[load]]
name = "swab"
near = [0, 0, 0]
radius = 4
force = [0, 0, 1]
@load.frame@
[[tool]]
name = "probe"
points = [[0, 0, 0]]
path = [[0, 0, 0, 0]]
)",
                                   {}, {"load"});
  expect_the_defaults<SceneConfig>(ConfigFile::scene, read_scene_config, R"(name = "push"
unit = "mm"
[[obstacle]]
name = "table"
kind = "disc"
radius = 4
@obstacle.normal@
@obstacle.position@
@obstacle.friction@
[[tool]]
name = "probe"
points = [[0, 0, 0]]
path = [[0, 0, 0, 0]]
)",
                                   {}, {"obstacle"});
  expect_the_defaults<SceneConfig>(ConfigFile::scene, read_scene_config, R"(name = "push"
unit = "mm"
[[blade]]
name = "scalpel"
edge = [[0, 0, 0], [0, 0, 1]]
@blade.position@
[[removal]]
name = "hook"
radius = 4
position = [0, 0, 0]
time = 1
@removal.every@
@removal.contact_time@
[[tool]]
name = "probe"
points = [[0, 0, 0]]
path = [[0, 0, 0, 0]]
)",
                                   {}, {"blade", "removal"});
  expect_the_defaults<SceneConfig>(ConfigFile::scene, read_scene_config, R"(name = "push"
unit = "mm"
[effects]
shape = "volume"
inside = true
[[carried]]
name = "tumour"
file = "tumour.ply"
@carried.unit@
@carried.within@
[[tool]]
name = "probe"
points = [[0, 0, 0]]
path = [[0, 0, 0, 0]]
)",
                                   {}, {"carried"});
  expect_the_defaults<SceneConfig>(ConfigFile::scene, read_scene_config, R"(name = "push"
unit = "mm"
[world]
@world.pairs@
@world.friction@
[[organ]]
name = "liver"
@organ.position@
@organ.turn@
[[tool]]
name = "probe"
points = [[0, 0, 0]]
path = [[0, 0, 0, 0]]
)",
                                   {}, {"organ", "world"});
}

}  // namespace
}  // namespace palpate
