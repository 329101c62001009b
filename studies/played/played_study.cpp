// played_study SCENE.toml --bundle FILE -o FOLDER: plays a scene under large deformation and compares each of its shapes with the converged
// solution of the same targets; make -f Makefile.data abdomen-study.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <fstream>

#include "formats/command_line.h"
#include "formats/errors.h"
#include "formats/program.h"
#include "formats/scene_config.h"
#include "programs/player/scene_bundle.h"
#include "programs/player/summary.h"
#include "studies/accuracy/command.h"
#include "studies/accuracy/results.h"
#include "studies/played/compared.h"
#include "studies/timing/timing.h"

namespace palpate::played {
namespace {

using Json = nlohmann::ordered_json;

struct Options {
  std::filesystem::path scene, output, source = PALPATE_SOURCE_FOLDER;
  std::vector<std::string> bundles;
  std::string python = "/usr/bin/python3";
  std::uint64_t every = 1;
};

void define(CLI::App& app, Options& options) {
  app.add_option("scene", options.scene, "the scene, with deformation = \"large\" and shape = \"volume\"")
      ->required()
      ->check(CLI::ExistingFile);
  app.add_option("--bundle", options.bundles, "in place of the scene's bundle")->expected(1);
  app.add_option("-o,--output", options.output, "folder of the report")->required();
  app.add_option("--every", options.every, "compares each N-th shape; all touches are played")
      ->check(CLI::Range(1, 1'000'000))
      ->option_text("N")
      ->capture_default_str();
  app.add_option("--python", options.python, "that writes the report")->capture_default_str();
}

Json point_of(const SceneConfig& scene, const Compared& state) {
  Json point = {{"time_s", state.time},          {"field", state.field},       {"moved_mm", 1e3 * state.moved},
                {"worst_mm", 1e3 * state.worst}, {"residual", state.residual}, {"least_volume", state.least_volume}};
  if (!scene.blades.empty() || !scene.removals.empty())
    point["split_nodes"] = state.split_nodes, point["removed_tetrahedra"] = state.removed;
  for (std::size_t t = 0; t < state.forces.size(); ++t) {
    point[scene.tools[t].name + "_N"] = state.forces[t].force;
    point[scene.tools[t].name + "_missed_N"] = state.forces[t].missed;
  }
  point["flags"] = fmt::format("{}", fmt::join(flag_names(state.flags), " "));
  point["unsolved"] = state.unsolved;
  return point;
}

Json times_of(const std::vector<double>& us) {
  return {{"median_us", studies::percentile(us, 0.5)},
          {"most_us", studies::percentile(us, 0.999)},
          {"worst_us", studies::percentile(us, 1)},
          {"calls", us.size()}};
}

void run_study(const Options& options) {
  const SceneConfig scene = read_scene_config(options.scene);
  const auto bundle = bundle_of(scene, options.bundles);
  Player player(scene, bundle);
  Comparison comparison(player, bundle);
  std::filesystem::create_directories(options.output / "logs");
  std::vector<Json> points;
  FlagCounts touches;
  std::uint64_t flagged = 0, shapes = 0;
  Progress progress("states", player.shape_count());
  const Timing timing = player.play(
      [&](const TouchRecord& touch) {
        touches.add(touch.flags);
        flagged += touch.flags != 0;
      },
      [&](const ShapeRecord& shape) {
        if (shapes++ % options.every == 0) points.push_back(point_of(scene, comparison.compare(shape)));
        progress.advance();
      });
  Json counts = Json::object();
  for (std::size_t bit = 0; bit < touches.steps_with().size(); ++bit)
    if (touches.steps_with()[bit] > 0)
      counts[flag_names(palpate_step_flags{1} << bit).front()] = touches.steps_with()[bit];
  std::vector<std::string> tools;
  for (const auto& tool : scene.tools) tools.push_back(tool.name);
  const palpate_bundle_info info = palpate_bundle_describe(player.bundle());
  const Json study = {{"program", "played_study"},
                      {"program_version", PALPATE_VERSION},
                      {"scene", scene.name},
                      {"vertices", info.node_count},
                      {"surface_vertices", info.surface_node_count},
                      {"tetrahedra", info.tetrahedron_count},
                      {"duration_s", player.duration()},
                      {"touch_hz", scene.touch_hz},
                      {"tools", tools},
                      {"flagged_touches", flagged},
                      {"touches_with_flag", counts},
                      {"touch", times_of(timing.touch_us)},
                      {"shape", times_of(timing.shape_us)},
                      {"machine", accuracy::machine_json()}};
  accuracy::write_results(options.output, "played", study, points);
  note(accuracy::write_report(options.python, options.source, "played", options.output, "played").string() +
       ": the report");
}

int run(int argc, char** argv) {
  Options options;
  return run_program(
      argc, argv, "played_study",
      "Plays a scene under large deformation and compares each shape with the converged solution of the same targets.",
      [&](CLI::App& app) { define(app, options); }, [&] { run_study(options); });
}

}  // namespace
}  // namespace palpate::played

int main(int argc, char** argv) {
  return palpate::played::run(argc, argv);
}
