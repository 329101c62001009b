// Paths of a test's files: each test has its own, so that tests can run at the same time. A test that passes leaves none of them.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>

#include "tests/support/file_bytes.h"

namespace palpate::tests {

// With what the names of a test's files begin.
inline std::string scratch_prefix(const testing::TestInfo& test) {
  std::string prefix = std::string("palpate_") + test.test_suite_name() + "." + test.name() + ".";
  std::replace(prefix.begin(), prefix.end(), '/', '_');
  return prefix;
}

// Removes the files of each test that has not failed. Those of a test that fails show why.
class ScratchRemover : public testing::EmptyTestEventListener {
  void OnTestEnd(const testing::TestInfo& test) override {
    if (test.result()->Failed()) return;
    const std::string prefix = scratch_prefix(test);
    for (const auto& file : std::filesystem::directory_iterator(testing::TempDir()))
      if (file.path().filename().string().starts_with(prefix)) std::filesystem::remove_all(file);
  }
};

// The path of a file that only the running test uses.
inline std::filesystem::path scratch(const std::string& name) {
  testing::UnitTest* const tests = testing::UnitTest::GetInstance();
  static const bool removes = (tests->listeners().Append(new ScratchRemover), true);  // GoogleTest owns it
  static_cast<void>(removes);
  return std::filesystem::path(testing::TempDir()) / (scratch_prefix(*tests->current_test_info()) + name);
}

// An empty folder that only the running test uses.
inline std::filesystem::path fresh_folder() {
  const auto folder = scratch("folder");
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  return folder;
}

}  // namespace palpate::tests
