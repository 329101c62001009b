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
    info = app.add_subcommand("info", "Shows what a bundle holds, on one screen");
    verify = app.add_subcommand("verify",
                                "Checks the structure, checksums and numbers of a bundle, and the laws they must obey "
                                "(exit code 3: one does not hold)");
    diff = app.add_subcommand("diff", "Shows what differs between two bundles (exit code 0: nothing, 3: something)");
    pack = app.add_subcommand("pack",
                              "Makes a smaller bundle, measures the error that this makes and states it in the bundle");
    for (CLI::App* command : {info, verify, diff}) {
      command->add_option(command == diff ? "A" : "BUNDLE", file, "Tensor bundle")->required();
      command->add_flag("--json", json, "Report as JSON");
    }
    diff->add_option("B", other, "Tensor bundle")->required();
    pack->add_option("BUNDLE", packing.bundle, "Tensor bundle, as palpate-precompute wrote it")->required();
    pack->add_option("-o,--output", packing.output, "Tensor bundle to write")->required();
    const std::map<std::string, formats::ElementType> types = {
        {"f64", formats::ElementType::f64}, {"f32", formats::ElementType::f32}, {"f16", formats::ElementType::f16}};
    pack->add_option("--precision", precision,
                     "Number format of the displacements: f64, f32 or f16 (default: that of BUNDLE)")
        ->transform(CLI::Transformer(types, CLI::ignore_case).description("f64, f32 or f16"));
    pack->add_flag("--surface", packing.surface, "Leave out the displacements of interior nodes");
    pack->add_option("--touchable", packing.touchable,
                     "Keep the columns of the nodes that this boundary TOML's [touchable] selects");
    pack->add_option("--patch", packing.patches,
                     "Keep the columns of the mesh's surface patch of this name (repeatable)");
    pack->add_option("--mesh", packing.mesh, "The mesh that BUNDLE was made from; needed by --touchable and --patch");
    pack->add_option("--low-rank", low_rank,
                     "Store the compliance of the surface in blocks, those of far-apart parts of the surface with low "
                     "rank; the number is the largest relative error of a column (1e-6 to 0.1)");
    pack->add_option(
        "--accuracy", packing.accuracy,
        "The measured.json that palpate-accuracy choose wrote for this setting; goes into the certificate");
    auto* mesh = verify->add_option(
        "--mesh", options.mesh, "The mesh that BUNDLE was made from: compares its hash and solves some columns again");
    auto* organ = verify->add_option("--organ", options.organ, "The organ.toml that BUNDLE was made from");
    auto* boundary = verify->add_option("--boundary", options.boundary, "The boundary TOML that BUNDLE was made from");
    verify->add_option("--image", options.image, "The image that the boundary TOML's label selectors read")
        ->needs(boundary);
    mesh->needs(organ)->needs(boundary);
    organ->needs(mesh);
    boundary->needs(mesh);
    verify->add_option("--columns", options.columns, "How many touchable nodes, drawn at random, to solve again")
        ->check(positive_number())
        ->needs(mesh)
        ->capture_default_str();
    verify->add_option("--seed", options.seed, "Seed of the random draw")->needs(mesh)->capture_default_str();
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
