// palpate-igtl: serves a scene by OpenIGTLink, for trackers and 3D Slicer.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>

#include "formats/command_line.h"
#include "formats/errors.h"
#include "formats/program.h"
#include "programs/link/igtl_server.h"
#include "programs/link/sockets.h"
#include "programs/link/stop_signal.h"
#include "programs/player/scene_bundle.h"
#include "programs/scene_options.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostName = 20;  // characters of an OpenIGTLink device name

struct Options : SceneOptions {
  std::string listen = "18944";  // the port that OpenIGTLink programs agree on
  IgtlServerOptions server;
};

void check(const SceneConfig& scene, const Options& options) {
  if (scene.def.shape == PALPATE_SHAPE_OFF)
    throw InputError(
        fmt::format("{}: effects.shape: expected surface, which is what is sent, found off", scene.file.string()));
  for (const auto& tool : scene.tools)
    if (tool.name.empty() || tool.name.size() > kMostName)
      throw InputError(
          fmt::format("{}:{}: tool \"{}\": expected a name of 1 to {} characters, which is an OpenIGTLink "
                      "device's; give it a shorter one",
                      scene.file.string(), tool.line, tool.name, kMostName));
  if (options.server.device.empty() || options.server.device.size() > kMostName)
    throw InputError(
        fmt::format("--device: expected 1 to {} characters, found \"{}\"", kMostName, options.server.device));
}

void run(const Options& options) {
  const SceneConfig scene = read_scene_config(options.scene);
  check(scene, options);
  const fs::path bundle = bundle_of(scene, options.bundles);
  const Descriptor listening = open_bound("--listen", resolve("--listen", options.listen, SOCK_STREAM), SOCK_STREAM);
  Player player(scene, bundle);
  const std::atomic<bool>& stop = stop_on_signal();
  fmt::print("listening on {}\n", text_of(address_of(listening.get())));
  std::fflush(stdout);
  const IgtlServerRun served =
      serve_igtl(player, listening.get(), options.server, &stop, [](const std::string& line) { say(line); });
  fmt::print("{}", igtl_table(served));
  for (const std::string& warning : served.touch_flags.warnings("touches")) warn(warning);
  for (const std::string& warning : served.shape_flags.warnings("shapes")) warn(warning);
}

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) {
  palpate::Options options;
  return palpate::run_program(
      argc, argv, "palpate-igtl",
      "Serves a scene over OpenIGTLink: TRANSFORM messages move its tools; POLYDATA, SENSOR and STRING tell its "
      "surface and the tools' forces.",
      [&](CLI::App& app) {
        palpate::add_scene_options(app, options, "the scene; the device of a tool's name moves the tool");
        app.add_option("--listen", options.listen, "PORT on this machine alone, or ADDRESS:PORT; default: 18944");
        app.add_option("--device", options.server.device, "device name of the surface; default: organ");
        app.add_option("--surface-rate", options.server.surface_rate, "surfaces (and forces as text) per second")
            ->check(CLI::Range(0.1, 1000.0));
        app.add_option("--force-rate", options.server.force_rate, "forces per second")->check(CLI::Range(0.1, 1000.0));
        app.add_flag("--on-request", options.server.on_request,
                     "send the surface only to a client that asks (GET_POLYDATA, STT_POLYDATA); default: to all");
        palpate::add_seconds(app, options.server.seconds, "stop after that long; default: never");
      },
      [&] { palpate::run(options); });
}
