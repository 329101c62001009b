// Paths of a test's files: each test has its own, so that tests can run at the same time.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>

#include "tests/support/file_bytes.h"

namespace palpate::tests {

// The path of a file that only the running test uses.
inline std::filesystem::path scratch(const std::string& name) {
  const auto* test = testing::UnitTest::GetInstance()->current_test_info();
  std::string full = std::string("palpate_") + test->test_suite_name() + "." + test->name() + "." + name;
  std::replace(full.begin(), full.end(), '/', '_');
  return std::filesystem::path(testing::TempDir()) / full;
}

// An empty folder that only the running test uses.
inline std::filesystem::path fresh_folder() {
  const auto folder = scratch("folder");
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  return folder;
}

}  // namespace palpate::tests
