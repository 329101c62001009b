// The [effects], [relaxation] and [surface] of a scene.toml or of one of its organs, and what fits together.
#pragma once

#include "formats/scene_config.h"
#include "formats/toml_reader.h"

namespace palpate {

// Each table is read whole. A key that is absent leaves its effect as it is. Errors: InputError with file, line, key, expected and found.
void read_effects(TomlTable table, SceneEffects& effects);
void read_relaxation(TomlTable table, SceneEffects& effects);
SceneConfig::Surface read_surface(TomlTable table);
SceneConfig::Carried read_carried(TomlTable table, const SceneConfig& scene);

// Which effects the file names; for the others the scene has a say.
struct NamedEffects {
  bool contact = false, collision = false, cut = false;
  void add(TomlTable effects) {
    contact = contact || effects.has("contact"), collision = collision || effects.has("collision");
    cut = cut || effects.has("cut");
  }
};

// Takes the effects that the tools, links and motions of a scene of one organ select, and refuses those that do not fit them. root: the
// top of the file.
void settle_effects(SceneConfig& scene, const TomlTable& root, NamedEffects named);

}  // namespace palpate
