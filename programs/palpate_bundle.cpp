// palpate-bundle info | verify | diff | pack: shows, checks, compares and shrinks tensor bundles.
#include <CLI/CLI.hpp>

#include "formats/command_line.h"
#include "formats/errors.h"
#include "precompute/bundle_tool/bundle_commands.h"

int main(int argc, char** argv) {
  using namespace palpate;
  std::string file, other;
  bool json = false;
  VerifyOptions options;
  PackOptions packing;
  double low_rank = 0;
  formats::ElementType precision = formats::ElementType::f32;
  CLI::App *info = nullptr, *verify = nullptr, *diff = nullptr, *pack = nullptr;

  const auto define = [&](CLI::App& app) {
    app.require_subcommand(1);
    info = app.add_subcommand("info", "What a bundle holds, on one screen");
    verify =
        app.add_subcommand("verify", "Checks structure, checksums, numbers and the laws they obey (exit 3: not held)");
    diff = app.add_subcommand("diff", "What differs between two bundles (exit 0: nothing, 3: something)");
    pack = app.add_subcommand("pack", "Makes a smaller bundle and states what that costs in accuracy");
    for (CLI::App* command : {info, verify, diff}) {
      command->add_option(command == diff ? "A" : "BUNDLE", file, "Tensor bundle")->required();
      command->add_flag("--json", json, "Report as JSON");
    }
    diff->add_option("B", other, "Tensor bundle")->required();
    pack->add_option("BUNDLE", packing.bundle, "Tensor bundle, as palpate-precompute wrote it")->required();
    pack->add_option("-o,--output", packing.output, "Tensor bundle to write")->required();
    const std::map<std::string, formats::ElementType> types = {
        {"f64", formats::ElementType::f64}, {"f32", formats::ElementType::f32}, {"f16", formats::ElementType::f16}};
    pack->add_option("--precision", precision, "f64, f32 or f16 (default: as it is)")
        ->transform(CLI::Transformer(types, CLI::ignore_case).description("f64, f32 or f16"));
    pack->add_flag("--surface", packing.surface, "Drop the displacements of the interior");
    pack->add_option("--touchable", packing.touchable,
                     "Keep the columns of the nodes that this boundary TOML's [touchable] selects");
    pack->add_option("--patch", packing.patches,
                     "Keep the columns of the mesh's surface patch of this name (repeatable)");
    pack->add_option("--mesh", packing.mesh, "The mesh it was made from: needed by --touchable and --patch");
    pack->add_option("--low-rank", low_rank,
                     "Store the surface's compliance in blocks, low rank where clusters are apart, with at most this "
                     "relative error in any column (1e-6 to 0.1)");
    pack->add_option("--accuracy", packing.accuracy,
                     "The measured.json of palpate-accuracy choose, for the certificate; it must be about this bundle");
    auto* mesh =
        verify->add_option("--mesh", options.mesh, "The mesh it was made from: checks its hash and solves again");
    auto* organ = verify->add_option("--organ", options.organ, "The organ.toml it was made from");
    auto* boundary = verify->add_option("--boundary", options.boundary, "The boundary TOML it was made from");
    mesh->needs(organ)->needs(boundary);
    organ->needs(mesh);
    boundary->needs(mesh);
    verify->add_option("--columns", options.columns, "Touchable nodes to solve again, drawn at random")
        ->check(positive_number())
        ->needs(mesh)
        ->capture_default_str();
    verify->add_option("--seed", options.seed, "Of the draw")->needs(mesh)->capture_default_str();
  };
  const auto body = [&] {
    if (info->parsed()) show_bundle(file, json);
    if (diff->parsed()) compare_bundles(file, other, json);
    if (pack->parsed()) {
      if (pack->count("--precision") > 0) packing.precision = precision;
      if (pack->count("--low-rank") > 0) packing.low_rank = low_rank;
      pack_bundle(packing);
    }
    if (verify->parsed()) {
      options.bundle = file;
      options.json = json;
      verify_bundle(options);
    }
  };
  return run_program(argc, argv, "palpate-bundle", "Shows, checks, compares and shrinks tensor bundles", define, body);
}
