// Runs palpate-bundle and palpate-precompute as users do, on files of one test alone.
#pragma once

#include <fstream>

#include "formats/tetrahedral_mesh.h"
#include "tests/support/box_files.h"
#include "tests/support/program_run.h"

namespace palpate::tests {

inline void write_bytes(const std::filesystem::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary) << bytes;
}

inline ProgramRun palpate_bundle(const std::string& arguments) {
  return run_in(fresh_folder(), PALPATE_BUNDLE_PROGRAM " " + arguments);
}

// A box of tissue held at x0 and at a corner: mesh, organ and boundary of this test. store: "" or a [store] table.
inline void write_inputs(const std::string& store = "") {
  auto mesh = box_mesh({4, 3, 3}, {60, 50, 40}, 0.1);
  write_mesh(scratch("msh"), mesh);
  write_bytes(scratch("organ.toml"), kOrgan);
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
  const ProgramRun ended = run_in(fresh_folder(), PALPATE_PRECOMPUTE_PROGRAM " " + scratch("msh").string() +
                                                      " --organ " + scratch("organ.toml").string() + " --boundary " +
                                                      scratch("boundary.toml").string() + " -o " + bundle);
  EXPECT_EQ(ended.code, 0) << ended.errors;
  return bundle;
}

}  // namespace palpate::tests
