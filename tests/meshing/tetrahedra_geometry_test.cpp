#include <gmock/gmock.h>
#include <gmsh.h>
#include <gtest/gtest.h>

#include <atomic>
#include <csignal>
#include <fstream>

#include "formats/errors.h"
#include "formats/tetrahedral_mesh.h"
#include "meshing/tetrahedra/fill_with_tetrahedra.h"
#include "meshing/tetrahedra/gmsh_session.h"
#include "meshing/tetrahedra/in_child_process.h"
#include "meshing/tetrahedra/mesh_quality.h"
#include "meshing/tetrahedra/tetrahedra_from_geometry.h"
#include "studies/bodies/box_mesh.h"
#include "tests/meshing/run_tetrahedra.h"

namespace palpate {
namespace {

using testing::HasSubstr;
using tests::fresh_folder;

// Two stacked boxes, 1 x 1 x 0.5 each.
constexpr const char* kTwoLayers = R"(
DefineConstant[ h = 0.5 ];
Point(1) = {0,0,0,h}; Point(2) = {1,0,0,h}; Point(3) = {1,1,0,h}; Point(4) = {0,1,0,h};
Line(1) = {1,2}; Line(2) = {2,3}; Line(3) = {3,4}; Line(4) = {4,1};
Line Loop(1) = {1,2,3,4}; Plane Surface(1) = {1};
lower[] = Extrude {0,0,0.5} { Surface{1}; };
upper[] = Extrude {0,0,0.5} { Surface{lower[0]}; };
Physical Volume("lower") = {lower[1]};
Physical Volume("upper") = {upper[1]};
Physical Surface("bottom") = {1};
Physical Surface("between") = {lower[0]};
Physical Surface("top") = {upper[0]};
)";

std::filesystem::path write(const std::filesystem::path& file, const std::string& text) {
  std::ofstream(file) << text;
  return file;
}

std::string refusal(const std::string& geometry, const std::vector<std::string>& assignments = {}, double limit = 60) {
  const auto file = write(fresh_folder() / "bad.geo", geometry);
  FillOptions options;
  options.time_limit = limit;
  try {
    tetrahedra_from_geometry(file, assignments, options);
  } catch (const InputError& error) {
    return std::string("input: ") + error.what();
  } catch (const OperationError& error) {
    return std::string("operation: ") + error.what();
  }
  return "accepted";
}

TEST(MeshGeometry, PhysicalGroupsBecomeRegionsAndPatches) {
  const auto file = write(fresh_folder() / "layers.geo", kTwoLayers);
  const TetrahedralMesh mesh = tetrahedra_from_geometry(file, {}, {});
  EXPECT_EQ(mesh.region_names, (std::vector<std::string>{"lower", "upper"}));
  const MeshQuality quality = measure_quality(mesh);
  EXPECT_NEAR(quality.region_volume[0], 0.5, 1e-12);  // the faces are planar, so only rounding differs
  EXPECT_NEAR(quality.region_volume[1], 0.5, 1e-12);
  EXPECT_GT(quality.volume.value, 0);
  std::vector<std::string> names;
  for (const auto& patch : mesh.patches) {
    names.push_back(patch.name);
    const double z = patch.name == "bottom" ? 0 : patch.name == "between" ? 0.5 : 1;
    EXPECT_GT(patch.triangles.size(), 1u);
    for (const auto& t : patch.triangles)
      for (const auto v : t) EXPECT_NEAR(mesh.nodes[v][2], z, 1e-12);
  }
  EXPECT_EQ(names, (std::vector<std::string>{"bottom", "between", "top"}));
}

TEST(MeshGeometry, AParameterCanBeSet) {
  const auto file = write(fresh_folder() / "layers.geo", kTwoLayers);
  EXPECT_GT(tetrahedra_from_geometry(file, {"h=0.2"}, {}).nodes.size(),
            2 * tetrahedra_from_geometry(file, {}, {}).nodes.size());
  EXPECT_THAT(refusal(kTwoLayers, {"thickness=2"}), HasSubstr("no DefineConstant"));
  EXPECT_THAT(refusal(kTwoLayers, {"h=thin"}), HasSubstr("NAME=NUMBER"));
}

TEST(MeshGeometry, WhatIsNoSoundGeometryIsRefused) {
  EXPECT_THAT(refusal("Point(1) = {0,0,0"), HasSubstr("input: "));
  EXPECT_THAT(refusal("Point(1) = {0,0,0};"), HasSubstr("no volume"));
  EXPECT_THAT(refusal("// nothing\nSystemCall \"touch /tmp/x\";"), HasSubstr("line 2: \"SystemCall\""));
  EXPECT_THAT(refusal("Exit;"), HasSubstr("refused"));
  EXPECT_THAT(refusal("Merge \"/etc/passwd\";"), HasSubstr("refused"));
  EXPECT_THAT(refusal(std::string(kTwoLayers) + "Physical Volume(\"again\") = {lower[1]};"),
              HasSubstr("two physical volumes"));
  EXPECT_THAT(refusal(std::string(kTwoLayers) + "Mesh.ElementOrder = 2;"), HasSubstr("only linear"));
  EXPECT_THAT(refusal("For i In {1 : 1000000000}\n a = i;\nEndFor\n", {}, 1), HasSubstr("did not finish within 1 s"));
}

// The tip of the upper pyramid comes out of the base of the lower one, so gmsh finds no tetrahedra.
TEST(MeshGeometry, AFailureOfGmshNamesFilePlaceAndCure) {
  const char* crossing = R"(
h = 0.5;
Point(1) = {0,0,0,h}; Point(2) = {1,0,0,h}; Point(3) = {1,1,0,h}; Point(4) = {0,1,0,h}; Point(5) = {0.5,0.5,-1,h};
Line(1) = {1,2}; Line(2) = {2,3}; Line(3) = {3,4}; Line(4) = {4,1};
Line(5) = {1,5}; Line(6) = {2,5}; Line(7) = {3,5}; Line(8) = {4,5};
Line Loop(1) = {1,2,3,4}; Plane Surface(1) = {1};
Line Loop(2) = {1,6,-5}; Plane Surface(2) = {2};
Line Loop(3) = {2,7,-6}; Plane Surface(3) = {3};
Line Loop(4) = {3,8,-7}; Plane Surface(4) = {4};
Line Loop(5) = {4,5,-8}; Plane Surface(5) = {5};
Point(11) = {0.2,0.2,-0.2,h}; Point(12) = {0.8,0.2,-0.2,h}; Point(13) = {0.5,0.8,-0.2,h}; Point(14) = {0.5,0.5,0.5,h};
Line(11) = {11,12}; Line(12) = {12,13}; Line(13) = {13,11}; Line(14) = {11,14}; Line(15) = {12,14}; Line(16) = {13,14};
Line Loop(11) = {11,12,13}; Plane Surface(11) = {11};
Line Loop(12) = {11,15,-14}; Plane Surface(12) = {12};
Line Loop(13) = {12,16,-15}; Plane Surface(13) = {13};
Line Loop(14) = {13,14,-16}; Plane Surface(14) = {14};
Surface Loop(1) = {1,2,3,4,5}; Surface Loop(2) = {11,12,13,14};
Volume(1) = {1,2};
Volume(2) = {2};
)";
  EXPECT_THAT(refusal(crossing), AllOf(HasSubstr("bad.geo: "), HasSubstr("between (0, 0, -1) and (1, 1, 0.5)"),
                                       HasSubstr("surfaces that cross")));
}

TEST(RunInChild, TurnsACrashIntoOneSentence) {
  const auto crash = []() -> std::string {
    raise(SIGSEGV);
    return "";
  };
  EXPECT_THAT([&] { run_in_child("mesher", 10, crash); },
              testing::ThrowsMessage<OperationError>(HasSubstr("Segmentation fault")));
  EXPECT_EQ(run_in_child("mesher", 10, [] { return std::string(1 << 20, 'x'); }).size(), std::size_t{1} << 20);
}

TEST(RunInChild, StopsAChildThatUsesUpItsProcessorTime) {
  const auto turn = []() -> std::string {
    std::atomic<int> turns = 0;
    while (turns >= 0) turns = 1;
    return "";
  };
  EXPECT_THAT([&] { run_in_child("mesher", 600, turn, 1); },
              testing::ThrowsMessage<OperationError>(HasSubstr("within 1 s")));
}

// Writes a mesh with gmsh in the given version and encoding.
void write_by_gmsh(const std::filesystem::path& ours, const std::filesystem::path& theirs, double version,
                   bool binary) {
  run_in_child("gmsh", 60, [&] {
    GmshSession session;
    gmsh::open(ours.string());
    gmsh::option::setNumber("Mesh.MshFileVersion", version);
    gmsh::option::setNumber("Mesh.Binary", binary);
    gmsh::write(theirs.string());
    return std::string("done");
  });
}

TEST(MeshFiles, OursIsReadByGmshAndGmshsBackToTheSameMesh) {
  const auto folder = fresh_folder();
  TetrahedralMesh mesh = box_mesh({3, 2, 2}, {3, 2, 2}, 0.1);
  mesh.region_names = {"left", "right"};
  for (std::size_t e = 0; e < mesh.tetrahedra.size(); ++e) mesh.region[e] = mesh.nodes[mesh.tetrahedra[e][0]][0] >= 1.5;
  write_mesh(folder / "ours.msh", mesh);
  const TetrahedralMesh reread = read_mesh(folder / "ours.msh");
  for (const double version : {2.2, 4.1})
    for (const bool binary : {false, true}) {
      SCOPED_TRACE(testing::Message() << "MSH " << version << (binary ? " binary" : " text"));
      write_by_gmsh(folder / "ours.msh", folder / "theirs.msh", version, binary);
      const TetrahedralMesh theirs = read_mesh(folder / "theirs.msh");
      EXPECT_EQ(theirs.region_names, reread.region_names);
      ASSERT_EQ(theirs.nodes.size(), reread.nodes.size());
      ASSERT_EQ(theirs.tetrahedra.size(), reread.tetrahedra.size());
      // gmsh's text format has 16 digits; its binary format keeps all bits
      for (std::size_t v = 0; v < theirs.nodes.size(); ++v)
        for (int d = 0; d < 3; ++d) EXPECT_NEAR(theirs.nodes[v][d], reread.nodes[v][d], binary ? 0 : 1e-15 * 3);
      EXPECT_TRUE(theirs.tetrahedra == reread.tetrahedra);
      EXPECT_TRUE(theirs.region == reread.region);
      ASSERT_EQ(theirs.patches.size(), reread.patches.size());
      for (std::size_t p = 0; p < theirs.patches.size(); ++p) {
        EXPECT_EQ(theirs.patches[p].name, reread.patches[p].name);
        EXPECT_TRUE(theirs.patches[p].triangles == reread.patches[p].triangles);
      }
    }
}

}  // namespace
}  // namespace palpate
