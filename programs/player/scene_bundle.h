// Which bundle a scene is played on.
#pragma once

#include <filesystem>

#include "formats/scene_config.h"

namespace palpate {

// `given` (of --bundle) where it is not empty, else the one the scene names. Errors: InputError where neither is there.
std::filesystem::path bundle_of(const SceneConfig& scene, const std::filesystem::path& given);

}  // namespace palpate
