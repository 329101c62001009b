#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "formats/errors.h"
#include "formats/msh_reader.h"
#include "studies/bodies/box_mesh.h"
#include "tests/support/msh_files.h"
#include "tests/support/test_files.h"
#include "tests/support/texts.h"

namespace palpate {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using tests::file_bytes;
using tests::scratch;

void expect_equal(const TetrahedralMesh& a, const TetrahedralMesh& b) {
  EXPECT_EQ(a.nodes, b.nodes);  // bit for bit: 17 digits are enough for a double
  EXPECT_EQ(a.tetrahedra, b.tetrahedra);
  EXPECT_EQ(a.region, b.region);
  EXPECT_EQ(a.region_names, b.region_names);
  ASSERT_EQ(a.patches.size(), b.patches.size());
  for (std::size_t p = 0; p < a.patches.size(); ++p) {
    EXPECT_EQ(a.patches[p].name, b.patches[p].name);
    EXPECT_EQ(a.patches[p].triangles, b.patches[p].triangles);
  }
}

// Two regions, six patches, and coordinates that need 17 digits.
TetrahedralMesh two_regions() {
  auto mesh = box_mesh({3, 2, 2}, {1.0, 0.7, 1.0 / 3.0}, 0.1);
  mesh.region_names = {"liver", "a tumour"};
  for (std::size_t e = mesh.tetrahedra.size() / 2; e < mesh.tetrahedra.size(); ++e) mesh.region[e] = 1;
  return mesh;
}

// The sentence with which the reader refuses; empty where it accepts.
std::string refusal(const std::string& bytes) {
  return tests::input_error([&] { parse_mesh(bytes, "a.msh"); });
}

TEST(MeshFile, ReadsBackWhatItWrote) {
  const auto file = scratch("msh");
  write_mesh(file, two_regions());
  expect_equal(read_mesh(file), two_regions());
}

TEST(MeshFile, IsTheSameBytesWhenWrittenTwice) {
  write_mesh(scratch("a.msh"), two_regions());
  write_mesh(scratch("b.msh"), two_regions());
  EXPECT_EQ(file_bytes(scratch("a.msh")), file_bytes(scratch("b.msh")));
}

TEST(MeshFile, ReadsTheSameMeshFromEveryVersion) {
  expect_equal(parse_mesh(tests::msh2_ascii(two_regions()), "2.2"), two_regions());
  expect_equal(parse_mesh(tests::msh2_binary(two_regions()), "2.2 binary"), two_regions());
  expect_equal(parse_mesh(tests::msh4_binary(two_regions()), "4.1 binary"), two_regions());
}

TEST(MeshFile, ReadsLinesThatEndTheWayOfWindows) {
  std::string windows;
  for (const char c : tests::msh2_ascii(two_regions())) windows += c == '\n' ? std::string("\r\n") : std::string(1, c);
  expect_equal(parse_mesh(windows, "2.2"), two_regions());
}

TEST(MeshFile, PassesOverAByteOrderMark) {
  expect_equal(parse_mesh("\xEF\xBB\xBF" + tests::msh2_ascii(two_regions()), "2.2"), two_regions());
}

TEST(MeshFile, TurnsTetrahedraThatAllListTheirNodesInTheOtherOrder) {
  TetrahedralMesh reversed = two_regions();
  for (auto& t : reversed.tetrahedra) std::swap(t[2], t[3]);
  expect_equal(parse_mesh(tests::msh2_ascii(reversed), "2.2"), two_regions());
  expect_equal(parse_mesh(tests::msh4_binary(reversed), "4.1"), two_regions());
  std::swap(reversed.tetrahedra[0][2], reversed.tetrahedra[0][3]);  // one in gmsh's order among them
  EXPECT_THAT(refusal(tests::msh2_ascii(reversed)), HasSubstr("expected a positive one"));
}

// One tetrahedron; each test changes a part.
struct Small {
  std::string names;
  std::string nodes = "4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n";
  std::string elements = "1\n1 4 2 7 9 1 2 3 4\n";
  std::string rest;
  std::string text() const {
    return "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n" + names + "$Nodes\n" + nodes + "$EndNodes\n$Elements\n" + elements +
           "$EndElements\n" + rest;
  }
};

TEST(MeshFile, NamesRegionsByTheirPhysicalGroupThenByTheirEntity) {
  Small small;
  EXPECT_EQ(parse_mesh(small.text(), "x").region_names, std::vector<std::string>{"region 7"});
  small.elements = "1\n1 4 2 0 9 1 2 3 4\n";
  EXPECT_EQ(parse_mesh(small.text(), "x").region_names, std::vector<std::string>{"region 9"});
  small.names = "$PhysicalNames\n1\n3 7 \"the liver\"\n$EndPhysicalNames\n";
  small.elements = "1\n1 4 2 7 9 1 2 3 4\n";
  EXPECT_EQ(parse_mesh(small.text(), "x").region_names, std::vector<std::string>{"the liver"});
}

TEST(MeshFile, SkipsSectionsAndElementsItDoesNotUseAndSaysSo) {
  Small small;
  small.names = "$Comments\nanything $ at all\n$EndComments\n";
  small.elements = "3\n1 15 2 0 1 1\n2 1 2 0 1 1 2\n3 4 2 7 9 1 2 3 4\n";
  small.rest = "$NodeData\n1\n$EndNodeData\n";
  testing::internal::CaptureStderr();
  const auto mesh = parse_mesh(small.text(), "a.msh");
  EXPECT_THAT(testing::internal::GetCapturedStderr(), HasSubstr("a.msh: 2 elements"));
  EXPECT_EQ(mesh.tetrahedra.size(), 1u);
}

TEST(MeshFile, DropsNodesThatNoTetrahedronUsesAndSaysSo) {
  Small small;
  small.nodes = "6\n10 5 5 5\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n11 6 6 6\n";
  small.elements = "2\n1 4 2 7 9 1 2 3 4\n2 2 2 5 5 1 2 11\n";
  testing::internal::CaptureStderr();
  const auto mesh = parse_mesh(small.text(), "a.msh");
  const std::string said = testing::internal::GetCapturedStderr();
  EXPECT_THAT(said, HasSubstr("2 nodes that"));
  EXPECT_THAT(said, HasSubstr("1 triangles of"));
  ASSERT_EQ(mesh.nodes.size(), 4u);
  EXPECT_EQ(mesh.nodes[1], (std::array<double, 3>{1, 0, 0}));
  EXPECT_EQ(mesh.tetrahedra[0], (std::array<std::int32_t, 4>{0, 1, 2, 3}));
  EXPECT_TRUE(mesh.patches.empty());
}

TEST(MeshFile, ErrorsNameFilePlaceAndFinding) {
  const struct {
    std::string Small::*part;
    std::string text, sentence;
  } cases[] = {
      {&Small::nodes, "4\n1 0 0 0\n2 nan 0 0\n3 0 1 0\n4 0 0 1\n", "a.msh: line 7: node 2"},
      {&Small::nodes, "4\n1 0 0 0\n2 x 0 0\n3 0 1 0\n4 0 0 1\n", "found 'x'"},
      {&Small::nodes, "4\n1 0 0 0\n2 1e999 0 0\n3 0 1 0\n4 0 0 1\n", "found '1e999'"},
      {&Small::nodes, "4\n1 0 0 0\n1 1 0 0\n3 0 1 0\n4 0 0 1\n", "node 1 is listed twice"},
      {&Small::nodes, "99999999999\n1 0 0 0\n", "cannot hold"},
      {&Small::elements, "99999999999\n1 4 2 7 9 1 2 3 4\n", "cannot hold"},
      {&Small::elements, "-1\n", "cannot hold"},
      {&Small::elements, "1\n1 4 2000000000 7 9 1 2 3 4\n", "cannot hold"},
      {&Small::elements, "1\n1 4 2 7 9 1 2 3 5\n", "line 13: element 1 uses node 5"},
      {&Small::elements, "1\n1 4 2 7 9 1 2 3 0\n", "positive node number"},
      {&Small::elements, "2\n7 4 2 7 9 1 2 3 4\n8 4 2 7 9 1 3 2 4\n", "tetrahedron 8 has volume -0.167"},
      {&Small::elements, "1\n1 4 2 7 9 1 2 3 3\n", "volume 0"},
      {&Small::nodes, "4\n1 0 0 0\n2 1e200 0 0\n3 0 1e200 0\n4 0 0 1e200\n", "volume"},
      {&Small::elements, "1\n1 11 2 7 9 1 2 3 4 1 2 3 4 1 2\n", "element order 1"},
      {&Small::elements, "1\n1 5 2 7 9 1 2 3 4 1 2 3 4\n", "element type 5"},
      {&Small::elements, "1\n1 99 2 7 9 1\n", "element type 99"},
      {&Small::elements, "1\n1 2 2 7 9 1 2 3\n", "no tetrahedra"},
      {&Small::elements, "0\n", "no tetrahedra"},
      {&Small::rest, "$Nodes\n0\n$EndNodes\n", "occurs twice"},
      {&Small::rest, "$Other\n", "$Other has no $EndOther"},
      {&Small::rest, "text\n", "found 'text'"},
  };
  for (const auto& [part, text, sentence] : cases) {
    Small small;
    small.*part = text;
    EXPECT_THAT(refusal(small.text()), HasSubstr(sentence));
  }
  EXPECT_THAT(refusal(""), HasSubstr("expected $MeshFormat"));
  EXPECT_THAT(refusal("$MeshFormat\n4 0 8\n$EndMeshFormat\n"), HasSubstr("found 4"));
  EXPECT_THAT(refusal("$NOD\n1\n1 0 0 0\n$ENDNOD\n$ELM\n0\n$ENDELM\n"), HasSubstr("version 1 ($NOD)"));
  EXPECT_THAT(refusal("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n"), HasSubstr("without section $Nodes"));
  EXPECT_THAT(refusal(std::string("$MeshFormat\n2.2 1 8\n\0\0\0\1", 25)), HasSubstr("byte order"));
}

TEST(MeshFile, IsRefusedWhereATetrahedronHasTwoMaterials) {
  const std::string text =
      "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n0 0 0 1\n1 0 0 0 1 1 1 2 5 6 0\n$EndEntities\n"
      "$Nodes\n1 4 1 4\n3 1 0 4\n1\n2\n3\n4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n$EndNodes\n"
      "$Elements\n1 1 1 1\n3 1 4 1\n1 1 2 3 4\n$EndElements\n";
  EXPECT_THAT(refusal(text), HasSubstr("physical volumes 5 and 6"));
}

TEST(MeshFile, ReadsParametricNodesAndSurfacesInSeveralGroups) {
  // gmsh writes u, v after the coordinates of a node on a surface when Mesh.SaveParametric is on.
  const std::string text =
      "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n2 5 \"top\"\n2 6 \"all\"\n$EndPhysicalNames\n"
      "$Entities\n1 0 1 1\n1 0 0 0 0\n4 0 0 0 1 1 1 2 5 -6 0\n1 0 0 0 1 1 1 0 1 4\n$EndEntities\n"
      "$Nodes\n2 4 1 4\n2 4 1 3\n1\n2\n3\n0 0 0 .1 .2\n1 0 0 .3 .4\n0 1 0 .5 .6\n3 1 0 1\n4\n0 0 1\n$EndNodes\n"
      "$Elements\n2 2 1 2\n2 4 2 1\n1 1 3 2\n3 1 4 1\n2 1 2 3 4\n$EndElements\n";
  const auto mesh = parse_mesh(text, "x");
  EXPECT_EQ(mesh.nodes[3], (std::array<double, 3>{0, 0, 1}));
  ASSERT_EQ(mesh.patches.size(), 2u);
  EXPECT_EQ(mesh.patches[0].name, "top");
  EXPECT_EQ(mesh.patches[1].name, "all");
  EXPECT_EQ(mesh.patches[0].triangles, mesh.patches[1].triangles);
}

TEST(MeshFile, ThatIsMissingOrAFolderIsRefused) {
  EXPECT_THROW(read_mesh(scratch("missing")), InputError);
  EXPECT_THROW(read_mesh(testing::TempDir()), InputError);
  EXPECT_THROW(read_mesh("/dev/zero"), InputError);
}

TEST(MeshFile, CannotHoldNamesWithQuotes) {
  auto mesh = two_regions();
  mesh.region_names[0] = "a \"b\"";
  EXPECT_THROW(write_mesh(scratch("msh"), mesh), InputError);
  EXPECT_FALSE(std::filesystem::exists(scratch("msh")));
}

TEST(BoundaryTriangles, EncloseTheVolumeOfTheTetrahedra) {
  // Divergence theorem: the sum of x . n over outward triangles is three times the volume; inside faces would not
  // cancel.
  const auto mesh = two_regions();
  double volume = 0;
  for (const auto& t : boundary_triangles(mesh)) {
    const auto &a = mesh.nodes[t[0]], &b = mesh.nodes[t[1]], &c = mesh.nodes[t[2]];
    volume +=
        (a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0])) /
        6;
  }
  EXPECT_NEAR(volume, 0.7 / 3, 1e-15);  // about 100 terms of 1e-3, each rounded at 1e-19
  EXPECT_EQ(boundary_triangles(mesh).size(), 2u * 2 * (3 * 2 + 3 * 2 + 2 * 2));
}

TEST(BoundaryTriangles, RefuseAFaceOfThreeTetrahedra) {
  TetrahedralMesh mesh;
  mesh.nodes.resize(6);
  mesh.tetrahedra = {{0, 1, 2, 3}, {0, 2, 1, 4}, {0, 1, 2, 5}};
  EXPECT_THROW(boundary_triangles(mesh), InputError);
}

TEST(MeshFile, ReadsNumbersWithAPlus) {
  Small small;
  small.nodes = "+4\n1 0 0 0\n2 +1.0e+00 0 0\n3 0 +1 0\n+4 0 -0 +1\n";
  small.elements = "1\n1 4 2 7 9 +1 2 3 4\n";
  EXPECT_EQ(parse_mesh(small.text(), "x").nodes, parse_mesh(Small{}.text(), "x").nodes);
  small.nodes = "4\n1 0 0 0\n2 +-1 0 0\n3 0 1 0\n4 0 0 1\n";
  EXPECT_THAT(refusal(small.text()), HasSubstr("found '+-1'"));
}

TEST(MeshFile, ReadsANodeAtNanThatNoTetrahedronUses) {
  Small small;
  small.nodes = "5\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 nan inf 0\n";
  EXPECT_EQ(parse_mesh(small.text(), "x").nodes, parse_mesh(Small{}.text(), "x").nodes);
  small.elements = "1\n1 4 2 7 9 1 2 3 5\n";
  EXPECT_THAT(refusal(small.text()), AllOf(HasSubstr("line 10"), HasSubstr("node 5 ")));
}

TEST(MeshFile, ReadsNumbersThatItDoesNotNeedWhateverTheyAre) {
  const std::string mesh =
      "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n0 0 0 1\n1 -1.#IND nan 0 1.#INF inf 0 0 0\n$EndEntities\n"
      "$Nodes\n1 4 1 4\n3 1 1 4\n1\n2\n3\n4\n0 0 0 nan 0 0\n1 0 0 0 -1.#IND 0\n0 1 0 0 0 0\n0 0 1 0 0 0\n$EndNodes\n"
      "$Elements\n1 1 1 1\n3 1 4 1\n1 1 2 3 4\n$EndElements\n$NodeData\n1\n\"x\"\n1\nnan\n$EndNodeData\n";
  EXPECT_EQ(parse_mesh(mesh, "x").nodes, parse_mesh(Small{}.text(), "x").nodes);
}

}  // namespace
}  // namespace palpate
