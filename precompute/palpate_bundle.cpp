// palpate-bundle info | verify | diff: shows, checks and compares tensor bundles.
#include "formats/errors.h"
#include "formats/program.h"
#include "precompute/palpate_bundle_commands.h"

int main(int argc, char** argv) {
  using namespace palpate;
  std::string file, other;
  bool json = false;
  VerifyOptions options;
  CLI::App *info = nullptr, *verify = nullptr, *diff = nullptr;

  const auto define = [&](CLI::App& app) {
    app.require_subcommand(1);
    info = app.add_subcommand("info", "What a bundle holds, on one screen");
    verify =
        app.add_subcommand("verify", "Checks structure, checksums, numbers and the laws they obey (exit 3: not held)");
    diff = app.add_subcommand("diff", "What differs between two bundles (exit 0: nothing, 3: something)");
    for (CLI::App* command : {info, verify, diff}) {
      command->add_option(command == diff ? "A" : "BUNDLE", file, "Tensor bundle")->required();
      command->add_flag("--json", json, "Report as JSON");
    }
    diff->add_option("B", other, "Tensor bundle")->required();
    auto* mesh =
        verify->add_option("--mesh", options.mesh, "The mesh it was made from: checks its hash and solves again");
    auto* organ = verify->add_option("--organ", options.organ, "The organ.toml it was made from");
    auto* boundary = verify->add_option("--boundary", options.boundary, "The boundary TOML it was made from");
    mesh->needs(organ)->needs(boundary);
    organ->needs(mesh);
    boundary->needs(mesh);
    verify->add_option("--columns", options.columns, "Touchable nodes to solve again, drawn at random")
        ->check(CLI::PositiveNumber)
        ->needs(mesh)
        ->capture_default_str();
    verify->add_option("--seed", options.seed, "Of the draw")->needs(mesh)->capture_default_str();
  };
  const auto body = [&] {
    if (info->parsed()) show_bundle(file, json);
    if (diff->parsed()) compare_bundles(file, other, json);
    if (verify->parsed()) {
      options.bundle = file;
      options.json = json;
      verify_bundle(options);
    }
  };
  return run_program(argc, argv, "palpate-bundle", "Shows, checks and compares tensor bundles", define, body);
}
