// What the programs that play a scene (palpate-run, -feel, -draw, -igtl) have on their command lines in common.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <vector>

namespace palpate {

struct SceneOptions {
  std::filesystem::path scene, output;
  std::vector<std::string> bundles;
};

// Adds SCENE.toml, --bundle and, where output says what it is, -o.
inline void add_scene_options(CLI::App& app, SceneOptions& options, const std::string& scene,
                              const std::string& output = {}) {
  app.add_option("SCENE.toml", options.scene, scene)->required();
  app.add_option("--bundle", options.bundles, "bundle to use instead of the one that the scene names")
      ->allow_extra_args(false);
  if (!output.empty()) app.add_option("-o,--output", options.output, output);
}

// --seconds.
inline CLI::Option* add_seconds(CLI::App& app, double& seconds, const std::string& meaning) {
  return app.add_option("--seconds", seconds, meaning)->check(CLI::Range(0.01, 1e6));
}

}  // namespace palpate
