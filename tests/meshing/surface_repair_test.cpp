// Tests each repair of a segmented surface and each file format of surfaces.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "meshing/surface/extract_surface.h"
#include "meshing/surface/offset_to_volume.h"
#include "meshing/surface/repair_surface.h"
#include "meshing/surface/surface_checks.h"
#include "meshing/surface/surface_file.h"
#include "meshing/surface/triangle_soup.h"
#include "tests/meshing/run_surface.h"
#include "tests/meshing/surface_images.h"
#include "tests/support/closed_surfaces.h"

namespace palpate {
namespace {

using namespace tests;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const PieceFilter kOnePercent{PieceFilter::Kind::share, 0.01};

class SurfaceRepair : public testing::Test {
 protected:
  TriangleSurface sphere_ = sphere_surface(3, 10, {4, 5, 6});
  const double volume_ = enclosed_volume(sphere_);

  // the result must be the sphere, after the one repair that the sentence names
  void expect_repaired(const TriangleSurface& damaged, const std::string& sentence) {
    const RepairedSurface repaired = repair_surface(damaged, kOnePercent, "", "sphere");
    EXPECT_THAT(repaired.repairs, Contains(HasSubstr(sentence)));
    EXPECT_EQ(first_defect(repaired.surface), "");
    EXPECT_NEAR(enclosed_volume(repaired.surface), volume_, 1e-9 * volume_);
    EXPECT_EQ(repaired.surface.points.size(), sphere_.points.size());
  }
  static void append(TriangleSurface& to, const TriangleSurface& more) {
    const auto first = static_cast<std::int32_t>(to.points.size());
    to.points.insert(to.points.end(), more.points.begin(), more.points.end());
    for (const auto& [a, b, c] : more.triangles) to.triangles.push_back({first + a, first + b, first + c});
  }
};

TEST_F(SurfaceRepair, GoodSurfaceIsLeftAlone) {
  const RepairedSurface repaired = repair_surface(sphere_, kOnePercent, "", "sphere");
  EXPECT_THAT(repaired.repairs, IsEmpty());
  EXPECT_EQ(repaired.surface.triangles.size(), sphere_.triangles.size());
}

TEST_F(SurfaceRepair, PointsRepeatedByEveryTriangleAreMerged) {
  TriangleSurface soup;
  std::mt19937 random(1);
  for (const Triangle& t : sphere_.triangles) {
    const auto first = static_cast<std::int32_t>(soup.points.size());
    for (const std::int32_t p : t) {
      // less than the tolerance, which is 1e-6 of the diagonal of 35 mm
      const double noise = 1e-6 * static_cast<double>(random() % 10);
      soup.points.push_back(sphere_.points[p] + Point{noise, 0, -noise});
    }
    soup.triangles.push_back({first, first + 1, first + 2});
  }
  const RepairedSurface repaired = repair_surface(soup, kOnePercent, "", "sphere");
  EXPECT_THAT(repaired.repairs, ElementsAre(HasSubstr("repeated points merged")));
  EXPECT_EQ(repaired.surface.points.size(), sphere_.points.size());
  // the points move by up to 1e-5 mm on a radius of 10 mm
  EXPECT_NEAR(enclosed_volume(repaired.surface) / volume_, 1, 1e-5);
}

TEST_F(SurfaceRepair, MixedOrientationIsTurned) {
  for (std::size_t t = 0; t < sphere_.triangles.size(); t += 5)
    std::swap(sphere_.triangles[t][0], sphere_.triangles[t][1]);
  expect_repaired(sphere_, "256 triangles turned");
}

TEST_F(SurfaceRepair, InsideOutIsTurned) {
  for (Triangle& t : sphere_.triangles) std::swap(t[0], t[1]);
  expect_repaired(sphere_, "1 shells turned");
}

TEST_F(SurfaceRepair, DegenerateTrianglesAndIsolatedPointsAreDropped) {
  TriangleSurface damaged = sphere_;
  damaged.triangles.push_back({3, 3, 7});
  expect_repaired(damaged, "fewer than three points");
  damaged = sphere_;
  damaged.points.push_back({100, 100, 100});
  expect_repaired(damaged, "1 isolated points");
  damaged = sphere_;
  damaged.triangles.push_back(damaged.triangles[10]);
  expect_repaired(damaged, "1 repeated triangles");
}

TEST_F(SurfaceRepair, FlatTrianglesOfThreePointsAreCollapsed) {
  // a point lies in the middle of an edge, on one side only: two triangles there and a flat one that closes the gap
  TriangleSurface damaged = sphere_;
  const auto [a, b, c] = damaged.triangles[0];
  const auto middle = static_cast<std::int32_t>(damaged.points.size());
  damaged.points.push_back(0.5 * (damaged.points[a] + damaged.points[b]));
  damaged.triangles[0] = {a, middle, c};
  damaged.triangles.push_back({middle, b, c});
  damaged.triangles.push_back({a, b, middle});
  const RepairedSurface repaired = repair_surface(damaged, kOnePercent, "", "sphere");
  EXPECT_EQ(first_defect(repaired.surface), "");
  // the volume is that of the sphere, whichever way the coordinates of the middle round
  EXPECT_NEAR(enclosed_volume(repaired.surface), volume_, 1e-9 * volume_);
}

TEST_F(SurfaceRepair, DanglingFinIsDropped) {
  TriangleSurface damaged = sphere_;
  const Triangle t = damaged.triangles[0];
  damaged.points.push_back({20, 20, 20});
  damaged.points.push_back({21, 20, 20});
  const auto tip = static_cast<std::int32_t>(damaged.points.size()) - 2;
  damaged.triangles.push_back({t[0], t[1], tip});
  damaged.triangles.push_back({t[1], tip, tip + 1});
  expect_repaired(damaged, "2 triangles of fins");
}

TEST_F(SurfaceRepair, StrayShellIsDroppedByDefaultAndKeptOnRequest) {
  TriangleSurface damaged = sphere_;
  append(damaged, sphere_surface(1, 0.5, {40, 0, 0}));
  expect_repaired(damaged, "1 shells dropped");
  const RepairedSurface all = repair_surface(damaged, {PieceFilter::Kind::all, 0}, "", "sphere");
  EXPECT_EQ(split_shells(all.surface).size(), 2u);
}

TEST_F(SurfaceRepair, CavityIsKeptOrFilledAsAsked) {
  TriangleSurface inner = sphere_surface(2, 4, {4, 5, 6});
  const double cavity = enclosed_volume(inner);
  TriangleSurface outward = sphere_;
  append(outward, inner);
  for (Triangle& t : inner.triangles) std::swap(t[0], t[1]);
  TriangleSurface cavity_inward = sphere_;
  append(cavity_inward, inner);
  TriangleSurface all_reversed = cavity_inward;
  for (Triangle& t : all_reversed.triangles) std::swap(t[0], t[1]);

  const auto volume = [&](const TriangleSurface& surface, const std::string& cavities) {
    return enclosed_volume(repair_surface(surface, kOnePercent, cavities, "shells").surface);
  };
  EXPECT_NEAR(volume(cavity_inward, ""), volume_ - cavity, 1e-9 * volume_);
  EXPECT_NEAR(volume(all_reversed, ""), volume_ - cavity, 1e-9 * volume_);
  EXPECT_NEAR(volume(cavity_inward, "fill"), volume_, 1e-9 * volume_);
  EXPECT_NEAR(volume(outward, "keep"), volume_ - cavity, 1e-9 * volume_);
  EXPECT_NEAR(volume(outward, "fill"), volume_, 1e-9 * volume_);
}

TEST_F(SurfaceRepair, EveryFormatComesBackAsItWasWritten) {
  const std::filesystem::path folder = fresh_folder();
  for (const char* name : {"a.off", "a.ply", "a.obj"}) {
    write_surface(folder / name, sphere_);
    const TriangleSurface read = read_surface(folder / name, 1);
    EXPECT_EQ(read.points, sphere_.points) << name;
    EXPECT_EQ(read.triangles, sphere_.triangles) << name;
  }
  write_surface(folder / "a.stl", sphere_);
  const TriangleSurface read = repair_surface(read_surface(folder / "a.stl", 1), kOnePercent, "", "stl").surface;
  EXPECT_EQ(read.points.size(), sphere_.points.size());
  EXPECT_NEAR(enclosed_volume(read) / volume_, 1, 1e-6);  // binary STL has single precision
}

TEST_F(SurfaceRepair, BinaryStlMayBeginWithSolid) {
  const std::filesystem::path folder = fresh_folder();
  write_surface(folder / "a.stl", sphere_);
  std::fstream file(folder / "a.stl", std::ios::in | std::ios::out | std::ios::binary);
  file.write("solid facet", 11);
  file.close();
  EXPECT_EQ(read_surface(folder / "a.stl", 1).triangles.size(), sphere_.triangles.size());
}

TEST_F(SurfaceRepair, TextStlTextPlyAndQuadsAreRead) {
  const std::filesystem::path folder = fresh_folder();
  std::ostringstream stl;
  stl << "solid ball\n";
  stl.precision(9);
  for (const Triangle& t : sphere_.triangles) {
    stl << "facet normal 0 0 0\n outer loop\n";
    for (const std::int32_t p : t)
      stl << "  vertex " << sphere_.points[p][0] << ' ' << sphere_.points[p][1] << ' ' << sphere_.points[p][2] << '\n';
    stl << " endloop\nendfacet\n";
  }
  stl << "endsolid ball\n";
  write_bytes(folder / "a.stl", stl.str());
  EXPECT_NEAR(enclosed_volume(read_surface(folder / "a.stl", 1)) / volume_, 1, 1e-7);  // text STL has nine digits

  // a unit cube of quads, in metres
  write_bytes(folder / "cube.ply",
              "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\nproperty "
              "uchar red\n"
              "element face 6\nproperty list uchar int vertex_indices\nend_header\n"
              "0 0 0 9\n1 0 0 9\n1 1 0 9\n0 1 0 9\n0 0 1 9\n1 0 1 9\n1 1 1 9\n0 1 1 9\n"
              "4 0 3 2 1\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n");
  write_bytes(folder / "cube.obj",
              "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\nvn 0 0 1\n"
              "f 1//1 4//1 3//1 2//1\nf 5 6 7 8\nf -8 -7 -3 -4\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n");
  for (const char* name : {"cube.ply", "cube.obj"}) {
    const TriangleSurface cube = read_surface(folder / name, 1000);
    EXPECT_EQ(cube.triangles.size(), 12u);
    EXPECT_NEAR(enclosed_volume(cube), 1e9, 1e-3);
  }
}

// Text STL as programs write it: names with blanks and words of the format, other cases, "end" apart, no last line.
TEST_F(SurfaceRepair, TextStlIsReadHoweverItsWordsAreWritten) {
  const std::filesystem::path folder = fresh_folder();
  const auto tetrahedron = [](const std::string& name, const std::string& facet_end, const std::string& end) {
    std::ostringstream text;
    text << name << '\n';
    const std::array<const char*, 4> corner = {"0 0 0", "1 0 0", "0 1 0", "0 0 1"};
    for (const auto& [a, b, c] : {std::array<std::size_t, 3>{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}) {
      text << "  facet normal 0 0 0\n outer loop\n";
      for (const std::size_t p : {a, b, c}) text << "vertex " << corner[p] << '\n';
      text << facet_end;
    }
    text << end;
    return text.str();
  };
  const std::string plain = "endloop\nendfacet\n";
  int number = 0;
  for (const std::string& text :
       {tetrahedron("solid Left Kidney (v2)", plain, "endsolid Left Kidney (v2)\n"),
        tetrahedron("solid facet vertex 3", plain, "endsolid\n"), tetrahedron("solid", plain, "end solid\n"),
        tetrahedron(" \r\nSOLID Organ", "EndLoop\r\nENDFACET\r\n", "ENDSOLID Organ\r\n"),
        tetrahedron("solid a", "end loop\nend facet\n", "end solid a"), tetrahedron("solid a", plain, "")}) {
    const std::filesystem::path file = folder / fmt::format("{}.stl", number++);
    write_bytes(file, text);
    EXPECT_NEAR(enclosed_volume(read_surface(file, 1)), 1.0 / 6, 1e-15) << text;
  }
}

TEST_F(SurfaceRepair, PointsOfOffFilesMayHaveTextureCoordinatesColoursAndNormals) {
  const std::filesystem::path folder = fresh_folder();
  const auto with = [](const std::string& header, const std::string& rest) {
    const std::string end = rest + '\n';
    return header + "\n4 4 6\n0 0 0" + end + "1 0 0" + end + "0 1 0" + end + "0 0 1" + end +
           "3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3 255 0 0\n";
  };
  for (const auto& [header, rest] : std::map<std::string, std::string>{{"OFF", ""},
                                                                       {"COFF", " 255 0 0 255"},
                                                                       {"NOFF", " 0 0 1"},
                                                                       {"STOFF", " 0 .5"},
                                                                       {"STCNOFF", " 0 0 1 9 9 9 9 0 .5"}}) {
    write_bytes(folder / "a.off", with(header, rest));
    EXPECT_NEAR(enclosed_volume(read_surface(folder / "a.off", 1)), 1.0 / 6, 1e-15) << header;
  }
}

TEST_F(SurfaceRepair, RasFileIsTurnedToLps) {
  const std::filesystem::path folder = fresh_folder();
  write_bytes(folder / "a.obj", "# SPACE=RAS\nv 1 2 3\nv 4 5 6\nv 7 8 10\nf 1 2 3\n");
  EXPECT_THAT(read_surface(folder / "a.obj", 1).points, Contains((Point{-1, -2, 3})));
}

TEST_F(SurfaceRepair, SurfaceFarFromTheOriginWorks) {
  const std::filesystem::path folder = fresh_folder();
  TriangleSurface far = sphere_;
  translate(far, {1e7, -1e7, 1e7});
  write_surface(folder / "far.off", far);
  run_surface(folder, (folder / "far.off").string() + " --triangles 600 -o " + (folder / "out.ply").string());
  const TriangleSurface out = read_surface(folder / "out.ply", 1);
  // coordinates of 1e7 keep 2e-9 mm
  EXPECT_NEAR(enclosed_volume(out) / volume_, 1, 1e-8);
  EXPECT_NEAR(centroid_of_volume(out)[1], -1e7 + 5, 0.05);
  EXPECT_NEAR(static_cast<double>(out.triangles.size()), 600, 30);
}

TEST_F(SurfaceRepair, OffsetRestoresTheVolumeOfAGroup) {
  TriangleSurface small = sphere_surface(2, 3, {40, 0, 0});
  TriangleSurface big = sphere_;
  const double wanted = 1.1 * (enclosed_volume(small) + volume_);
  const double distance = offset_to_volume({&big, &small}, wanted);
  EXPECT_GT(distance, 0);
  EXPECT_NEAR(enclosed_volume(small) + enclosed_volume(big), wanted, 1e-9 * wanted);
  // the offset would have to exceed the mean edge
  EXPECT_TRUE(std::isnan(offset_to_volume({&big}, 8 * volume_)));
}

}  // namespace
}  // namespace palpate
