// A small undamaged bundle in every storage form. Hostile tests and fuzzers damage them.
#pragma once

#include <filesystem>

#include "tests/support/file_bytes.h"
#include "tests/support/packed_bundle.h"
#include "tests/support/tiny_bundle.h"

namespace palpate::tests {

// The optional sections: a preload and both response curves.
void add_everything(BundleParts& parts);

void add_second_region(BundleParts& parts);

void widen_values(BundleParts& parts);

struct BundleForm {
  const char* name;
  std::string bytes;
};

// folder: for temporary files.
std::vector<BundleForm> bundle_forms(const std::filesystem::path& folder);

}  // namespace palpate::tests
