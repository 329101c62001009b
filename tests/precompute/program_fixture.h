// What tests of palpate-precompute as a program share: a box, its files, and running it. PALPATE_PRECOMPUTE is its path.
#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "tests/support/box_mesh.h"

namespace palpate::tests {

inline std::string content(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

inline const std::string kOrgan = R"(name = "box"
mesh_unit = "mm"
frame = "none"
element = "p1"
[[region]]
name = "box"
young = { value = 5.4, unit = "kPa", source = "test" }
poisson = { value = 0.45, source = "test" }
density = { value = 1060, unit = "kg/m^3", source = "test" }
)";
inline const std::string kBoundary = R"(name = "back"
[[fixed]]
dofs = "xyz"
select = { patch = "x0" }
[[fixed]]
dofs = "z"
select = { patch = "z0" }
)";

class ProgramFixture : public ::testing::Test {
 protected:
  void SetUp() override {
    // Open MPI refuses to start ranks as root unless told twice.
    ::setenv("OMPI_ALLOW_RUN_AS_ROOT", "1", 1);
    ::setenv("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1", 1);
    folder_ = std::filesystem::temp_directory_path() /
              ("palpate_precompute_" + std::to_string(::getpid()) + "_" + test_name());
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
    write_mesh(folder_ / "box.msh", box_mesh({6, 5, 4}, {60, 50, 40}, 0.15));
    write("organ.toml", kOrgan);
    write("bc.toml", kBoundary);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  static std::string test_name() { return ::testing::UnitTest::GetInstance()->current_test_info()->name(); }
  void write(const std::string& name, const std::string& text) { std::ofstream(folder_ / name) << text; }

  // Runs with the box's files; returns the exit code, stderr in said_.
  int run(const std::string& bundle, const std::string& more = "", int ranks = 0) {
    const std::string command = arguments(bundle, more);
    return execute(ranks > 0 ? kLaunch + " -n " + std::to_string(ranks) + " " + command : command);
  }

  // Two ranks, the second with other options.
  int run_unlike(const std::string& bundle, const std::string& more_of_second) {
    return execute(kLaunch + " -n 1 " + arguments(bundle, "") + " : -n 1 " + arguments(bundle, more_of_second));
  }

  static std::string arguments(const std::string& bundle, const std::string& more) {
    return std::string(PALPATE_PRECOMPUTE) + " box.msh --boundary bc.toml -o " + bundle +
           (more.find("--organ") == std::string::npos ? " --organ organ.toml " : " ") + more;
  }

  int execute(const std::string& command) {
    const int status = std::system(("cd '" + folder_.string() + "' && " + command + " > said.txt 2>&1").c_str());
    said_ = content(folder_ / "said.txt");
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

  bool nothing_left(const std::string& bundle) {
    for (const char* ending : {"", ".part", ".part.new", ".journal"})
      if (std::filesystem::exists(folder_ / (bundle + ending))) return false;
    return true;
  }

  const std::string kLaunch = "mpiexec --oversubscribe --bind-to none";
  std::filesystem::path folder_;
  std::string said_;
};

}  // namespace palpate::tests
