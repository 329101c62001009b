// The commands of palpate-bundle. Each prints its report on standard output, as text or as JSON.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "formats/bundle_layout.h"

namespace palpate {

// palpate-bundle info: organ, counts, materials, certificate, hashes and sections on one screen. Errors: InputError
// where the file is no bundle.
void show_bundle(const std::filesystem::path& file, bool json);

struct VerifyOptions {
  std::filesystem::path bundle;
  std::filesystem::path mesh, organ, boundary;  // all three, or all empty; where given, columns are solved again
  std::filesystem::path image = {};             // with these; needed where the boundary's label selectors read it
  int columns = 3;                              // how many touchable nodes, drawn at random, are solved again
  std::uint64_t seed = 1;
  bool json = false;
};
// palpate-bundle verify. Errors: InputError where the file is no bundle, VerificationError where a check does not hold.
void verify_bundle(const VerifyOptions& options);

struct PackOptions {
  std::filesystem::path bundle, output;
  std::optional<formats::ElementType> precision;  // f64, f32 or f16; empty: that of the source
  bool surface = false;                           // drop the interior
  std::filesystem::path touchable;                // boundary TOML; keeps the columns that its [touchable] selects
  std::vector<std::string> patches;               // keeps the columns on these surface patches of the mesh
  std::filesystem::path mesh;                     // needed by touchable and patches
  std::optional<double> low_rank;  // stores the compliance in blocks, with at most this relative error of a column
  std::filesystem::path accuracy;  // the file of palpate-accuracy choose, for the certificate
};
// palpate-bundle pack. Writes the whole output or none of it; the same input gives the same bytes. Errors: InputError
// where the source is no bundle or the options would not make it smaller, OperationError for the disk.
void pack_bundle(const PackOptions& options);
// The same into a file that the caller renames to options.output.
void pack_bundle_into(const PackOptions& options, const std::filesystem::path& part);
// Errors: InputError where the value of --low-rank is none.
void check_low_rank(double value);

// palpate-bundle diff. Errors: InputError where one file is no bundle, VerificationError where they differ.
void compare_bundles(const std::filesystem::path& a, const std::filesystem::path& b, bool json);

}  // namespace palpate
