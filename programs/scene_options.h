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
  int digits = 9;
};

// Adds SCENE.toml, --bundle and, where output says what it is, -o.
inline void add_scene_options(CLI::App& app, SceneOptions& options, const std::string& scene,
                              const std::string& output = {}) {
  app.add_option("SCENE.toml", options.scene, scene)->required();
  app.add_option("--bundle", options.bundles, "bundle to use instead of the one that the scene names")
      ->allow_extra_args(false);
  if (!output.empty()) app.add_option("-o,--output", options.output, output);
}

// --digits.
inline void add_digits(CLI::App& app, SceneOptions& options) {
  app.add_option("--digits", options.digits,
                 "significant digits of the numbers in the CSV files and in summary.json; 17: all that a double has")
      ->check(CLI::Range(1, 17))
      ->capture_default_str();
}

// --seconds.
inline CLI::Option* add_seconds(CLI::App& app, double& seconds, const std::string& meaning) {
  return app.add_option("--seconds", seconds, meaning)->check(CLI::Range(0.01, 1e6));
}

}  // namespace palpate
