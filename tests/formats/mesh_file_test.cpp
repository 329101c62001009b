#include <gtest/gtest.h>

#include "formats/errors.h"
#include "formats/msh_reader.h"
#include "tests/support/box_mesh.h"

namespace palpate {
namespace {

void expect_equal(const TetrahedralMesh& a, const TetrahedralMesh& b) {
  EXPECT_EQ(a.nodes, b.nodes);
  EXPECT_EQ(a.tetrahedra, b.tetrahedra);
  EXPECT_EQ(a.region, b.region);
  EXPECT_EQ(a.region_names, b.region_names);
  ASSERT_EQ(a.patches.size(), b.patches.size());
  for (std::size_t p = 0; p < a.patches.size(); ++p) {
    EXPECT_EQ(a.patches[p].name, b.patches[p].name);
    EXPECT_EQ(a.patches[p].triangles, b.patches[p].triangles);
  }
}

TEST(MeshFile, ReadsBackWhatItWrote) {
  const auto mesh = tests::box_mesh({3, 2, 2}, {1.0, 0.7, 1.0 / 3.0}, 0.1);
  const auto file = std::filesystem::path(testing::TempDir()) / "MeshFile.ReadsBackWhatItWrote.msh";
  write_mesh(file, mesh);
  expect_equal(read_mesh(file), mesh);
}

}  // namespace
}  // namespace palpate
