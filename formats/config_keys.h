// The one list of keys of organ.toml, boundary/NAME.toml and scene.toml. The readers accept these keys and no others; the
// tables of docs/files.md are printed from the list, but for what each key means, which stands there alone.
#pragma once

#include <string>
#include <string_view>
#include <vector>

struct palpate_key;

namespace palpate {

enum class ConfigFile { organ, boundary, scene };

// All texts are Markdown for docs/files.md.
struct ConfigKey {
  ConfigFile file;
  const char* table;  // the table's own name, "region" for [[region]]; "" for the top of the file
  const char* key;
  const char* type;
  const char* unit;      // "-" for what has none
  const char* standard;  // the value where the key is absent: TOML text; "required"; or "-": the effect is off
  const char* limits;    // of a choice: "a, b, c", the words that the reader accepts
  const palpate_key* field = nullptr;  // of the scene's definition that the key sets
};

const std::vector<ConfigKey>& config_keys();

// A line of TOML that the reader accepts, with the unit of a bare number behind it as a comment: radius = 4  # in `unit`. Of a
// table that has a heading of its own, the heading: [limits].
std::string example_line(const ConfigKey& key);

// The list's line, or nullptr.
const ConfigKey* find_config_key(const std::vector<ConfigKey>& keys, ConfigFile file, std::string_view table,
                                 std::string_view key);

}  // namespace palpate
