// One image in every form that its format allows: sizes, directions and labels are the same, or the file is refused in
// one sentence.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nifti1_io.h>

#include <algorithm>
#include <cstring>
#include <limits>

#include "formats/program.h"
#include "meshing/image/label_image.h"
#include "meshing/image/label_names.h"
#include "tests/meshing/surface_images.h"
#include "tests/support/program_run.h"
#include "tests/support/texts.h"

namespace palpate {
namespace {

using namespace tests;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

template <class T>
void put(std::string& bytes, std::size_t at, T value) {
  std::memcpy(bytes.data() + at, &value, sizeof value);
}

std::string deflated(const std::string& bytes) {
  std::string packed(compressBound(bytes.size()), '\0');
  uLongf size = packed.size();
  compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
  packed.resize(size);
  return packed;
}

// Voxels of 2 x 3 x 4 mm off the origin, and an egg with a stalk: no two of its axes look alike, nor their ends.
class ImageFormats : public testing::Test {
 protected:
  ImageFormats() { forget_warnings(); }

  const std::filesystem::path folder_ = fresh_folder();
  const ShapeImage image_ = shape_image({10, 12, 14}, {{{2, 0, 0}, {0, -3, 0}, {0, 0, 4}}}, {-11, 7, 33}, egg);
  const std::string voxels_ = voxel_bytes(image_);
  const std::string nrrd_ = as_nrrd(image_, false, false), meta_ = as_meta(image_), nifti_ = as_nifti(image_, 2);

  static int egg(const Point& p) {
    const bool body = p[0] * p[0] / 49 + p[1] * p[1] / 100 + (p[2] + 6) * (p[2] + 6) / 225 < 1;
    const bool stalk = std::abs(p[0] - 3) < 2 && std::abs(p[1] - 4) < 3 && p[2] > 0 && p[2] < 24;
    return body ? 1 : stalk ? 2 : 0;
  }

  // The little-endian bytes of the labels as numbers of another type.
  template <class T>
  std::string as_numbers(bool big_endian = false) const {
    std::string bytes;
    for (const std::uint8_t label : image_.values) {
      std::array<char, sizeof(T)> raw;
      const T number = label;
      std::memcpy(raw.data(), &number, sizeof number);
      if (big_endian) std::reverse(raw.begin(), raw.end());
      bytes.append(raw.data(), raw.size());
    }
    return bytes;
  }
  std::string with_voxels(const std::string& file, const std::string& voxels) const {
    return file.substr(0, file.size() - voxels_.size()) + voxels;
  }

  LabelImage read(const std::string& name, const std::string& bytes) const {
    write_bytes(folder_ / name, bytes);
    return read_label_image((folder_ / name).string());
  }
  void expect_image(const std::string& name, const std::string& bytes) const {
    SCOPED_TRACE(name);
    LabelImage found;
    ASSERT_NO_THROW(found = read(name, bytes));
    ASSERT_EQ(found.grid.size, image_.grid.size);
    for (int c = 0; c < 3; ++c) {
      // millimetres of headers in other units are rounded by one product
      EXPECT_NEAR(found.grid.origin[c], image_.grid.origin[c], 1e-5);
      for (int a = 0; a < 3; ++a) EXPECT_NEAR(found.grid.axis[a][c], image_.grid.axis[a][c], 1e-6);
    }
    EXPECT_TRUE(std::equal(found.values.begin(), found.values.end(), image_.values.begin()));
  }
  template <class Matcher>
  void expect_refused(const std::string& name, const std::string& bytes, const Matcher& says) const {
    SCOPED_TRACE(name);
    EXPECT_THAT(input_error([&] { read(name, bytes); }), AllOf(HasSubstr(name), says));
  }
  // The NRRD with its positions in a space, whose x and y are those of LPS times the signs.
  std::string nrrd_in(const std::string& space, int x, int y, const std::string& scale = "") const {
    const auto vector = [&](Point p) {
      std::string text = triple({x * p[0], y * p[1], p[2]});
      std::replace(text.begin(), text.end(), ' ', ',');
      std::string bracketed = "(";
      return bracketed.append(text).append(scale).append(")");
    };
    return "NRRD0004\ntype: uint8\ndimension: 3\nspace: " + space + "\nsizes: " + sizes_of(image_) +
           "\nspace directions: " + vector(image_.grid.axis[0]) + " " + vector(image_.grid.axis[1]) + " " +
           vector(image_.grid.axis[2]) + "\nspace origin: " + vector(image_.grid.origin) + "\nencoding: raw\n\n" +
           voxels_;
  }
};

TEST_F(ImageFormats, ANrrdLandsAtTheSamePlaceInEachNamedSpace) {
  expect_image("lps.nrrd", nrrd_in("left-posterior-superior", 1, 1));
  expect_image("ras.nrrd", nrrd_in("right-anterior-superior", -1, -1));
  expect_image("las.nrrd", nrrd_in("left-anterior-superior", 1, -1));
  expect_image("short-las.nrrd", nrrd_in("LAS", 1, -1));
  EXPECT_THAT(warnings(), IsEmpty());
  expect_image("time.nrrd",
               replaced(nrrd_in("left-anterior-superior-time", 1, -1, ",0"), "\nspace origin", "\nspace origin"));
  expect_image("scanner.nrrd", nrrd_in("scanner-xyz", 1, 1));
  EXPECT_THAT(warnings(), ElementsAre(HasSubstr("orientation")));
  expect_refused("odd.nrrd", nrrd_in("left-superior-posterior", 1, 1), HasSubstr("'space'"));
}

TEST_F(ImageFormats, UnitsOfSpaceAreReadOrRefused) {
  const auto scaled = [&](const std::string& unit, double per_mm) {
    ShapeImage other = image_;
    for (Point& axis : other.grid.axis)
      for (double& x : axis) x *= per_mm;
    for (double& x : other.grid.origin) x *= per_mm;
    return std::pair{replaced(as_nrrd(other, true, false), "encoding:",
                              "space units: \"" + unit + "\" \"" + unit + "\" \"" + unit + "\"\nencoding:"),
                     replaced(as_meta(other), "ElementSpacing", "DistanceUnits = " + unit + "\nElementSpacing")};
  };
  for (const auto& [unit, per_mm] : {std::pair{"mm", 1.0}, {"cm", 0.1}, {"m", 1e-3}, {"um", 1e3}, {"", 1.0}}) {
    const auto [nrrd, meta] = scaled(unit, per_mm);
    expect_image(std::string(unit) + ".nrrd", nrrd);
    expect_image(std::string(unit) + ".mha", meta);
  }
  expect_refused("inch.nrrd", scaled("inch", 1).first, AllOf(HasSubstr("'inch'"), HasSubstr("mm, cm")));
  expect_refused("inch.mha", scaled("inch", 1).second, AllOf(HasSubstr("'inch'"), HasSubstr("mm, cm")));
}

TEST_F(ImageFormats, ACompressedMetaImageSaysItselfWhereItsVoxelsEnd) {
  const std::string packed =
      with_voxels(replaced(meta_, "CompressedData = False", "CompressedData = True"), deflated(voxels_));
  const auto stating = [&](const std::string& size) {
    return replaced(packed, "CompressedData = True", "CompressedData = True\nCompressedDataSize = " + size);
  };
  expect_image("none.mha", packed);
  for (const std::string size : {"1", "40", "100000000"}) expect_image(size + ".mha", stating(size));
  expect_image("gzip.mha",
               with_voxels(replaced(meta_, "CompressedData = False", "CompressedData = True"), gzipped(voxels_)));
  write_bytes(folder_ / "own.zraw", deflated(voxels_));
  expect_image("beside.mhd", replaced(with_voxels(replaced(meta_, "= LOCAL", "= own.zraw"), ""),
                                      "CompressedData = False", "CompressedData = True"));
}

TEST_F(ImageFormats, OneFrameOfFourDimensionsKeepsItsDirections) {
  std::string meta = replaced(meta_, "NDims = 3", "NDims = 4");
  const std::string sizes = sizes_of(image_);
  meta = replaced(meta, "DimSize = " + sizes, "DimSize = " + sizes + " 1");
  meta = replaced(meta, "ElementSpacing = 2 3 4", "ElementSpacing = 2 3 4 7");
  meta = replaced(meta, "Offset = " + triple(image_.grid.origin), "Offset = " + triple(image_.grid.origin) + " 0");
  meta = replaced(meta, "TransformMatrix = 1 0 0 0 -1 0 0 0 1", "TransformMatrix = 1 0 0 0 0 -1 0 0 0 0 1 0 0 0 0 1");
  expect_image("frame.mha", meta);
  expect_refused("matrix.mha", replaced(meta, " 0 0 0 0 1\n", " 0 0 0 0 1 1\n"), HasSubstr("found 17"));

  const std::string four = replaced(nrrd_, "dimension: 3", "dimension: 4");
  for (const bool first : {true, false}) {
    std::string nrrd = replaced(four, "sizes: " + sizes, first ? "sizes: 1 " + sizes : "sizes: " + sizes + " 1");
    nrrd = replaced(nrrd, "kinds: domain domain domain",
                    first ? "kinds: list domain domain domain" : "kinds: domain domain domain time");
    nrrd = first ? replaced(nrrd, "directions: ", "directions: none ") : replaced(nrrd, "\nkinds", " none\nkinds");
    expect_image(first ? "first.nrrd" : "last.nrrd", nrrd);
  }
  EXPECT_THAT(warnings(), IsEmpty());
}

TEST_F(ImageFormats, LabelsThatWouldBecomeOneAreRefused) {
  std::string voxels = as_numbers<std::int32_t>();
  put(voxels, 4 * 11, 16777217);  // single precision has 16777216 and 16777218; voxel 11 is (1, 1, 0)
  const auto says = AllOf(HasSubstr("16777217"), HasSubstr("voxel (1, 1, 0)"), HasSubstr("renumber"));
  const std::string nrrd =
      replaced(replaced(nrrd_, "unsigned char", "int"), "encoding: raw", "endian: little\nencoding: raw");
  expect_refused("a.nrrd", with_voxels(nrrd, voxels), says);
  expect_refused("a.mha", with_voxels(replaced(meta_, "MET_UCHAR", "MET_INT"), voxels), says);
  std::string nifti = with_voxels(nifti_, voxels);
  put(nifti, 70, std::int16_t{8});
  put(nifti, 72, std::int16_t{32});
  expect_refused("a.nii", nifti, says);
  ShapeImage straight = image_;  // INR has no directions
  straight.grid.axis[1][1] = 3;
  std::string inr = replaced(as_inr(straight), "PIXSIZE=8 bits", "PIXSIZE=32 bits");
  inr = replaced(inr, "unsigned fixed", "signed fixed");
  expect_refused("a.inr", with_voxels(inr, voxels), says);

  put(voxels, 4 * 11, 16777216);
  EXPECT_EQ(read("b.nrrd", with_voxels(nrrd, voxels)).values[11], 16777216);
  std::string doubles = as_numbers<double>();
  put(doubles, 8 * 11, 0.1);  // a grey value, which may be rounded
  EXPECT_EQ(read("c.nrrd", with_voxels(replaced(nrrd, "type: int", "type: double"), doubles)).values[11], 0.1f);
  put(doubles, 8 * 11, 1e300);
  expect_refused("d.nrrd", with_voxels(replaced(nrrd, "type: int", "type: double"), doubles), HasSubstr("renumber"));
}

TEST_F(ImageFormats, SegmentsInLayersAreRefusedByTheirNames) {
  std::string nrrd = replaced(nrrd_, "dimension: 3", "dimension: 4");
  nrrd = replaced(nrrd, "sizes: ", "sizes: 2 ");
  nrrd = replaced(nrrd, "directions: ", "directions: none ");
  nrrd = replaced(nrrd, "kinds: ", "kinds: list ");
  const std::string layered = replaced(nrrd, "\n\n",
                                       "\nSegment0_Name:=organ\nSegment0_LabelValue:=1\nSegment0_Layer:=0\n"
                                       "Segment1_Name:=lesion\nSegment1_LabelValue:=1\nSegment1_Layer:=1\n\n");
  expect_refused("a.seg.nrrd", layered + voxels_,
                 AllOf(HasSubstr("2 layers"), HasSubstr("layer 1: lesion = 1"), HasSubstr("labelmap")));
  expect_refused("b.nrrd", nrrd + voxels_, HasSubstr("axis 1"));
}

TEST_F(ImageFormats, WhatNobodyNeedsInAHeaderMayBeOdd) {
  // keys with a value are no fields, whatever their names
  expect_image("keys.nrrd",
               replaced(nrrd_, "\n\n", "\ncontent: organ\ncontent:=portal phase\ntype:=CT\nnote: a\nnote: b\n\n"));
  expect_refused("twice.nrrd", replaced(nrrd_, "\n\n", "\ntype: short\n\n"), HasSubstr("'type' is given twice"));
  expect_image("twice.mha", replaced(meta_, "NDims", "Comment = a\nComment = b\nNDims"));
  expect_refused("twice-spacing.mha", replaced(meta_, "NDims", "ElementSpacing = 1 1 1\nNDims"),
                 HasSubstr("given twice"));
  expect_image("nan.nrrd",
               replaced(nrrd_, "\n\n", "\nspacings: nan nan nan\naxis mins: nan nan nan\nold max: nan\n\n"));
  expect_image("nan.mha",
               replaced(meta_, "CenterOfRotation = 0 0 0", "CenterOfRotation = nan nan nan\nElementMax = nan"));

  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  for (const float odd : {0.0f, kNan, -1.0f}) {  // the sform states sizes and directions alone
    std::string nifti = nifti_;
    for (std::size_t d = 0; d < 8; ++d) put(nifti, 76 + 4 * d, odd);
    for (std::size_t q = 0; q < 6; ++q) put(nifti, 256 + 4 * q, kNan);
    for (const std::size_t unused : {112, 116, 124, 128})
      put(nifti, unused, kNan);  // scl_slope, scl_inter, cal_max, cal_min
    expect_image("sform.nii", nifti);
    put(nifti, 254, std::int16_t{0});
    expect_refused("neither.nii", nifti, HasSubstr("voxel sizes above 0"));
    put(nifti, 252, std::int16_t{1});
    expect_refused("qform.nii", nifti, HasSubstr("voxel sizes above 0"));
  }
}

TEST_F(ImageFormats, NumbersOfEachTypeAndByteOrderAreRead) {
  const auto each = [&](const std::string& nrrd_type, const std::string& meta_type, const std::string& inr_type,
                        int nifti_type, auto number) {
    using T = decltype(number);
    const std::string bits = std::to_string(8 * sizeof(T));
    for (const bool big : {false, true}) {
      SCOPED_TRACE(nrrd_type + (big ? " big" : " little"));
      const std::string voxels = as_numbers<T>(big);
      const std::string endian = big ? "big" : "little";
      expect_image("a.nrrd", with_voxels(replaced(replaced(nrrd_, "unsigned char", nrrd_type), "encoding: raw",
                                                  "endian: " + endian + "\nencoding: raw"),
                                         voxels));
      expect_image("a.mha", with_voxels(replaced(replaced(meta_, "MET_UCHAR", meta_type), "MSB = False",
                                                 big ? "MSB = True" : "MSB = False"),
                                        voxels));
      std::string inr = replaced(as_inr(image_), "VY=3", "VY=-3");  // refused below: INR has no directions
      inr = replaced(replaced(inr, "PIXSIZE=8", "PIXSIZE=" + bits), "unsigned fixed", inr_type);
      expect_refused("a.inr", with_voxels(inr, voxels), HasSubstr("above 0"));
      inr = with_voxels(replaced(replaced(inr, "VY=-3", "VY=3"), "CPU=pc", big ? "CPU=sun" : "CPU=decm"), voxels);
      const LabelImage read_inr = read("b.inr", inr);
      EXPECT_TRUE(std::equal(read_inr.values.begin(), read_inr.values.end(), image_.values.begin()));
      if (big) continue;
      std::string nifti = with_voxels(nifti_, voxels);
      put(nifti, 70, static_cast<std::int16_t>(nifti_type));
      put(nifti, 72, static_cast<std::int16_t>(8 * sizeof(T)));
      expect_image("a.nii", nifti);
    }
  };
  each("int8", "MET_CHAR", "signed fixed", 256, std::int8_t{});
  each("short", "MET_SHORT", "signed fixed", 4, std::int16_t{});
  each("ushort", "MET_USHORT", "unsigned fixed", 512, std::uint16_t{});
  each("int", "MET_INT", "signed fixed", 8, std::int32_t{});
  each("uint", "MET_UINT", "unsigned fixed", 768, std::uint32_t{});
  each("longlong", "MET_LONG_LONG", "signed fixed", 1024, std::int64_t{});
  each("ulonglong", "MET_ULONG_LONG", "unsigned fixed", 1280, std::uint64_t{});
  each("float", "MET_FLOAT", "float", 16, float{});
  each("double", "MET_DOUBLE", "float", 64, double{});
}

TEST_F(ImageFormats, VoxelsThatAreNoBytesAreRefused) {
  for (const char* encoding : {"ascii", "hex", "bzip2"})
    expect_refused("a.nrrd", replaced(nrrd_, ": raw", std::string(": ") + encoding), HasSubstr("save it as one of"));
  expect_refused("a.mha", replaced(meta_, "BinaryData = True", "BinaryData = False"), HasSubstr("BinaryData"));
}

TEST_F(ImageFormats, WhatAHeaderSaysToSkipIsSkipped) {
  const auto detached = [&](const std::string& more, const std::string& encoding = "raw") {
    return replaced(with_voxels(nrrd_, ""), "encoding: raw",
                    "encoding: " + encoding + "\n" + more + "data file: own.raw");
  };
  write_bytes(folder_ / "own.raw", "two lines\nof text\n12345" + voxels_);
  expect_image("skips.nhdr", detached("line skip: 2\nbyte skip: 5\n"));
  expect_image("at-the-end.nhdr", detached("byteskip: -1\n"));
  expect_image("end.mhd",
               replaced(with_voxels(replaced(meta_, "= LOCAL", "= own.raw"), ""), "NDims", "HeaderSize = -1\nNDims"));
  expect_image("size.mhd",
               replaced(with_voxels(replaced(meta_, "= LOCAL", "= own.raw"), ""), "NDims", "HeaderSize = 23\nNDims"));
  write_bytes(folder_ / "own.raw", "one line\n" + gzipped("12345" + voxels_));
  expect_image("gzip.nhdr", detached("line skip: 1\nbyte skip: 5\n", "gzip"));
  EXPECT_THAT(warnings(), IsEmpty());
}

TEST_F(ImageFormats, AFileWithASliceMoreThanItsHeaderSaysIsWarnedOf) {
  const std::string sizes = sizes_of(image_), fewer = "10 12 13";
  for (const auto& [name, bytes] : {std::pair{"a.nrrd", replaced(nrrd_, sizes, fewer)},
                                    {"b.nrrd", replaced(as_nrrd(image_, false, true), sizes, fewer)},
                                    {"a.mha", replaced(meta_, sizes, fewer)}}) {
    forget_warnings();
    read(name, bytes);
    EXPECT_THAT(warnings(), ElementsAre(AllOf(HasSubstr("1680"), HasSubstr("sizes")))) << name;
  }
  forget_warnings();
  expect_image("newline.nrrd", nrrd_ + "\n");
  EXPECT_THAT(warnings(), IsEmpty());
}

TEST_F(ImageFormats, WhatAHeaderLeavesOutIsSaidOrRefused) {
  const std::string plain = "NRRD0001\ntype: uchar\ndimension: 3\nsizes: " + sizes_of(image_) + "\nencoding: raw\n";
  const LabelImage cells =
      read("cells.nrrd", plain + "spacings: 2 3 4\naxis mins: 10 20 30\nunits: \"mm\" \"cm\" \"mm\"\n\n" + voxels_);
  EXPECT_THAT(warnings(), ElementsAre(HasSubstr("left, posterior, superior")));
  EXPECT_THAT(cells.grid.spacing(), ElementsAre(2, 30, 4));
  EXPECT_THAT(cells.grid.origin, ElementsAre(11, 215, 32));  // half a cell behind its least position
  const LabelImage nodes =
      read("nodes.nrrd", plain + "spacings: 2 3 4\naxis mins: 10 20 30\ncenters: node node node\n\n" + voxels_);
  EXPECT_THAT(nodes.grid.origin, ElementsAre(10, 20, 30));
  expect_refused("bare.nrrd", plain + "\n" + voxels_, HasSubstr("no field 'spacings'"));

  forget_warnings();
  std::string meta = replaced(meta_, "ElementSpacing", "Modality");
  read("a.mha", replaced(meta, "TransformMatrix", "Unused"));
  EXPECT_THAT(warnings(), ElementsAre(HasSubstr("no ElementSpacing"), HasSubstr("no orientation")));
}

TEST_F(ImageFormats, AByteOrderMarkIsPassedOver) {
  const std::string mark = "\xEF\xBB\xBF";
  expect_image("a.nrrd", mark + nrrd_);
  expect_image("a.mha", mark + meta_);
  write_bytes(folder_ / "case.nii", nifti_);
  write_bytes(folder_ / "case.csv", mark + "1;egg\n2;stalk\n");
  EXPECT_EQ(read_label_names(folder_ / "case.nii"), (std::map<float, std::string>{{1, "egg"}, {2, "stalk"}}));
}

// nifticlib is the reference implementation of the format's document.
TEST_F(ImageFormats, PlacesVoxelsOfNiftiWhereNifticlibPlacesThem) {
  for (const bool sform : {true, false})
    for (const float third : {1.0f, -1.0f}) {  // qfac: the third axis as it is, or turned back
      std::string file = nifti_;
      put(file, 76, third);
      put(file, 252, std::int16_t{1});
      if (!sform) put(file, 254, std::int16_t{0});
      const float quaternion[6] = {0.3f, -0.5f, 0.1f, -40, 25, 13};
      for (std::size_t q = 0; q < 6; ++q) put(file, 256 + 4 * q, quaternion[q]);
      const LabelImage ours = read("a.nii", file);
      nifti_image* theirs = nifti_image_read((folder_ / "a.nii").c_str(), 1);
      ASSERT_NE(theirs, nullptr);
      const mat44& place = sform ? theirs->sto_xyz : theirs->qto_xyz;
      for (const auto& [i, j, k] : {std::array{0, 0, 0}, {9, 0, 0}, {0, 11, 0}, {9, 11, 13}}) {
        const Point found = ours.grid.point(i, j, k);
        for (std::size_t d = 0; d < 3; ++d) {
          const float* row = place.m[d];
          const double expected = row[0] * i + row[1] * j + row[2] * k + row[3];
          EXPECT_NEAR(found[d], d < 2 ? -expected : expected, 1e-5);  // RAS; theirs is in single precision
        }
      }
      const auto* labels = static_cast<const std::uint8_t*>(theirs->data);
      EXPECT_TRUE(std::equal(ours.values.begin(), ours.values.end(), labels));
      nifti_image_free(theirs);
    }
}

}  // namespace
}  // namespace palpate
