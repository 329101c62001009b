// What cuts and removes tissue in a scene.toml: [[blade]] and [[removal]].
#pragma once

#include "formats/scene_config.h"
#include "formats/scene_effects.h"
#include "formats/toml_reader.h"

namespace palpate {

// Each table is read whole. scene: its unit, its organs, and the blades and removals before this one. Errors: InputError with file, line, key,
// expected and found.
SceneConfig::Blade read_blade(TomlTable table, const SceneConfig& scene);
SceneConfig::Removal read_removal(TomlTable table, const SceneConfig& scene);

// Blades and removals of a scene of one organ select the effect cut, and cut selects the collision that it needs. Refuses what does not fit them.
void check_cuts(SceneConfig& scene, const TomlTable& root, NamedEffects named);

}  // namespace palpate
