#include "programs/player/scene_bundle.h"

#include <fmt/format.h>

#include "formats/errors.h"

namespace palpate {

std::filesystem::path bundle_of(const SceneConfig& scene, const std::filesystem::path& given) {
  if (!given.empty()) return given;
  if (scene.bundle.empty())
    throw InputError(fmt::format("{}: the scene names no bundle; add bundle = \"FILE.h5\" or give --bundle FILE.h5",
                                 scene.file.string()));
  return scene.bundle;
}

}  // namespace palpate
