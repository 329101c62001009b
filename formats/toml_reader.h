// A TOML table, read key by key. Every fault is an InputError: one sentence with file, line, key, expected and found; where the
// key is missing, with a line that would do. The keys are those of formats/config_keys.h: a key in the file that the list lacks is a fault of the file. A key that the
// reader asks for and the list lacks, or the other way round, is a std::logic_error: a fault of our code.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "formats/config_keys.h"

namespace palpate {

class TomlTable {
 public:
  // Reads the top of a file. keys: those that it may have, which stay as long as the table. Errors: InputError where it cannot be read or is not TOML.
  TomlTable(const std::filesystem::path& file, ConfigFile kind, const std::vector<ConfigKey>& keys = config_keys());

  int line() const;
  const std::filesystem::path& file() const;
  // Whether the table has this optional key.
  bool has(std::string_view key);

  // The key's value. Errors: missing, or of another type.
  std::string text(std::string_view key, const char* example);
  // A file, from the folder of this file.
  std::filesystem::path path(std::string_view key, const char* example);
  double number(std::string_view key);  // finite
  std::int64_t integer(std::string_view key);
  bool boolean(std::string_view key);
  std::array<double, 3> vector(std::string_view key);
  std::vector<std::array<double, 3>> points(std::string_view key);
  std::vector<std::string> texts(std::string_view key);
  std::vector<double> numbers(std::string_view key);  // finite

  // Rows of n finite numbers each; expected shows one, "[t, x, y, z]".
  template <std::size_t n>
  std::vector<std::array<double, n>> rows(std::string_view key, const char* expected) {
    std::vector<std::array<double, n>> result;
    for (const std::vector<double>& row : rows_of(key, n, expected)) {
      result.emplace_back();
      for (std::size_t i = 0; i < n; ++i) result.back()[i] = row[i];
    }
    return result;
  }

  // One of a list of words, which must be the list's limits of this key.
  template <class Value>
  Value choice(std::string_view key, const std::vector<std::pair<std::string, Value>>& choices) {
    std::vector<std::string> words;
    for (const auto& [word, value] : choices) words.push_back(word);
    return choices[index_of_choice(key, words)].second;
  }

  // The index of one of the list's words.
  std::size_t choice(std::string_view key);

  TomlTable table(std::string_view key);
  // [[key]]; none where the key is absent.
  std::vector<TomlTable> tables(std::string_view key);
  // A table, or an array of tables, under one key. listed_as: the name of these tables in the list of keys, where it is not key.
  std::vector<TomlTable> one_or_more(std::string_view key, std::string_view listed_as = "");

  // Call when all keys have been asked for. Errors: a key that the list lacks.
  void finish() const;

  // Throws: expected this, found what the key (or the row of it) has.
  [[noreturn]] void wrong(std::string_view key, const std::string& expected) const;
  // The same of a key that another key contradicts: found says what that one has. line: of the part of the key that asks for it; 0: the key's.
  [[noreturn]] void contradicts(std::string_view key, int line, const std::string& expected,
                                const std::string& found) const;
  [[noreturn]] void wrong_row(std::string_view key, std::size_t row, const std::string& expected) const;

 private:
  struct State;  // holds toml++'s tables, which this header does not include
  explicit TomlTable(std::shared_ptr<State> state) : state_(std::move(state)) {}
  std::vector<std::vector<double>> rows_of(std::string_view key, std::size_t n, const char* expected);
  std::size_t index_of_choice(std::string_view key, const std::vector<std::string>& words);

  std::shared_ptr<State> state_;
};

}  // namespace palpate
