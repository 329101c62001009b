// The organs of a scene.toml of several: [[organ]] and [world].
#pragma once

#include <vector>

#include "formats/scene_config.h"
#include "formats/scene_effects.h"
#include "formats/toml_reader.h"

namespace palpate {

// Fills scene.organs, pairs and organ_friction; scene has what the file says of all organs, named says which effects it names. Returns
// which ones each organ names. Errors: InputError with file, line, key, expected and found.
std::vector<NamedEffects> read_organs(TomlTable& root, SceneConfig& scene, NamedEffects named);

// The indices of the organs that an obstacle names by its key `organs`; all of them without the key; none in a scene of one organ.
std::vector<std::size_t> read_held_off(TomlTable& table, const SceneConfig& scene);

// The index of the organ that a tool, link or motion names by its key `organ`; 0 without the key. on_one: the table is about one organ, so
// that a scene of several organs needs the key.
std::size_t read_organ_of(TomlTable& table, const SceneConfig& scene, bool on_one);

// The organ of each place of a link that names them by its key `organs`; empty without the key.
std::vector<std::size_t> read_organs_of(TomlTable& table, const SceneConfig& scene, std::size_t places);

// Links between organs need what palpate_world.h says.
void check_links_between_organs(const SceneConfig& scene, const TomlTable& root);

// Organs that are held apart must all be linear, and met where they are.
void check_pairs(const SceneConfig& scene, const TomlTable& root);

}  // namespace palpate
