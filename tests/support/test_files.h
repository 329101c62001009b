// Where a test's files lie, so that tests can run side by side.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>

#include "tests/support/file_bytes.h"

namespace palpate::tests {

// A file of the running test's own.
inline std::filesystem::path scratch(const std::string& name) {
  const auto* test = testing::UnitTest::GetInstance()->current_test_info();
  std::string full = std::string("palpate_") + test->test_suite_name() + "." + test->name() + "." + name;
  std::replace(full.begin(), full.end(), '/', '_');
  return std::filesystem::path(testing::TempDir()) / full;
}

// An empty folder of the running test's own.
inline std::filesystem::path fresh_folder() {
  const auto folder = scratch("folder");
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  return folder;
}

}  // namespace palpate::tests
