// palpate-feel: plays the touch half of a scene and sends the contacts to palpate-draw.

#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "formats/atomic_file.h"
#include "formats/command_line.h"
#include "formats/program.h"
#include "programs/link/feel.h"
#include "programs/link/stop_signal.h"
#include "programs/player/bundle_fields.h"
#include "programs/player/csv_files.h"
#include "programs/player/output_folder.h"
#include "programs/player/scene_bundle.h"
#include "programs/scene_options.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

struct Options : SceneOptions {
  std::string to;
  FeelOptions feel;
  bool every_step = false, prefault = false;
};

// Writes the sent contacts as palpate-run writes them.
void write_csv(const FeelRun& run, const Player& player, std::uint64_t bundle, int digits, const fs::path& folder) {
  CsvFiles csv(folder, player.scene(), {digits, player.scene().csv_metres_per_unit});
  const DatagramLimits limits = datagram_limits(player, bundle);
  std::vector<std::uint64_t> memory(palpate_contacts_bytes(player.runtime_scene()) / 8 + 1);
  auto* contacts = reinterpret_cast<palpate_contacts*>(memory.data());
  DatagramNote note;
  for (const auto& datagram : run.kept) {
    if (decode_contacts(datagram, limits, contacts, &note) != DatagramFault::none) continue;  // a step not finite
    const std::vector<SceneConfig::Vector> positions(note.positions.begin(),
                                                     note.positions.begin() + contacts->tool_count);
    csv.write({note.time, contacts->flags, positions, *contacts});
  }
  csv.close();
}

void run(Options& options) {
  const SceneConfig scene = read_scene_config(options.scene);
  check_deformation(scene);
  const fs::path bundle = bundle_of(scene, options.bundles);
  const SocketAddress to = resolve("--to", options.to, SOCK_DGRAM);
  std::optional<OutputFolder> folder;
  if (!options.output.empty())
    folder.emplace(options.output, std::vector<std::string>{"forces.csv", "contacts.csv", "summary.json"});
  Player player(scene, bundle, Half::touch);
  const std::uint64_t identity = read_bundle_fields(bundle).identity;
  if (palpate_error error{}; options.prefault && palpate_bundle_prefault(player.bundle(), 1, &error) != PALPATE_OK)
    note(error.text);
  DatagramSender sender(to);
  options.feel.late = options.every_step ? LateSteps::caught_up : LateSteps::left_out;
  options.feel.keep = folder.has_value();
  const FeelRun felt = feel(player, identity, sender, options.feel, &stop_on_signal());
  fmt::print("{}", feel_table(felt));
  for (const std::string& warning : felt.flags.warnings("touches")) warn(warning);
  if (!folder) return;
  write_csv(felt, player, identity, options.digits, folder->part());
  write_text_atomically(folder->part() / "summary.json", feel_summary(felt, player, text_of(to)));
  folder->commit();
}

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) {
  palpate::Options options;
  return palpate::run_program(
      argc, argv, "palpate-feel", "Plays a scene's touch against the clock and sends its contacts to palpate-draw.",
      [&](CLI::App& app) {
        palpate::add_scene_options(app, options, "the scene", "folder for forces.csv, contacts.csv and summary.json");
        app.add_option("--to", options.to, "where palpate-draw listens: HOST:PORT, or PORT on this machine")
            ->required();
        palpate::add_digits(app, options);
        palpate::add_seconds(app, options.feel.seconds, "play the scene over and over for that long; default: once");
        app.add_flag("--every-step", options.every_step,
                     "make every step of the path, even when it is late, so that a run can be repeated");
        app.add_flag(
            "--prefault", options.prefault,
            "read the mapped sections whole and lock them in memory first, so that no touch waits for the disk");
      },
      [&] { palpate::run(options); });
}
