// Runs the real palpate-surface and keeps what it said.
#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

namespace palpate::tests {

struct ProgramRun {
  int exit_code = -1;
  std::string errors;  // stderr
};

// PALPATE_SURFACE_PROGRAM is set by CMake.
inline ProgramRun run_surface(const std::filesystem::path& folder, const std::string& arguments) {
  const std::filesystem::path errors = folder / "stderr.txt";
  const std::string command = std::string(PALPATE_SURFACE_PROGRAM) + " " + arguments + " > " +
                              (folder / "stdout.txt").string() + " 2> " + errors.string();
  const int status = std::system(command.c_str());
  std::ostringstream text;
  text << std::ifstream(errors).rdbuf();
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status), text.str()};
}

// A fresh folder of the running test's own.
inline std::filesystem::path fresh_folder() {
  const auto* test = testing::UnitTest::GetInstance()->current_test_info();
  std::string name = std::string(test->test_suite_name()) + "." + test->name();
  for (char& c : name) c = c == '/' ? '_' : c;
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / ("palpate_" + name);
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  return folder;
}

}  // namespace palpate::tests
