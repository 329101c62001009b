// write_seeds FOLDER: small valid inputs for the fuzzers to start from, in FOLDER/bundle and FOLDER/mesh.
#include <filesystem>
#include <fstream>
#include <string>

#include "tests/support/msh_files.h"
#include "tests/support/packed_bundle.h"
#include "tests/support/tiny_bundle.h"

int main(int argc, char** argv) {
  using namespace palpate;
  if (argc != 2) return 2;
  const std::filesystem::path folder = argv[1];
  std::filesystem::create_directories(folder / "bundle");
  std::filesystem::create_directories(folder / "mesh");
  tests::write_bundle(folder / "bundle" / "box.h5", tests::tiny_bundle({.cells = {1, 1, 1}, .interior = false}));
  auto packed = tests::tiny_bundle({.cells = {2, 1, 1}, .interior = false});
  tests::store_in_blocks(packed, {formats::ElementType::f16, 1e-3});
  tests::write_bundle(folder / "bundle" / "blocks.h5", packed);
  auto halves = tests::tiny_bundle({.cells = {1, 1, 1}, .interior = false});
  tests::store_as_f16(halves);
  tests::write_bundle(folder / "bundle" / "f16.h5", halves);
  auto mesh = tests::box_mesh({1, 1, 1}, {1, 2, 3});
  mesh.patches.resize(2);
  write_mesh(folder / "mesh" / "4.1.msh", mesh);
  std::ofstream(folder / "mesh" / "2.2.msh", std::ios::binary) << tests::msh2_ascii(mesh);
  std::ofstream(folder / "mesh" / "2.2b.msh", std::ios::binary) << tests::msh2_binary(mesh);
  std::ofstream(folder / "mesh" / "4.1b.msh", std::ios::binary) << tests::msh4_binary(mesh);
  return 0;
}
