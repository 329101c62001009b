#include "formats/toml_reader.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <set>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "formats/errors.h"
#include "formats/make_rule.h"

namespace palpate {
namespace {

int line_of(const toml::node& node) {
  return static_cast<int>(node.source().begin.line);
}

// Of the key, where the table has it. A table that only its sub-tables' headings name has line 0 itself.
int line_of(const toml::table& table, std::string_view key) {
  const auto at = table.find(key);
  const auto line = at == table.end() ? table.source().begin.line : at->first.source().begin.line;
  return static_cast<int>(std::max<toml::source_index>(line, 1));
}

// What a sentence says of a value: { value = 5, unit = "kPa" } as 5 kPa, and of other tables only what they are.
std::string shown(const toml::node& node) {
  if (const toml::table* table = node.as_table()) {
    const auto value = (*table)["value"], unit = (*table)["unit"];
    if (!value.is_number()) return "a table";
    return shown(*value.node()) + (unit.is_string() ? " " + unit.as_string()->get() : "");
  }
  const toml::array* array = node.as_array();
  if (array && std::any_of(array->begin(), array->end(), [](const toml::node& item) { return item.is_table(); }))
    return "an array of tables";
  std::string text;
  if (const auto* words = node.as_string())
    text = '"' + words->get() + '"';
  else
    node.visit([&text](const auto& value) {
      std::ostringstream out;
      if constexpr (toml::is_array<decltype(value)>)
        out << value;
      else
        out << toml::node_view<const toml::node>(value);
      text = out.str();
    });
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text.size() > 60 ? text.substr(0, 57) + "..." : text;
}

toml::table parse_toml(const std::filesystem::path& file) {
  if (!std::filesystem::is_regular_file(file))
    throw InputError(fmt::format("{}: expected a TOML file, found {}", file.string(),
                                 std::filesystem::exists(file) ? "something that is not a file" : "no such file"));
  try {
    return toml::parse_file(file.string());
  } catch (const toml::parse_error& error) {
    throw InputError(
        fmt::format("{}:{}: not valid TOML: {}", file.string(), error.source().begin.line, error.description()));
  }
}

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

// Changes of one letter that turn one word into the other.
std::size_t letters_apart(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t above = row[j];
      row[j] = std::min({above + 1, row[j - 1] + 1, diagonal + (a[i - 1] == b[j - 1] ? 0 : 1)});
      diagonal = above;
    }
  }
  return row[b.size()];
}

// The end of a sentence with the word that was probably meant; empty where none is near.
std::string did_you_mean(std::string_view found, const std::vector<std::string>& words) {
  const auto apart = [&](const std::string& word) { return letters_apart(found, word); };
  const auto nearest = std::ranges::min_element(words, {}, apart);
  if (nearest == words.end() || apart(*nearest) > std::max<std::size_t>(1, found.size() / 3)) return "";
  return fmt::format("; did you mean \"{}\"?", *nearest);
}

}  // namespace

struct TomlTable::State {
  std::shared_ptr<const toml::table> document;  // keeps the nodes alive
  const toml::table* table;
  std::filesystem::path file;
  ConfigFile kind;
  const std::vector<ConfigKey>* keys;
  std::string name;      // of the table in the list of keys: "region"
  std::string headline;  // of the table in sentences: "", "response", "[[region]] 2"
  std::set<std::string, std::less<>> asked;

  std::shared_ptr<State> inner(const toml::table& node, std::string_view key, std::string head) const {
    return std::make_shared<State>(State{document, &node, file, kind, keys, std::string(key), std::move(head), {}});
  }

  std::string heading() const { return headline.empty() ? "" : headline + ": "; }

  [[noreturn]] void fail(int at, std::string_view key, const std::string& expected, const std::string& found) const {
    throw InputError(
        fmt::format("{}:{}: {}{}: expected {}, found {}", file.string(), at, heading(), key, expected, found));
  }

  [[noreturn]] void wrong(std::string_view key, const std::string& expected, const std::string& end = "") const {
    const auto* value = table->get(key);
    const auto* array = value ? value->as_array() : nullptr;
    const bool tables = array && !array->empty() && array->is_array_of_tables();
    fail(line_of(*table, key), key, expected,
         tables ? fmt::format("[[{}]]", key) : (value ? shown(*value) : "nothing") + end);
  }

  const ConfigKey& listed(std::string_view key) const {
    if (const ConfigKey* line = find_config_key(*keys, kind, name, key)) return *line;
    throw std::logic_error(fmt::format("formats/config_keys.cpp has no key \"{}\" in table \"{}\"", key, name));
  }

  const toml::node* ask(std::string_view key) {
    asked.insert(listed(key).key);
    return table->get(key);
  }

  const toml::node& need(std::string_view key) { return need(key, example_line(listed(key))); }

  const toml::node& need(std::string_view key, const std::string& example) {
    const auto* value = ask(key);
    if (!value)
      throw InputError(fmt::format("{}:{}: {}the key \"{}\" is missing; add it, for example: {}", file.string(),
                                   line_of(*table, key), heading(), key, example));
    return *value;
  }

  std::string text(std::string_view key, const std::string& example) {
    const auto* value = need(key, example).as_string();
    if (!value) wrong(key, "a text in quotes, for example " + example);
    if (value->get().empty()) wrong(key, "a text that is not empty");
    return value->get();
  }

  const toml::array& array(std::string_view key, const std::string& expected) {
    const auto* value = need(key).as_array();
    if (!value || value->empty()) wrong(key, expected + ", not empty");
    return *value;
  }

  // node: the key's value, or a part of it, which may stand some lines further down.
  double finite(const toml::node& node, std::string_view key) const {
    const auto value = node.is_string() ? std::optional<double>() : node.value<double>();
    if (!value || !std::isfinite(*value)) fail(line_of(node), key, "a finite number", shown(node));
    return *value;
  }

  std::array<double, 3> three(const toml::node& node, std::string_view key) const {
    const auto* value = node.as_array();
    if (!value || value->size() != 3) fail(line_of(node), key, "three numbers [x, y, z]", shown(node));
    return {finite((*value)[0], key), finite((*value)[1], key), finite((*value)[2], key)};
  }
};

TomlTable::TomlTable(const std::filesystem::path& file, ConfigFile kind, const std::vector<ConfigKey>& keys) {
  const auto document = std::make_shared<const toml::table>(parse_toml(file));
  state_ = std::make_shared<State>(State{document, document.get(), file, kind, &keys, "", "", {}});
}

int TomlTable::line() const {
  return line_of(*state_->table);
}

const std::filesystem::path& TomlTable::file() const {
  return state_->file;
}

bool TomlTable::has(std::string_view key) {
  return state_->ask(key) != nullptr;
}

std::string TomlTable::text(std::string_view key, const char* example) {
  return state_->text(key, fmt::format("{} = {}", key, example));
}

std::filesystem::path TomlTable::path(std::string_view key, const char* example) {
  const std::filesystem::path named = state_->file.parent_path() / text(key, example);
  // The precompute says itself what it has read: it also looks into other organs' files, which are no part of a bundle.
  if (state_->kind == ConfigFile::scene) has_read(named);
  return named;
}

double TomlTable::number(std::string_view key) {
  return state_->finite(state_->need(key), key);
}

std::int64_t TomlTable::integer(std::string_view key) {
  const auto* value = state_->need(key).as_integer();
  if (!value) wrong(key, "an integer");
  return value->get();
}

bool TomlTable::boolean(std::string_view key) {
  const auto* value = state_->need(key).as_boolean();
  if (!value) wrong(key, "true or false");
  return value->get();
}

std::array<double, 3> TomlTable::vector(std::string_view key) {
  return state_->three(state_->need(key), key);
}

std::vector<std::array<double, 3>> TomlTable::points(std::string_view key) {
  std::vector<std::array<double, 3>> result;
  for (const auto& item : state_->array(key, "[[x, y, z], ...]")) result.push_back(state_->three(item, key));
  return result;
}

std::vector<std::string> TomlTable::texts(std::string_view key) {
  std::vector<std::string> result;
  for (const auto& item : state_->array(key, "an array of strings")) {
    if (!item.is_string()) wrong(key, "an array of strings");
    result.push_back(item.as_string()->get());
  }
  return result;
}

std::vector<double> TomlTable::numbers(std::string_view key) {
  std::vector<double> result;
  for (const auto& item : state_->array(key, "an array of numbers")) result.push_back(state_->finite(item, key));
  return result;
}

std::vector<std::vector<double>> TomlTable::rows_of(std::string_view key, std::size_t n, const char* expected) {
  std::vector<std::vector<double>> result;
  for (const auto& item : state_->array(key, fmt::format("rows of {}", expected))) {
    const auto* row = item.as_array();
    if (!row || row->size() != n) wrong_row(key, result.size(), expected);
    result.emplace_back();
    for (const auto& number : *row) result.back().push_back(state_->finite(number, key));
  }
  return result;
}

std::size_t TomlTable::index_of_choice(std::string_view key, const std::vector<std::string>& words) {
  const std::string list = joined(words);
  if (list != state_->listed(key).limits)
    throw std::logic_error(fmt::format("formats/config_keys.cpp: the words of \"{}\" are {}", key, list));
  const std::string found = state_->text(key, example_line(state_->listed(key)));
  const auto at = std::find(words.begin(), words.end(), found);
  if (at == words.end()) state_->wrong(key, "one of " + list, did_you_mean(found, words));
  return static_cast<std::size_t>(at - words.begin());
}

std::size_t TomlTable::choice(std::string_view key) {
  std::vector<std::string> words;
  std::istringstream list(state_->listed(key).limits);
  for (std::string word; std::getline(list >> std::ws, word, ',');) words.push_back(word);
  return index_of_choice(key, words);
}

TomlTable TomlTable::table(std::string_view key) {
  const auto* value = state_->need(key).as_table();
  if (!value) {
    const std::string example = example_line(state_->listed(key));
    wrong(key, example[0] == '[' ? "a table, headed " + example : "a table, for example " + example);
  }
  const std::string& outer = state_->headline;
  return TomlTable(state_->inner(*value, key, outer.empty() ? std::string(key) : outer + "." + std::string(key)));
}

std::vector<TomlTable> TomlTable::tables(std::string_view key) {
  std::vector<TomlTable> result;
  if (!has(key)) return result;
  const std::string expected = fmt::format("tables, each headed [[{}]]", key);
  for (const auto& item : state_->array(key, expected)) {
    if (!item.is_table()) wrong(key, expected);
    result.push_back(TomlTable(state_->inner(*item.as_table(), key, fmt::format("[[{}]] {}", key, result.size() + 1))));
  }
  return result;
}

std::vector<TomlTable> TomlTable::one_or_more(std::string_view key, std::string_view listed_as) {
  std::vector<TomlTable> result;
  const auto add = [&](const toml::node& item) {
    if (!item.is_table()) wrong(key, "a table or an array of tables");
    const std::string& outer = state_->headline;
    result.push_back(TomlTable(state_->inner(*item.as_table(), listed_as.empty() ? key : listed_as,
                                             (outer.empty() ? "" : outer + ".") + std::string(key))));
  };
  if (has(key) && state_->table->get(key)->is_table())
    add(*state_->table->get(key));
  else
    for (const auto& item : state_->array(key, "a table or an array of tables")) add(item);
  return result;
}

void TomlTable::finish() const {
  std::vector<std::string> known;
  for (const ConfigKey& line : *state_->keys)
    if (line.file == state_->kind && line.table == state_->name) known.push_back(line.key);
  for (const auto& [key, ignored] : *state_->table)
    if (std::find(known.begin(), known.end(), key.str()) == known.end())
      throw InputError(fmt::format("{}:{}: {}unknown key \"{}\"; the keys here are {}{}", state_->file.string(),
                                   key.source().begin.line, state_->heading(), key.str(), joined(known),
                                   did_you_mean(key.str(), known)));
  for (const std::string& key : known)
    if (!state_->asked.count(key))
      throw std::logic_error(fmt::format(
          "formats/config_keys.cpp has the key \"{}\" in table \"{}\", which no reader asks for", key, state_->name));
}

void TomlTable::wrong(std::string_view key, const std::string& expected) const {
  state_->wrong(key, expected);
}

void TomlTable::contradicts(std::string_view key, int line, const std::string& expected,
                            const std::string& found) const {
  state_->fail(line > 0 ? line : line_of(*state_->table, key), key, expected, found);
}

void TomlTable::wrong_row(std::string_view key, std::size_t row, const std::string& expected) const {
  const auto& item = (*state_->table->get(key)->as_array())[row];
  state_->fail(line_of(item), fmt::format("{}[{}]", key, row), expected, shown(item));
}

}  // namespace palpate
