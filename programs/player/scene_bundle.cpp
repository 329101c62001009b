#include "programs/player/scene_bundle.h"

#include <fmt/format.h>

#include "formats/errors.h"

namespace palpate {

void expect_one_organ(const SceneConfig& scene) {
  if (scene.organs.empty()) return;
  throw InputError(
      fmt::format("{}:{}: [[organ]]: expected a scene of one organ here, found one with [[organ]] tables; "
                  "palpate-run plays it, without --realtime, --record and --render-mesh",
                  scene.file.string(), scene.organs[0].line));
}

std::filesystem::path bundle_of(const SceneConfig& scene, const std::vector<std::string>& given) {
  expect_one_organ(scene);
  if (given.size() > 1)
    throw InputError(fmt::format("--bundle: expected one bundle for the scene {}, found {}; give one",
                                 scene.file.string(), given.size()));
  if (!given.empty()) return given[0];
  if (scene.bundle.empty())
    throw InputError(fmt::format("{}: the scene names no bundle; add bundle = \"FILE.h5\" or give --bundle FILE.h5",
                                 scene.file.string()));
  return scene.bundle;
}

std::vector<std::filesystem::path> bundles_of(const SceneConfig& scene, const std::vector<std::string>& given) {
  std::vector<std::filesystem::path> bundles;
  std::string names;
  for (const SceneConfig::Organ& organ : scene.organs) {
    bundles.push_back(organ.bundle);
    names += fmt::format("{}\"{}\"", names.empty() ? "" : ", ", organ.name);
  }
  for (const std::string& one : given) {
    const std::size_t equals = one.find('=');
    std::size_t k = 0;
    while (k < bundles.size() && scene.organs[k].name != one.substr(0, equals)) ++k;
    if (equals == std::string::npos || k == bundles.size())
      throw InputError(fmt::format("--bundle {}: expected NAME=FILE with an organ of {} ({}), found another name", one,
                                   scene.file.string(), names));
    bundles[k] = one.substr(equals + 1);
  }
  for (std::size_t k = 0; k < bundles.size(); ++k)
    if (bundles[k].empty())
      throw InputError(
          fmt::format("{}:{}: organ \"{}\" names no bundle; add bundle = \"FILE.h5\" or give --bundle {}=FILE.h5",
                      scene.file.string(), scene.organs[k].line, scene.organs[k].name, scene.organs[k].name));
  return bundles;
}

}  // namespace palpate
