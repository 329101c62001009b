// Fields of a bundle that the runtime's API does not give and the player writes: read through the index, without HDF5.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace palpate {

struct BundleFields {
  std::string provenance;              // JSON object
  std::vector<std::int32_t> region;    // [E]
  std::vector<std::uint8_t> fixed;     // [N][3]
  std::string region_names;            // each ended by a newline
  std::vector<double> young, poisson;  // [R] Pa, 1
  // What foundations and springs add to the stiffness (formats/BUNDLE.md, large/support), of a bundle made for large deformation.
  std::vector<std::int32_t> support_nodes;  // [*][2]
  std::vector<double> support_stiffness;    // [*][9] N/m
  std::uint64_t
      identity;  // the index's checksum, which covers the checksum of every section: the same for the same bytes
};

// Errors: InputError when the file is not a bundle, OperationError when it cannot be read.
BundleFields read_bundle_fields(const std::filesystem::path& bundle);

}  // namespace palpate
