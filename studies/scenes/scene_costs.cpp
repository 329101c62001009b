// scene_costs MESH --organ organ.toml --boundary bc.toml -o FOLDER: what scenes of several organs and effects take, and what each effect is
// off against a full solve; make -f Makefile.data scene-costs.
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "formats/command_line.h"
#include "formats/program.h"
#include "studies/accuracy/command.h"
#include "studies/accuracy/results.h"
#include "studies/scenes/costs.h"
#include "studies/scenes/errors.h"
#include "studies/timing/timing.h"

namespace palpate::scenes {
namespace {

using Json = nlohmann::ordered_json;

void define(CLI::App& app, ScenesOptions& options) {
  app.add_option("mesh", options.mesh, "the organ's tetrahedra")->option_text("MESH.msh REQUIRED")->required();
  app.add_option("--organ", options.organ, "its organ.toml")->option_text("FILE REQUIRED")->required();
  app.add_option("--boundary", options.boundary, "its boundary set")->option_text("FILE REQUIRED")->required();
  app.add_option("-o,--output", options.output, "the study's folder")->option_text("FOLDER REQUIRED")->required();
  app.add_option("--image", options.image, "the image of the mesh, where the boundary set reads it")
      ->option_text("FILE");
  app.add_option("--python", options.python, "a Python with matplotlib, for the report")->capture_default_str();
  app.add_option("--steps", options.steps, "timed touches of each world")
      ->check(CLI::Range(10, 1000000))
      ->capture_default_str();
  app.add_flag("--quick", options.quick, "the smallest numbers of organs, pairs, modes ... alone");
}

void run(ScenesOptions options) {
  if (options.quick) options.organs = 2, options.modes = 1;
  const auto begun = studies::Clock::now();
  const BakedOrgan baked(options);
  Json all = {{"program", "scene_costs"},
              {"program_version", PALPATE_VERSION},
              {"mesh", options.mesh.string()},
              {"boundary", options.boundary.string()},
              {"vertices", baked.body().surface_count},
              {"nodes", baked.body().nodes.size()},
              {"steps", options.steps},
              {"machine", accuracy::machine_json()}};
  all["errors"] = measure_errors(baked, options);
  const std::vector<Json> costs = measure_costs(baked, options);
  all["took_s"] = studies::seconds_since(begun);
  accuracy::write_results(options.output, "scene-costs", all, costs);
  note(accuracy::write_report(options.python, options.source, "scenes", options.output, "scene-costs").string() +
       ": the report");
}

}  // namespace
}  // namespace palpate::scenes

int main(int argc, char** argv) {
  using namespace palpate;
  scenes::ScenesOptions options;
  options.source = PALPATE_SOURCE_FOLDER, options.python = "/usr/bin/python3";
  options.bin = std::filesystem::read_symlink("/proc/self/exe").parent_path();
  return run_program(
      argc, argv, "scene_costs", "Measures what scenes of several organs and effects take, on your own organ.",
      [&](CLI::App& app) { scenes::define(app, options); }, [&] { scenes::run(options); });
}
