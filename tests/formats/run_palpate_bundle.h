// palpate-bundle and palpate-precompute as their users run them, with files of one test alone.
#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "formats/tetrahedral_mesh.h"
#include "tests/support/box_mesh.h"

namespace palpate::tests {

struct Ended {
  int code;
  std::string out, err;
};

inline std::filesystem::path scratch(const std::string& name) {
  const auto* test = testing::UnitTest::GetInstance()->current_test_info();
  return std::filesystem::path(testing::TempDir()) /
         (std::string(test->test_suite_name()) + "." + test->name() + "." + name);
}

inline std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

inline void write_bytes(const std::filesystem::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary) << bytes;
}

inline Ended run(const std::string& program, const std::string& arguments) {
  const auto err = scratch("stderr");
  const std::string command = program + " " + arguments + " 2>" + err.string();
  std::FILE* pipe = ::popen(command.c_str(), "r");
  std::string out;
  char buffer[4096];
  for (std::size_t n; (n = std::fread(buffer, 1, sizeof buffer, pipe)) > 0;) out.append(buffer, n);
  const int status = ::pclose(pipe);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, out, bytes_of(err)};
}
inline Ended palpate_bundle(const std::string& arguments) {
  return run(PALPATE_BUNDLE_PROGRAM, arguments);
}

// A box of tissue held at x0 and at a corner: mesh, organ and boundary of this test. store: "" or a [store] table.
inline void write_inputs(const std::string& store = "") {
  auto mesh = box_mesh({4, 3, 3}, {60, 50, 40}, 0.1);
  write_mesh(scratch("msh"), mesh);
  write_bytes(scratch("organ.toml"), R"(
name = "box"
mesh_unit = "mm"
frame = "none"
element = "p1"
[[region]]
name = "box"
young = { value = 5.4, unit = "kPa", source = "test" }
poisson = { value = 0.45, source = "test" }
)");
  write_bytes(scratch("boundary.toml"), R"(
name = "face"
[[fixed]]
dofs = "xyz"
select = { patch = "x0" }
[[fixed]]
dofs = "y"
select = { nearest = { points = [[60, 50, 40]] } }
)" + store);
}

inline std::string precompute() {
  const std::string bundle = scratch("computed.h5");
  const Ended ended =
      run(PALPATE_PRECOMPUTE_PROGRAM, scratch("msh").string() + " --organ " + scratch("organ.toml").string() +
                                          " --boundary " + scratch("boundary.toml").string() + " -o " + bundle);
  EXPECT_EQ(ended.code, 0) << ended.err;
  return bundle;
}

}  // namespace palpate::tests
