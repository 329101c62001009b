// One surface in every form that its format allows: points and triangles are the same.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <sstream>

#include "formats/program.h"
#include "meshing/surface/repair_surface.h"
#include "meshing/surface/surface_file.h"
#include "tests/meshing/surface_images.h"
#include "tests/support/closed_surfaces.h"
#include "tests/support/program_run.h"
#include "tests/support/texts.h"

namespace palpate {
namespace {

using namespace tests;
using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr const char* kMark = "\xEF\xBB\xBF";  // the byte order mark of UTF-8

std::string exact(double x) {
  char text[40];
  std::snprintf(text, sizeof text, "%+.17e", x);
  return text;
}

// How a text writes a point, and what follows it.
using WritePoint = std::function<std::string(const Point&)>;
std::string plain(const Point& p) {
  return exact(p[0]) + " " + exact(p[1]) + " " + exact(p[2]);
}

class SurfaceForms : public testing::Test {
 protected:
  SurfaceForms() { forget_warnings(); }

  const std::filesystem::path folder_ = fresh_folder();
  const TriangleSurface surface_ = sphere_surface(1, 10, {3, 2, 1});

  // between: what stands between the corners of a face. extra: a point that no face uses, before the others.
  std::string off(const std::string& between = " ", const std::string& extra = "") const {
    std::ostringstream text;
    const std::int32_t first = extra.empty() ? 0 : 1;
    text << "OFF\n"
         << surface_.points.size() + static_cast<std::size_t>(first) << ' ' << surface_.triangles.size() << " 0\n"
         << extra;
    for (const Point& p : surface_.points) text << plain(p) << '\n';
    for (const auto& [a, b, c] : surface_.triangles)
      text << "3 " << a + first << between << b + first << between << c + first << '\n';
    return text.str();
  }
  std::string obj(const std::string& between = " ", const std::string& extra = "") const {
    std::ostringstream text;
    const std::int32_t first = extra.empty() ? 1 : 2;
    text << "# a ball\n" << extra << "vn nan nan nan\n";
    for (const Point& p : surface_.points) text << "v " << plain(p) << '\n';
    for (const auto& [a, b, c] : surface_.triangles)
      text << "f " << a + first << between << b + first << between << c + first << '\n';
    return text.str();
  }
  std::string ply(const std::string& extra = "") const {
    std::ostringstream text;
    const std::int32_t first = extra.empty() ? 0 : 1;
    text << "ply\nformat ascii 1.0\nelement vertex " << surface_.points.size() + static_cast<std::size_t>(first)
         << "\nproperty double x\nproperty double y\nproperty double z\nproperty float quality\nelement face "
         << surface_.triangles.size()
         << "\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\nend_header\n"
         << extra;
    for (const Point& p : surface_.points) text << plain(p) << " -1.#IND\n";
    for (const auto& [a, b, c] : surface_.triangles)
      text << "3 " << a + first << ' ' << b + first << ' ' << c + first << " 2 nan -nan(ind)\n";
    return text.str();
  }
  std::string stl() const {
    std::ostringstream text;
    text << "solid ball\n";
    for (const Triangle& t : surface_.triangles) {
      text << "facet normal nan nan nan\nouter loop\n";
      for (const std::int32_t p : t) text << "vertex " << plain(surface_.points[p]) << '\n';
      text << "endloop\nendfacet\n";
    }
    text << "endsolid ball\n";
    return text.str();
  }

  void expect_surface(const std::string& name, const std::string& bytes) const {
    SCOPED_TRACE(name);
    write_bytes(folder_ / name, bytes);
    TriangleSurface read;
    ASSERT_NO_THROW(read = read_surface(folder_ / name, 1));
    ASSERT_EQ(read.triangles.size(), surface_.triangles.size());
    EXPECT_EQ(read.points.size(), surface_.points.size());
    for (std::size_t t = 0; t < read.triangles.size(); ++t)
      for (int c = 0; c < 3; ++c)
        ASSERT_EQ(read.points[read.triangles[t][c]], surface_.points[surface_.triangles[t][c]]);  // 17 digits are exact
  }
  template <class Matcher>
  void expect_refused(const std::string& name, const std::string& bytes, const Matcher& says) const {
    SCOPED_TRACE(name);
    write_bytes(folder_ / name, bytes);
    EXPECT_THAT(input_error([&] { read_surface(folder_ / name, 1); }), AllOf(HasSubstr(name), says));
  }
};

TEST_F(SurfaceForms, NumbersWithAPlusAreNumbers) {
  expect_surface("a.off", off(" +"));
  expect_surface("a.obj", obj(" +"));
  expect_surface("a.stl", stl());
  expect_refused("b.off", off(" +-"), HasSubstr("found '+-"));
}

TEST_F(SurfaceForms, AByteOrderMarkIsPassedOver) {
  expect_surface("a.off", kMark + off());
  const std::string obj_file = obj();
  expect_surface("a.obj",
                 kMark + obj_file.substr(obj_file.find("v ")));  // the mark in front of a point, not of a comment
  expect_surface("a.ply", kMark + ply());
  expect_surface("a.stl", kMark + stl());
}

TEST_F(SurfaceForms, LinesGoOnWhereTheFormatSaysSo) {
  expect_surface("a.obj", obj(" \\\n "));
  expect_surface("b.obj", obj(" \\\r\n\t"));
  expect_surface("c.obj", "g a \\\nf 1 2 3\n" + obj());  // the second line is a name
  expect_surface("a.off", off("\n"));
  expect_surface("b.off", off(" # the next corner\n\n  "));
  const std::string comment = "OFF # a ball\n# " + std::to_string(surface_.points.size());
  std::string header = off();
  expect_surface("c.off", header.replace(0, 3, comment + " points and so on\n"));
}

TEST_F(SurfaceForms, AFaceThatIsCutShortDoesNotTakeTheNextLine) {
  std::string text = off();
  const std::size_t end = text.find('\n', text.find("\n3 ") + 1);
  text.erase(text.rfind(' ', end), end - text.rfind(' ', end));  // the last corner of the first face
  expect_refused("a.off", text, AllOf(HasSubstr("line 46"), HasSubstr("line 45")));
}

TEST_F(SurfaceForms, WhatNobodyNeedsMayBeNotANumber) {
  expect_surface("a.obj", obj());  // normals
  expect_surface("a.ply", ply());  // another property of a point, and of a face
  expect_surface("a.stl", stl());  // normals
  // A point that no triangle uses.
  expect_surface("b.off", off(" ", "nan 0 inf\n"));
  expect_surface("b.obj", obj(" ", "v nan nan nan\n"));
  expect_surface("b.ply", ply("nan nan nan 0\n"));
  EXPECT_THAT(warnings(), IsEmpty());
  // One that a triangle uses.
  std::string text = ply("1 nan 2 0\n");
  const std::size_t first_corner = text.rfind("\n3 ") + 3;
  text.replace(first_corner, text.find(' ', first_corner) - first_corner, "0");
  expect_refused("c.ply", text, HasSubstr("vertex 0 "));
}

TEST_F(SurfaceForms, AnStlSharesItsPointsWithoutAWarning) {
  write_bytes(folder_ / "text.stl", stl());
  write_surface(folder_ / "binary.stl", surface_);
  for (const char* name : {"text.stl", "binary.stl"}) {
    const TriangleSurface read = read_surface(folder_ / name, 1);
    EXPECT_EQ(read.points.size(), surface_.points.size());
    EXPECT_THAT(repair_surface(read, {PieceFilter::Kind::all, 0}, "", name).repairs, IsEmpty()) << name;
  }
  // Points that are near and not the same are a fault of the file, and merged with a warning.
  std::string shifted = file_bytes(folder_ / "binary.stl");
  float x = 0;
  std::memcpy(&x, shifted.data() + 84 + 12, sizeof x);
  x = std::nextafter(x, 100.0f);
  std::memcpy(shifted.data() + 84 + 12, &x, sizeof x);
  write_bytes(folder_ / "shifted.stl", shifted);
  const auto repaired = repair_surface(read_surface(folder_ / "shifted.stl", 1), {PieceFilter::Kind::all, 0}, "", "x");
  EXPECT_THAT(repaired.repairs, testing::ElementsAre(HasSubstr("1 repeated points merged")));
}

}  // namespace
}  // namespace palpate
