// The fields of palpate_scene_def and of the structs of effects as keys of a scene file: choices stand in its [effects], numbers in its [limits].
#pragma once

#include <palpate/palpate_scene_def.hpp>

#include "formats/toml_reader.h"

namespace palpate {

// All keys of config_keys(), and those of the fields. Fields that no file names are decided by its tools, links and motions, or no program
// asks for them.
const std::vector<ConfigKey>& scene_keys();

// The word of a choice; name: of its key in [effects].
std::string word_of(const palpate_key& field, const SceneDef& def);
std::string word_of(const char* name, const SceneDef& def);

// What an effect is, as a scene file would say it: law = "sticking".
std::string in_words(const char* name, const SceneDef& def);

// Whether all that a file sets is equal, but for the terms of a relaxation.
bool have_equal_fields(const SceneDef& a, const SceneDef& b);

// The defaults of a scene file. 0 points and 0 contact nodes: as many as the scene's tools need.
SceneDef default_of_scene_file();

// Reads the keys of fields that a table has. A key that is absent leaves its field as it is. name: "effects" or "limits".
void read_fields(TomlTable& table, const std::string& name, SceneDef& def);

}  // namespace palpate
