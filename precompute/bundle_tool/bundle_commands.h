// What palpate-bundle does. Each prints its report on stdout, for a reader or as JSON.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "formats/bundle_layout.h"

namespace palpate {

// One screen: organ, counts, materials, certificate, hashes, sections. Errors: InputError when it is no bundle.
void show_bundle(const std::filesystem::path& file, bool json);

struct VerifyOptions {
  std::filesystem::path bundle;
  std::filesystem::path mesh, organ, boundary;  // empty, or all three: then columns are solved again
  int columns = 8;                              // touchable nodes whose three columns are solved again
  std::uint64_t seed = 1;
  bool json = false;
};
// Errors: InputError when it is no bundle, VerificationError when a check does not hold.
void verify_bundle(const VerifyOptions& options);

struct PackOptions {
  std::filesystem::path bundle, output;
  std::optional<formats::ElementType> precision;  // f64, f32 or f16; as it is
  bool surface = false;                           // drop the interior
  std::filesystem::path touchable;                // boundary TOML whose [touchable] selects the columns to keep
  std::vector<std::string> patches;               // surface patches of the mesh that do
  std::filesystem::path mesh;                     // needed by those two
  std::optional<double> low_rank;                 // compliance in blocks, relative column error at most
  std::filesystem::path accuracy;                 // of palpate-accuracy choose, for the certificate
};
// Writes options.output atomically; the same input gives the same bytes. Errors: InputError for a source that is no bundle
// or that the options would make no smaller, OperationError (disk).
void pack_bundle(const PackOptions& options);

// Errors: InputError when one is no bundle, VerificationError when they differ.
void compare_bundles(const std::filesystem::path& a, const std::filesystem::path& b, bool json);

}  // namespace palpate
