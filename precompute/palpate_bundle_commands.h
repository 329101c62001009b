// The three things palpate-bundle does. Each prints its report on stdout, for a reader or as JSON.
#pragma once

#include <cstdint>
#include <filesystem>

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

// Errors: InputError when one is no bundle, VerificationError when they differ.
void compare_bundles(const std::filesystem::path& a, const std::filesystem::path& b, bool json);

}  // namespace palpate
