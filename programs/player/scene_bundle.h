// Decides on which bundles a scene is played.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "formats/scene_config.h"

namespace palpate {

// Errors: InputError for a scene of several organs.
void expect_one_organ(const SceneConfig& scene);

// given: of --bundle. The only one of them, else the bundle that the scene names. Errors: InputError without either, for more than one,
// and for a scene of several organs.
std::filesystem::path bundle_of(const SceneConfig& scene, const std::vector<std::string>& given);

// [organ] of a scene of several organs: that of NAME=FILE in given, else the one that the organ names. Errors: InputError for an organ
// without either, and for a name that no organ has.
std::vector<std::filesystem::path> bundles_of(const SceneConfig& scene, const std::vector<std::string>& given);

}  // namespace palpate
