// A TOML table read key by key: every fault is one InputError sentence with file, line and key, and a key that nobody
// asked for is a fault too. Used by the readers of organ.toml, boundary/*.toml and
// scene.toml.
#pragma once

#include <fmt/format.h>

#include <toml++/toml.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "formats/errors.h"

namespace palpate {

class TomlTable {
 public:
  // place names the table in sentences: "", "[response]", "[[region]] 2".
  TomlTable(std::filesystem::path file, const toml::table& table, std::string place)
      : file_(std::move(file)), table_(&table), place_(std::move(place)) {}

  int line() const { return line_of(*table_); }
  const std::filesystem::path& file() const { return file_; }
  bool has(std::string_view key) const { return table_->contains(key); }

  std::string text(std::string_view key, const char* example) {
    const auto* value = need(key, example).as_string();
    if (!value) wrong(key, fmt::format("a string such as {}", example));
    if (value->get().empty()) wrong(key, "a string that is not empty");
    return value->get();
  }

  double number(std::string_view key) { return finite(need(key, "a number"), key); }

  std::int64_t integer(std::string_view key) {
    const auto* value = need(key, "an integer").as_integer();
    if (!value) wrong(key, "an integer");
    return value->get();
  }

  bool boolean(std::string_view key) {
    const auto* value = need(key, "true or false").as_boolean();
    if (!value) wrong(key, "true or false");
    return value->get();
  }

  std::array<double, 3> vector(std::string_view key) { return three(need(key, "[x, y, z]"), key); }

  std::vector<std::array<double, 3>> points(std::string_view key) {
    std::vector<std::array<double, 3>> result;
    for (const auto& item : array(key, "[[x, y, z], ...]")) result.push_back(three(item, key));
    return result;
  }

  // Rows of n finite numbers each; expected shows one, "[t, x, y, z]". wrong_row names a row later on.
  template <std::size_t n>
  std::vector<std::array<double, n>> rows(std::string_view key, const char* expected) {
    std::vector<std::array<double, n>> result;
    for (const auto& item : array(key, fmt::format("rows of {}", expected).c_str())) {
      const auto* row = item.as_array();
      if (!row || row->size() != n) wrong_row(key, result.size(), expected);
      result.emplace_back();
      for (std::size_t i = 0; i < n; ++i) result.back()[i] = finite((*row)[i], key);
    }
    return result;
  }

  [[noreturn]] void wrong_row(std::string_view key, std::size_t row, const std::string& expected) const {
    const auto& item = (*table_->get(key)->as_array())[row];
    fail(line_of(item), fmt::format("{}[{}]", key, row), expected, shown(item));
  }

  std::vector<std::string> texts(std::string_view key) {
    std::vector<std::string> result;
    for (const auto& item : array(key, "an array of strings")) {
      if (!item.is_string()) wrong(key, "an array of strings");
      result.push_back(item.as_string()->get());
    }
    return result;
  }

  TomlTable table(std::string_view key) {
    const auto* value = need(key, "a table").as_table();
    if (!value) wrong(key, "a table");
    return {file_, *value, place_.empty() ? std::string(key) : place_ + "." + std::string(key)};
  }

  // [[key]]: none, or an array of tables.
  std::vector<TomlTable> tables(std::string_view key) {
    std::vector<TomlTable> result;
    if (!has(key)) return result;
    for (const auto& item : array(key, "an array of tables")) {
      if (!item.is_table()) wrong(key, fmt::format("tables, each headed [[{}]]", key));
      result.push_back({file_, *item.as_table(), fmt::format("[[{}]] {}", key, result.size() + 1)});
    }
    return result;
  }

  // A table, or an array of tables, under one key.
  std::vector<TomlTable> one_or_more(std::string_view key) {
    if (has(key) && table_->get(key)->is_table()) return {table(key)};
    std::vector<TomlTable> result;
    for (const auto& item : array(key, "a table or an array of tables")) {
      if (!item.is_table()) wrong(key, "a table or an array of tables");
      result.push_back({file_, *item.as_table(), place_ + "." + std::string(key)});
    }
    return result;
  }

  // One of a list of words.
  template <class Value>
  Value choice(std::string_view key, const std::vector<std::pair<std::string, Value>>& choices) {
    std::string list;
    for (const auto& [name, value] : choices) list += (list.empty() ? "" : ", ") + name;
    const std::string found = text(key, choices.front().first.c_str());
    for (const auto& [name, value] : choices)
      if (name == found) return value;
    fail(line_of(*table_->get(key)), key, "one of " + list, '"' + found + '"');
  }

  // Call when all keys have been asked for.
  void finish() const {
    std::string known;
    for (const auto& key : asked_) known += (known.empty() ? "" : ", ") + key;
    for (const auto& [key, value] : *table_)
      if (!asked_.count(std::string(key.str())))
        throw InputError(fmt::format("{}:{}: {}unknown key \"{}\"; the keys here are {}", file_.string(),
                                     line_of(value), heading(), std::string_view(key.str()), known));
  }

  // An optional key that is absent still belongs to the table.
  bool asked_and_present(std::string_view key) {
    asked_.insert(std::string(key));
    return has(key);
  }

  [[noreturn]] void wrong(std::string_view key, const std::string& expected) const {
    const auto* value = table_->get(key);
    fail(value ? line_of(*value) : line(), key, expected, value ? shown(*value) : "nothing");
  }

 private:
  static int line_of(const toml::node& node) { return static_cast<int>(node.source().begin.line); }

  std::string heading() const { return place_.empty() ? "" : place_ + ": "; }

  static std::string shown(const toml::node& node) {
    std::string text;
    node.visit([&text](const auto& value) {
      std::ostringstream out;
      if constexpr (toml::is_table<decltype(value)> || toml::is_array<decltype(value)>)
        out << value;
      else
        out << toml::node_view<const toml::node>(value);
      text = out.str();
    });
    std::replace(text.begin(), text.end(), '\n', ' ');
    return text.size() > 60 ? text.substr(0, 57) + "..." : text;
  }

  [[noreturn]] void fail(int at, std::string_view key, const std::string& expected, const std::string& found) const {
    throw InputError(
        fmt::format("{}:{}: {}{}: expected {}, found {}", file_.string(), at, heading(), key, expected, found));
  }

  const toml::node& need(std::string_view key, std::string_view expected) {
    asked_.insert(std::string(key));
    const auto* value = table_->get(key);
    if (!value)
      throw InputError(fmt::format("{}:{}: {}the key \"{}\" is missing; expected {}", file_.string(), line(), heading(),
                                   key, expected));
    return *value;
  }

  const toml::array& array(std::string_view key, const char* expected) {
    const auto* value = need(key, expected).as_array();
    if (!value || value->empty()) wrong(key, std::string(expected) + ", not empty");
    return *value;
  }

  double finite(const toml::node& node, std::string_view key) const {
    const auto value = node.is_string() ? std::optional<double>() : node.value<double>();
    if (!value || !std::isfinite(*value)) wrong(key, "a finite number");
    return *value;
  }

  std::array<double, 3> three(const toml::node& node, std::string_view key) const {
    const auto* value = node.as_array();
    if (!value || value->size() != 3) wrong(key, "three numbers [x, y, z]");
    return {finite((*value)[0], key), finite((*value)[1], key), finite((*value)[2], key)};
  }

  std::filesystem::path file_;
  const toml::table* table_;
  std::string place_;
  std::set<std::string> asked_;
};

// Parses a file. Errors: InputError with the line.
inline toml::table parse_toml(const std::filesystem::path& file) {
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

}  // namespace palpate
