// palpate-run: plays a scene without a screen, and writes the forces on the tools and the shapes of the organ.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <map>
#include <memory>

#include "formats/atomic_file.h"
#include "formats/command_line.h"
#include "formats/errors.h"
#include "formats/make_rule.h"
#include "formats/program.h"
#include "programs/player/csv_files.h"
#include "programs/player/explain.h"
#include "programs/player/gltf_file.h"
#include "programs/player/held_csv.h"
#include "programs/player/output_folder.h"
#include "programs/player/realtime.h"
#include "programs/player/record.h"
#include "programs/player/scene_bundle.h"
#include "programs/player/shape_files.h"
#include "programs/player/summary.h"
#include "programs/scene_options.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

struct Options : SceneOptions {
  fs::path record, replay, gltf, render_mesh;
  bool explain = false, realtime = false;
  double seconds = 5;
  std::vector<double> rates = {1000, 4000, 10000};
  unsigned every = 1;
  double render_unit = 1e-3;  // m
  MakeRule rule;
};

fs::path target_of(const Options& options) {
  return options.output.empty() ? fs::path(options.scene.stem()) : options.output;
}

const std::vector<std::string> kResults = {"forces.csv", "contacts.csv",  "links.csv",  "grasps.csv", "needles.csv",
                                           "loads.csv",  "obstacles.csv", "blades.csv", "cut.csv",    "events.csv",
                                           "organs.csv", "pairs.csv",     "shapes",     "shapes.pvd", "summary.json"};

HeldCsvFiles held_files(const fs::path& folder, const CsvStyle& style, const Player& player) {
  return {folder, style, {&player.organ()}};
}
HeldCsvFiles held_files(const fs::path& folder, const CsvStyle& style, const WorldPlayer& player) {
  return {folder, style, player};
}
void add_shape(Summary& summary, const ShapeRecord& shape) {
  summary.add(shape);
}
void add_shape(Summary& summary, const WorldShapeRecord& all) {
  for (std::size_t k = 0; k < all.organs.size(); ++k) summary.add(all.organs[k], k);
}

// Plays a scene of one organ or of several, writes the folder, and tells forces and warnings. also: called
// with each touch and each shape.
template <typename AnyPlayer, typename Also>
void play(AnyPlayer& player, const std::vector<BundleFields>& fields, const Options& options, const Also& also) {
  OutputFolder folder(target_of(options), kResults);
  const CsvStyle style{options.digits, player.scene().csv_metres_per_unit};
  CsvFiles csv(folder.part(), player.scene(), style);
  HeldCsvFiles held = held_files(folder.part(), style, player);
  Summary summary(player);
  auto shapes = player.shape_count() ? std::make_unique<ShapeFiles>(folder.part(), player, fields) : nullptr;
  const std::uint64_t written = (player.shape_count() + options.every - 1) / options.every;
  auto gltf = options.gltf.empty() ? nullptr : std::make_unique<GltfFile>(options.gltf, player, written);
  Progress progress("playing " + player.scene().name, player.touch_count());
  std::uint64_t frame = 0;
  const Timing timing = player.play(
      [&](const auto& touch) {
        csv.write(touch);
        held.write(touch.time);
        summary.add(touch);
        also(touch);
        progress.advance();
      },
      [&](const auto& shape) {
        add_shape(summary, shape);
        also(shape);
        if (frame++ % options.every != 0) return;
        shapes->write(shape);
        if (gltf) gltf->add(shape);
      });
  csv.close();
  held.close();
  if (shapes) shapes->close();
  const std::vector<std::string> warnings = summary.warnings(fields);
  write_text_atomically(folder.part() / "summary.json",
                        summary.text(timing, fields, shapes ? shapes->written() : 0, warnings, options.digits));
  folder.commit();
  for (const std::string& force : summary.forces()) note(force);
  for (const std::string& warning : warnings) warn(warning);
  if (gltf) gltf->write();
}

void play_one(Player& player, const fs::path& bundle, const Options& options) {
  OutputHasher hasher;
  play(player, {read_bundle_fields(bundle)}, options, [&](const auto& played) { hasher.add(played); });
  if (!options.record.empty()) write_record(options.record, player, bundle, hasher.hash());
}

void warn_of_log(const PlayedOrgan& organ) {
  for (const std::string& warning : organ.log().warnings) warn(warning);
}

void play_organs(const SceneConfig& scene, const Options& options) {
  if (options.realtime || !options.record.empty() || !options.render_mesh.empty()) expect_one_organ(scene);
  const std::vector<fs::path> bundles = bundles_of(scene, options.bundles);
  WorldPlayer player(scene, bundles);
  if (options.explain) {
    fmt::print("{}", explain(player));
    for (std::size_t k = 0; k < player.organ_count(); ++k) warn_of_log(player.organ(k));
    return;
  }
  std::vector<BundleFields> fields;
  for (const fs::path& bundle : bundles) fields.push_back(read_bundle_fields(bundle));
  play(player, fields, options, [](const auto&) {});
}

void play_against_the_clock(Player& player, const fs::path& bundle, const Options& options) {
  OutputFolder folder(target_of(options), {"summary.json"});
  std::vector<RealtimeRun> runs;
  for (const double rate : options.rates) {
    runs.push_back(run_realtime(player, rate, options.seconds));
    fmt::print("{}{}", runs.size() > 1 ? "\n" : "", realtime_table(runs.back()));
  }
  write_text_atomically(folder.part() / "summary.json", realtime_summary(runs, player, bundle));
  folder.commit();
  for (const std::string& warning : realtime_warnings(runs, player)) warn(warning);
}

void run(const Options& options) {
  if (!options.replay.empty()) {
    fmt::print("{}", replay(options.replay, options.bundles, options.scene));
    return;
  }
  has_read(options.scene);
  const SceneConfig scene = read_scene_config(options.scene);
  if (!scene.organs.empty()) {
    play_organs(scene, options);
    return;
  }
  const fs::path bundle = bundle_of(scene, options.bundles);
  if (!options.record.empty()) check_target(options.record);
  RenderMesh render_mesh;
  if (!options.render_mesh.empty()) render_mesh = read_render_mesh(options.render_mesh, options.render_unit);
  if (scene.def.dent.dent == PALPATE_DENT_DISCS && options.render_mesh.empty() && !options.realtime)
    throw InputError(
        fmt::format("{}: effects.dent: expected --render-mesh FILE.ply, on which \"discs\" are drawn, found "
                    "none; add the option, or remove the key",
                    options.scene.string()));
  Player player(scene, bundle, Half::both, options.render_mesh.empty() ? nullptr : &render_mesh);
  if (options.explain)
    fmt::print("{}", explain(player)), warn_of_log(player.organ());
  else if (options.realtime)
    play_against_the_clock(player, bundle, options);
  else
    play_one(player, bundle, options);
}

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) {
  palpate::Options options;
  return palpate::run_program(
      argc, argv, "palpate-run", "Plays a scene headless: forces, contacts and deformed shapes out.",
      [&](CLI::App& app) {
        palpate::add_scene_options(app, options, "the scene", "folder to write; default: the scene file's name, here");
        auto* scene = app.get_option("SCENE.toml")->required(false);  // --replay does without
        app.get_option("--bundle")
            ->description(
                "bundle to use instead of the one that the scene names; in a scene of several organs NAME=FILE, once "
                "for each organ");
        palpate::add_digits(app, options);
        auto* output = app.get_option("--output");
        auto* every =
            app.add_option("--every", options.every, "write every Nth shape")->check(CLI::Range(1u, 1000000u));
        auto* explain = app.add_flag("--explain", options.explain,
                                     "print the plan, its predicted and its measured cost; write nothing");
        auto* realtime = app.add_flag("--realtime", options.realtime,
                                      "play the scene over and over against the clock, touch and shape on two threads; "
                                      "writes summary.json alone");
        realtime->excludes(explain);
        auto* record = app.add_option("--record", options.record, "also write the run to this file, to be replayed");
        record->excludes(explain)->excludes(realtime);
        auto* gltf =
            app.add_option("--export", options.gltf,
                           "also write the organ's surface, shape by shape, as an animated binary glTF file (.glb)");
        gltf->excludes(explain)->excludes(realtime);
        auto* render_mesh =
            app.add_option("--render-mesh", options.render_mesh,
                           "a finer surface (.ply) that follows the organ: it is in the shapes' files as "
                           "well, and --export writes it in place of the bundle's own");
        render_mesh->excludes(realtime);
        app.add_option("--render-unit", options.render_unit,
                       "unit of the finer surface; default: mm, as palpate-surface")
            ->needs(render_mesh)
            ->transform(CLI::CheckedTransformer(std::map<std::string, double>{{"m", 1.}, {"cm", 1e-2}, {"mm", 1e-3}}));
        auto* replay = app.add_option("--replay", options.replay,
                                      "play this record and hold it to its hashes; writes nothing. SCENE.toml, where "
                                      "given, must be the scene that was recorded");
        palpate::define_make_rule(app, options.rule);
        for (auto* other : {output, every, record, gltf, render_mesh}) replay->excludes(other);
        replay->excludes(explain)->excludes(realtime);
        app.callback([scene, &options] {
          if (options.replay.empty() && scene->empty()) throw CLI::RequiredError("SCENE.toml");
        });
        app.add_option("--seconds", options.seconds, "how long, per rate")
            ->check(CLI::Range(0.01, 3600.0))
            ->needs(realtime);
        app.add_option("--rate", options.rates, "touches per second; default: 1000, 4000 and 10000 in turn")
            ->check(CLI::Range(1.0, 100000.0))
            ->needs(realtime);
      },
      [&] { palpate::run(options), palpate::write_make_rule(options.rule); });
}
