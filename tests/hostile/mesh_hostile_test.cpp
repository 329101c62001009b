// Mesh files that are cut, garbled or malicious. The reader must refuse them with a sentence: no crash, no hang, no allocation
// out of proportion to the file. make -f Makefile.data test-sanitized also finds reads behind the end.
#include <gtest/gtest.h>

#include <cstring>
#include <memory>
#include <random>

#include "formats/errors.h"
#include "formats/msh_reader.h"
#include "studies/bodies/box_mesh.h"
#include "tests/support/msh_files.h"

namespace palpate {
namespace {

// A small mesh in all four kinds of file: one cell, two patches.
std::vector<std::string> corpus() {
  auto mesh = box_mesh({1, 1, 1}, {1, 2, 3});
  mesh.patches.resize(2);
  const auto file = std::filesystem::path(testing::TempDir()) / ("mesh_hostile." + std::to_string(::getpid()) + ".msh");
  write_mesh(file, mesh);
  std::string ascii4(std::filesystem::file_size(file), '\0');
  std::FILE* in = std::fopen(file.c_str(), "rb");
  EXPECT_EQ(std::fread(ascii4.data(), 1, ascii4.size(), in), ascii4.size());
  std::fclose(in);
  std::filesystem::remove(file);
  return {ascii4, tests::msh2_ascii(mesh), tests::msh2_binary(mesh), tests::msh4_binary(mesh)};
}

// True if the bytes are read, false if they are refused with a sentence. Anything else fails the test.
bool read(const std::string& bytes) {
  const std::unique_ptr<char[]> exact(new char[bytes.size()]);
  std::memcpy(exact.get(), bytes.data(), bytes.size());
  try {
    const TetrahedralMesh mesh = parse_mesh({exact.get(), bytes.size()}, "hostile.msh");
    for (const auto& t : mesh.tetrahedra)
      for (const auto n : t) EXPECT_TRUE(n >= 0 && static_cast<std::size_t>(n) < mesh.nodes.size());
    for (const auto& patch : mesh.patches)
      for (const auto& t : patch.triangles)
        for (const auto n : t) EXPECT_TRUE(n >= 0 && static_cast<std::size_t>(n) < mesh.nodes.size());
    for (const auto r : mesh.region) EXPECT_TRUE(r >= 0 && static_cast<std::size_t>(r) < mesh.region_names.size());
    return true;
  } catch (const InputError& error) {
    const std::string sentence = error.what();
    EXPECT_EQ(sentence.rfind("hostile.msh: ", 0), 0u) << sentence;
    EXPECT_LT(sentence.size(), 400u) << sentence;
    return false;
  }
}

TEST(HostileMesh, CutAtAnyByteIsRefused) {
  for (const std::string& whole : corpus()) {
    ASSERT_TRUE(read(whole));
    for (std::size_t n = 0; n + 1 < whole.size(); ++n)  // the last byte is a line end, which may be missing
      ASSERT_FALSE(read(whole.substr(0, n))) << n << " of " << whole.size();
  }
}

TEST(HostileMesh, WithAnyByteChangedIsReadOrRefused) {
  testing::internal::CaptureStderr();  // the reader's notes
  for (const std::string& whole : corpus())
    for (std::size_t at = 0; at < whole.size(); ++at)
      for (const char change : {'\0', '\xff', '9', '-', ' ', '\n', '$'}) {
        std::string bytes = whole;
        bytes[at] = change;
        read(bytes);
      }
  testing::internal::GetCapturedStderr();
}

TEST(HostileMesh, WithNumbersReplacedByExtremesIsReadOrRefused) {
  const std::string extremes[] = {"0",
                                  "-1",
                                  "2147483647",
                                  "2147483648",
                                  "-2147483648",
                                  "4294967295",
                                  "9223372036854775807",
                                  "18446744073709551615",
                                  "18446744073709551616",
                                  "1e308",
                                  "-1e308",
                                  "nan",
                                  "-inf",
                                  "1e-320"};
  testing::internal::CaptureStderr();
  for (std::size_t kind = 0; kind < 2; ++kind) {
    const std::string whole = corpus()[kind];
    // Replaces each word of the file in turn.
    for (std::size_t begin = whole.find_first_of("0123456789"); begin != std::string::npos;) {
      const std::size_t end = whole.find_first_of(" \n", begin);
      for (const std::string& extreme : extremes) read(whole.substr(0, begin) + extreme + whole.substr(end));
      begin = whole.find_first_of("0123456789", end);
    }
  }
  testing::internal::GetCapturedStderr();
}

TEST(HostileMesh, WithWordsOfABinaryFileReplacedIsReadOrRefused) {
  std::mt19937_64 random(1);
  const std::uint64_t edges[] = {0,
                                 1,
                                 2,
                                 4,
                                 11,
                                 INT32_MAX,
                                 UINT32_MAX,
                                 1ull << 31,
                                 1ull << 32,
                                 INT64_MAX,
                                 UINT64_MAX,
                                 0x7ff8000000000000ull,
                                 0x7ff0000000000000ull};
  testing::internal::CaptureStderr();
  for (std::size_t kind = 2; kind < 4; ++kind) {
    const std::string whole = corpus()[kind];
    for (int round = 0; round < 20000; ++round) {
      std::string bytes = whole;
      const std::size_t width = random() % 2 ? 4 : 8;
      std::memcpy(bytes.data() + random() % (bytes.size() - width), &edges[random() % std::size(edges)], width);
      read(bytes);
    }
  }
  testing::internal::GetCapturedStderr();
}

TEST(HostileMesh, OfManyEmptyBlocksIsReadInTimeThatGrowsWithTheFile) {
  // A reader whose time grows with the square of the size would take minutes for this megabyte and exceed the time limit.
  std::string text = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n100000 4 1 4\n";
  for (int b = 0; b < 99999; ++b) text += "0 1 0 0\n";
  text += "3 1 0 4\n1\n2\n3\n4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n$EndNodes\n$Elements\n100000 1 1 1\n";
  for (int b = 0; b < 99999; ++b) text += "0 1 15 0\n";
  text += "3 1 4 1\n1 1 2 3 4\n$EndElements\n";
  EXPECT_TRUE(read(text));
}

}  // namespace
}  // namespace palpate
