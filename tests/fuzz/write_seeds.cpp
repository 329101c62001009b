// write_seeds FOLDER: writes inputs from which the fuzzers start, to FOLDER/DRIVER: small valid files, and arbitrary bytes.
#include <filesystem>
#include <fstream>
#include <random>
#include <string>

#include "tests/support/msh_files.h"
#include "tests/support/packed_bundle.h"
#include "tests/support/tiny_bundle.h"

int main(int argc, char** argv) {
  using namespace palpate;
  if (argc != 2) return 2;
  const std::filesystem::path folder = argv[1];
  std::filesystem::create_directories(folder / "bundle_reader");
  std::filesystem::create_directories(folder / "mesh_reader");
  tests::write_bundle(folder / "bundle_reader" / "box.h5", tests::tiny_bundle({.cells = {1, 1, 1}, .interior = false}));
  auto packed = tests::tiny_bundle({.cells = {2, 1, 1}, .interior = false});
  tests::store_in_blocks(packed, {formats::ElementType::f16, 1e-3});
  tests::write_bundle(folder / "bundle_reader" / "blocks.h5", packed);
  auto halves = tests::tiny_bundle({.cells = {1, 1, 1}, .interior = false});
  tests::store_as_f16(halves);
  tests::write_bundle(folder / "bundle_reader" / "f16.h5", halves);
  auto mesh = box_mesh({1, 1, 1}, {1, 2, 3});
  mesh.patches.resize(2);
  write_mesh(folder / "mesh_reader" / "4.1.msh", mesh);
  std::ofstream(folder / "mesh_reader" / "2.2.msh", std::ios::binary) << tests::msh2_ascii(mesh);
  std::ofstream(folder / "mesh_reader" / "2.2b.msh", std::ios::binary) << tests::msh2_binary(mesh);
  std::ofstream(folder / "mesh_reader" / "4.1b.msh", std::ios::binary) << tests::msh4_binary(mesh);

  std::mt19937 random(1);
  for (const char* driver : {"scene", "tools"}) {
    std::filesystem::create_directories(folder / driver);
    for (int recipe = 0; recipe < 64; ++recipe) {
      std::string bytes(40 + random() % 400, '\0');
      for (char& byte : bytes) byte = static_cast<char>(random());
      std::ofstream(folder / driver / std::to_string(recipe), std::ios::binary) << bytes;
    }
  }
  return 0;
}
