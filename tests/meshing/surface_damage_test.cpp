// Runs palpate-surface on damaged input: it must exit with code 2, print one sentence that states the place and the
// fault, and leave no file.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <limits>
#include <random>

#include "meshing/surface/surface_file.h"
#include "tests/meshing/run_surface.h"
#include "tests/meshing/surface_images.h"
#include "tests/support/closed_surfaces.h"
#include "tests/support/texts.h"

namespace palpate {
namespace {

using namespace tests;
using testing::AllOf;
using testing::HasSubstr;

class SurfaceDamage : public testing::Test {
 protected:
  const std::filesystem::path folder_ = fresh_folder();
  const ShapeImage ball_ = upright_image({24, 24, 24}, ellipsoid(9, 9, 9, 7));

  template <class Matcher>
  void expect_refused(const std::string& name, const std::string& bytes, const Matcher& says,
                      const std::string& more = "") {
    write_bytes(folder_ / name, bytes);
    expect_refused_input(name, says, more);
  }
  template <class Matcher>
  void expect_refused_input(const std::string& name, const Matcher& says, const std::string& more = "") {
    const std::filesystem::path out = folder_ / "out.off";
    const ProgramRun run =
        run_surface(folder_, (folder_ / name).string() + " --triangles 200 -o " + out.string() + " " + more, 2);
    std::string sentences;  // without the notes and warnings that came before the error
    std::istringstream lines(run.errors);
    int errors = 0;
    for (std::string line; std::getline(lines, line);) {
      if (line.starts_with("note: ") || line.starts_with("warning: ")) continue;
      sentences += line;
      ++errors;
    }
    EXPECT_EQ(errors, 1) << run.errors;
    EXPECT_THAT(sentences, AllOf(HasSubstr(name), says));
    EXPECT_FALSE(std::filesystem::exists(out));
    EXPECT_FALSE(std::filesystem::exists(out.string() + ".part"));
  }
};

TEST_F(SurfaceDamage, AbsentLabelListsThoseThereAre) {
  expect_refused("a.nrrd", as_nrrd(ball_, false, false), AllOf(HasSubstr("label 255"), HasSubstr("7 (")),
                 "--labels 255");
}

TEST_F(SurfaceDamage, EachLabelMustBeInTheImage) {
  ShapeImage two = ball_;
  two.values[0] = 3;
  expect_refused("a.nrrd", as_nrrd(two, false, false),
                 AllOf(HasSubstr("label 5 and label 13"), HasSubstr(", 3 (1 voxels), 7 (")), "--labels 13,7,5");
}

TEST_F(SurfaceDamage, LabelsOfTheWrongByteOrderGetAHint) {
  ShapeImage shape = ball_;
  std::string text = replaced(as_nrrd(shape, false, false), "unsigned char", "ushort");
  text = replaced(text, "encoding: raw", "endian: big\nencoding: raw");
  const std::size_t head = text.size() - shape.values.size();
  std::string wide = text.substr(0, head);
  for (const std::uint8_t v : shape.values) wide += {static_cast<char>(v), '\0'};  // little-endian
  expect_refused("a.nrrd", wide, AllOf(HasSubstr("1792"), HasSubstr("byte order")), "--labels 7");
}

TEST_F(SurfaceDamage, EmptyAndForeignImagesAreRefused) {
  ShapeImage zero = ball_;
  std::fill(zero.values.begin(), zero.values.end(), std::uint8_t{0});
  expect_refused("zero.nrrd", as_nrrd(zero, false, false), HasSubstr("0 everywhere"));
  expect_refused("empty.nrrd", "", HasSubstr("empty"));
  expect_refused("empty.inr.gz", "", HasSubstr("empty"));
  for (const char* name : {"a.inr", "a.nrrd", "a.nii", "a.mha"}) {
    expect_refused(name, "this is a letter, not an image\n", HasSubstr("expected"));
  }
  expect_refused_input("absent.nrrd", HasSubstr("nothing"));
  expect_refused("notes.txt", "hello", HasSubstr(".nrrd"));
}

TEST_F(SurfaceDamage, SeveralLabelsAskForAChoice) {
  ShapeImage two = ball_;
  two.values[0] = 3;
  expect_refused("two.nrrd", as_nrrd(two, false, false), AllOf(HasSubstr("3 (1 voxels)"), HasSubstr("--labels")));
}

TEST_F(SurfaceDamage, CutOffImagesAreRefusedInEveryFormat) {
  const auto half = [](const std::string& bytes) { return bytes.substr(0, bytes.size() / 2); };
  expect_refused("a.nrrd", half(as_nrrd(ball_, false, false)), HasSubstr("bytes"));
  expect_refused("b.nrrd", half(as_nrrd(ball_, false, true)), HasSubstr("cut off"));
  expect_refused("a.mha", half(as_meta(ball_)), HasSubstr("bytes"));
  expect_refused("a.nii", half(as_nifti(ball_, 2)), HasSubstr("bytes"));
  expect_refused("a.nii.gz", half(gzipped(as_nifti(ball_, 2))), HasSubstr("cut off"));
  expect_refused("a.inr", half(as_inr(ball_)), HasSubstr("bytes"));
  expect_refused("a.inr.gz", half(gzipped(as_inr(ball_))), HasSubstr("cut off"));
  std::string corrupt = gzipped(as_inr(ball_));
  for (std::size_t b = 40; b < 60; ++b) corrupt[b] = static_cast<char>(~corrupt[b]);
  expect_refused("b.inr.gz", corrupt, HasSubstr("corrupt"));
}

TEST_F(SurfaceDamage, DimensionsThatNoFileHoldsAreRefusedBeforeMemoryIsTaken) {
  expect_refused("a.nrrd", replaced(as_nrrd(ball_, false, false), "sizes: 24 24 24", "sizes: 99999 99999 99999"),
                 HasSubstr("bytes"));
  expect_refused("b.nrrd",
                 replaced(as_nrrd(ball_, false, false), "sizes: 24 24 24", "sizes: 2000000000 2000000000 2000000000"),
                 HasSubstr("dimensions"));
  expect_refused("c.nrrd", replaced(as_nrrd(ball_, false, true), "sizes: 24 24 24", "sizes: 9999 9999 9999"),
                 HasSubstr("bytes"));
  expect_refused("d.nrrd", replaced(as_nrrd(ball_, false, false), "sizes: 24 24 24", "sizes: 24 -24 24"),
                 HasSubstr("dimensions"));
  expect_refused("a.mha", replaced(as_meta(ball_), "DimSize = 24 24 24", "DimSize = 24 0 24"), HasSubstr("dimensions"));
  expect_refused("b.mha", replaced(as_meta(ball_), "NDims = 3", "NDims = 1000000"), HasSubstr("NDims"));
  expect_refused("a.inr.gz", gzipped(replaced(as_inr(ball_), "XDIM=24", "XDIM=4294967295")), HasSubstr("dimensions"));
  expect_refused("b.inr", replaced(as_inr(ball_), "XDIM=24", "XDIM=24\nXDIM=99999999"), HasSubstr("twice"));
  std::string nifti = as_nifti(ball_, 2);
  const std::int16_t huge = 32767;
  for (std::size_t d = 0; d < 3; ++d) std::memcpy(nifti.data() + 42 + 2 * d, &huge, 2);
  expect_refused("a.nii", nifti, HasSubstr("bytes"));
  expect_refused("b.nii.gz", gzipped(nifti), HasSubstr("bytes"));
}

TEST_F(SurfaceDamage, VoxelSizesMustBeAboveZero) {
  expect_refused("a.inr", replaced(as_inr(ball_), "VY=1", "VY=0"), HasSubstr("voxel sizes above 0"));
  expect_refused("b.inr", replaced(as_inr(ball_), "VY=1", "VY=-1"), HasSubstr("voxel sizes above 0"));
  expect_refused("c.inr", replaced(as_inr(ball_), "VY=1", "VY=nan"), HasSubstr("voxel sizes above 0"));
  expect_refused("a.mha", replaced(as_meta(ball_), "ElementSpacing = 1 1 1", "ElementSpacing = 1 0 1"),
                 HasSubstr("voxel sizes above 0"));
  expect_refused("a.nrrd", replaced(as_nrrd(ball_, false, false), "(0,1,0)", "(0,0,0)"), HasSubstr("a.nrrd"));
  expect_refused("b.nrrd", replaced(as_nrrd(ball_, false, false), "(0,1,0)", "(nan,1,0)"), HasSubstr("b.nrrd"));
  std::string nifti = as_nifti(ball_, 2);
  const float zero = 0;
  std::memcpy(nifti.data() + 84, &zero, 4);
  nifti[254] = 0;  // without the sform, which states the sizes too
  expect_refused("a.nii", nifti, HasSubstr("voxel sizes above 0"));
}

TEST_F(SurfaceDamage, DicomIsRefusedWithTheWayToExportIt) {
  const std::string dicom = std::string(128, '\0') + "DICM" + std::string(64, 'x');
  const auto says = AllOf(HasSubstr("found DICOM"), HasSubstr("3D Slicer"), HasSubstr(".nrrd"));
  expect_refused("seg.dcm", dicom, says);
  expect_refused("1.2.840.1", dicom, says);  // as scanners name them
  std::filesystem::create_directories(folder_ / "series");
  write_bytes(folder_ / "series" / "IM0001", dicom);
  expect_refused_input("series", says);
}

TEST_F(SurfaceDamage, SlicesAreRefusedWithAWayOn) {
  std::filesystem::create_directories(folder_ / "slices");
  expect_refused_input("slices", AllOf(HasSubstr("found a folder"), HasSubstr("NRRD or NIfTI")));
  expect_refused("slice1.png", "", AllOf(HasSubstr("found another ending"), HasSubstr("NRRD or NIfTI")));
  expect_refused_input("slice1.png", HasSubstr("one image or surface at a time"), (folder_ / "slice1.png").string());
}

// Remeshing such an image would take minutes.
TEST_F(SurfaceDamage, CheckerboardAndNoiseAreRefusedBeforeTheyAreRemeshed) {
  const ShapeImage board = upright_image({60, 60, 60}, [](const Point& p) {
    return static_cast<int>(std::floor(p[0]) + std::floor(p[1]) + std::floor(p[2]) + 300) % 2;
  });
  expect_refused("board.nrrd", as_nrrd(board, false, false), HasSubstr("pieces"));
  std::mt19937 random(3);
  const ShapeImage noise = upright_image({60, 60, 60}, [&](const Point&) { return static_cast<int>(random() % 2); });
  expect_refused("noise.nrrd", as_nrrd(noise, false, false), HasSubstr("handles"), "--smooth 0.5");
}

// --- surfaces

std::string as_off_text(const TriangleSurface& surface) {
  std::ostringstream text;
  text.precision(17);
  text << "OFF\n" << surface.points.size() << ' ' << surface.triangles.size() << " 0\n";
  for (const auto& [x, y, z] : surface.points) text << x << ' ' << y << ' ' << z << '\n';
  for (const auto& [a, b, c] : surface.triangles) text << "3 " << a << ' ' << b << ' ' << c << '\n';
  return text.str();
}

TEST_F(SurfaceDamage, OpenSurfaceSaysHowManyLoopsAndWhere) {
  TriangleSurface sphere = sphere_surface(2, 10);
  sphere.triangles.erase(sphere.triangles.begin() + 200);
  sphere.triangles.erase(sphere.triangles.begin() + 10);
  expect_refused("open.off", as_off_text(sphere),
                 AllOf(HasSubstr("2 open loops"), HasSubstr("6 free edges"), HasSubstr("near (")));
}

TEST_F(SurfaceDamage, SelfIntersectionSaysHowManyPairsAndWhere) {
  TriangleSurface a = sphere_surface(2, 10);
  const TriangleSurface b = sphere_surface(2, 6, {10, 0, 0});
  const auto first = static_cast<std::int32_t>(a.points.size());
  a.points.insert(a.points.end(), b.points.begin(), b.points.end());
  for (const auto& [p, q, r] : b.triangles) a.triangles.push_back({first + p, first + q, first + r});
  expect_refused("cross.off", as_off_text(a), AllOf(HasSubstr("intersect"), HasSubstr("near (")));
}

TEST_F(SurfaceDamage, NestedShellsThatAllPointOutwardAskWhatTheyAre) {
  TriangleSurface a = sphere_surface(2, 10);
  const TriangleSurface b = sphere_surface(2, 5);
  const auto first = static_cast<std::int32_t>(a.points.size());
  a.points.insert(a.points.end(), b.points.begin(), b.points.end());
  for (const auto& [p, q, r] : b.triangles) a.triangles.push_back({first + p, first + q, first + r});
  expect_refused("nested.off", as_off_text(a), AllOf(HasSubstr("cavity"), HasSubstr("--cavities")));
}

TEST_F(SurfaceDamage, BrokenSurfaceFilesNameTheLineOrByte) {
  const TriangleSurface sphere = sphere_surface(1, 10);
  const std::string off = as_off_text(sphere);  // 42 points, 80 triangles: faces from line 45
  expect_refused("a.off", replaced(off, "42 80 0", "42 81 0"), HasSubstr("cut off"));
  expect_refused("b.off", replaced(off, "42 80 0", "4000000000 80 0"), HasSubstr("do not fit"));
  expect_refused("c.off", off.substr(0, off.size() - 30), HasSubstr("cut off"));
  expect_refused("d.off", replaced(off, off.substr(12, off.find('\n', 12) - 12), "nan 0 0"),
                 AllOf(HasSubstr("line 3"), HasSubstr("nan")));
  expect_refused("e.off", off.substr(0, off.rfind("\n3 ")) + "\n3 0 1 42\n",
                 AllOf(HasSubstr("line 124"), HasSubstr("below 42")));
  expect_refused("f.off", off.substr(0, off.rfind("\n3 ")) + "\n3 0 1 3.7\n",
                 AllOf(HasSubstr("line 124"), HasSubstr("3.7")));
  expect_refused("g.off", off.substr(0, off.rfind("\n3 ")) + "\n2000000000 0 1 2\n",
                 AllOf(HasSubstr("line 124"), HasSubstr("2000000000")));
  expect_refused("h.off", replaced(off, off.substr(12, off.find('\n', 12) - 12), "1,5 0 0"),
                 AllOf(HasSubstr("line 3"), HasSubstr("1,5")));

  write_surface(folder_ / "good.stl", sphere);
  const std::string stl = file_bytes(folder_ / "good.stl");
  expect_refused("a.stl", stl.substr(0, stl.size() - 1), AllOf(HasSubstr("80 triangles"), HasSubstr("4084 bytes")));
  std::string nan = stl;
  const float bad = std::numeric_limits<float>::quiet_NaN();
  std::memcpy(nan.data() + 84 + 50 * 3 + 12, &bad, 4);
  expect_refused("b.stl", nan, AllOf(HasSubstr("triangle 3"), HasSubstr("byte 234")));
  expect_refused("c.stl", "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n",
                 HasSubstr("cut off"));
  expect_refused("d.stl",
                 "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n"
                 "endfacet\n",
                 HasSubstr("open loop"));

  write_surface(folder_ / "good.ply", sphere);
  const std::string ply = file_bytes(folder_ / "good.ply");
  expect_refused("a.ply", ply.substr(0, ply.size() - 7), HasSubstr("cut off"));
  expect_refused("b.ply", replaced(ply, "element vertex 42", "element vertex 99999999999"), HasSubstr("do not fit"));
  std::string out_of_range = ply;
  const std::int32_t far_index = 1000;
  std::memcpy(out_of_range.data() + ply.size() - 4, &far_index, 4);
  expect_refused("c.ply", out_of_range, AllOf(HasSubstr("face 79"), HasSubstr("1000")));

  expect_refused("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", AllOf(HasSubstr("line 4"), HasSubstr("below 3")));
  expect_refused("b.obj", "v 0 0 0\nv 1 0 inf\nv 0 1 0\nf 1 2 3\n", AllOf(HasSubstr("line 2"), HasSubstr("inf")));
  expect_refused("c.obj", "v 0 0 0\n", HasSubstr("no triangles"));
}

TEST_F(SurfaceDamage, OptionsThatDoNotFitTheInputAreRefused) {
  write_surface(folder_ / "good.off", sphere_surface(2, 10));
  expect_refused_input("good.off", HasSubstr("for images"), "--labels 1");
}

}  // namespace
}  // namespace palpate
