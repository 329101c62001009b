// palpate-draw: receives contacts from palpate-feel and computes their shapes.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>

#include "formats/atomic_file.h"
#include "formats/command_line.h"
#include "formats/errors.h"
#include "formats/program.h"
#include "programs/link/draw.h"
#include "programs/link/sockets.h"
#include "programs/link/stop_signal.h"
#include "programs/player/bundle_fields.h"
#include "programs/player/output_folder.h"
#include "programs/player/scene_bundle.h"
#include "programs/player/shape_files.h"
#include "programs/scene_options.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

struct Options : SceneOptions {
  std::string from;
  DrawOptions draw;
  unsigned every = 1;
};

void run(const Options& options) {
  const SceneConfig scene = read_scene_config(options.scene);
  if (scene.def.shape == PALPATE_SHAPE_OFF)
    throw InputError(
        fmt::format("{}: effects.shape: expected surface or volume to draw, found off", scene.file.string()));
  check_deformation(scene);
  const fs::path bundle = bundle_of(scene, options.bundles);
  const Descriptor listening = open_bound("--from", resolve("--from", options.from, SOCK_DGRAM), SOCK_DGRAM);
  std::optional<OutputFolder> folder;
  if (!options.output.empty())
    folder.emplace(options.output, std::vector<std::string>{"shapes", "shapes.pvd", "summary.json"});
  Player player(scene, bundle, Half::shape);
  const BundleFields fields = read_bundle_fields(bundle);
  std::optional<ShapeFiles> files;
  if (folder) files.emplace(folder->part(), player, std::vector{fields});
  const std::atomic<bool>& stop = stop_on_signal();  // before the address is printed: who reads it may stop the program
  fmt::print("listening on {}\n", text_of(address_of(listening.get())));
  std::fflush(stdout);

  const DrawRun drawn = draw(
      player, fields.identity, listening.get(), options.draw, &stop,
      [&, frame = 0u](const ShapeRecord& shape) mutable {
        if (files && frame++ % options.every == 0) files->write(shape);
      },
      [](const std::string& line) { warn(line); });
  fmt::print("{}", draw_table(drawn));
  for (const std::string& warning : drawn.flags.warnings("shapes")) warn(warning);
  if (!folder) return;
  files->close();
  write_text_atomically(folder->part() / "summary.json", draw_summary(drawn, player, files->written()));
  folder->commit();
}

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) {
  palpate::Options options;
  return palpate::run_program(
      argc, argv, "palpate-draw", "Takes contacts from palpate-feel and makes deformed shapes of them.",
      [&](CLI::App& app) {
        palpate::add_scene_options(app, options, "the scene that palpate-feel plays",
                                   "folder for shapes.pvd, shapes/ and summary.json");
        app.add_option("--from", options.from, "where to listen: PORT on this machine alone, or ADDRESS:PORT; 0: any")
            ->required();
        app.add_option("--every", options.every, "write every Nth shape")->check(CLI::Range(1u, 1000000u));
        palpate::add_seconds(app, options.draw.seconds, "stop after that long; default: when palpate-feel has stopped");
        app.add_option("--silence", options.draw.silence, "seconds without contacts after which the program says so")
            ->check(CLI::Range(0.01, 1e6));
      },
      [&] { palpate::run(options); });
}
