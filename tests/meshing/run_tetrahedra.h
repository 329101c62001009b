// Runs the real palpate-tetrahedra and keeps what it said.
#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

namespace palpate::tests {

struct TetrahedraRun {
  int exit_code = -1;
  std::string output, errors;
};

inline std::string file_text(const std::filesystem::path& file) {
  std::ostringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  return text.str();
}

// PALPATE_TETRAHEDRA_PROGRAM is set by CMake.
inline TetrahedraRun run_tetrahedra(const std::filesystem::path& folder, const std::string& arguments) {
  const std::filesystem::path output = folder / "stdout.txt", errors = folder / "stderr.txt";
  const std::string command = "cd " + folder.string() + " && " + PALPATE_TETRAHEDRA_PROGRAM + " " + arguments + " > " +
                              output.string() + " 2> " + errors.string();
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status), file_text(output), file_text(errors)};
}

// A fresh folder of the running test's own.
inline std::filesystem::path fresh_tetrahedra_folder() {
  const auto* test = testing::UnitTest::GetInstance()->current_test_info();
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) /
                                       (std::string("palpate_") + test->test_suite_name() + "." + test->name());
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  return folder;
}

}  // namespace palpate::tests
