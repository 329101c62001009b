// Decides on which bundle a scene is played.
#pragma once

#include <filesystem>

#include "formats/scene_config.h"

namespace palpate {

// `given` (from --bundle) where it is not empty, else the bundle that the scene names. Errors: InputError without either.
std::filesystem::path bundle_of(const SceneConfig& scene, const std::filesystem::path& given);

}  // namespace palpate
