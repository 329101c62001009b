// The list of an image's labels: volumes, boxes, pieces, borders, and names from each source.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "formats/errors.h"
#include "meshing/image/label_list.h"
#include "meshing/image/label_names.h"
#include "meshing/image/voxel_mask.h"
#include "tests/meshing/run_surface.h"
#include "tests/meshing/surface_images.h"

namespace palpate {
namespace {

using namespace tests;
using testing::AllOf;
using testing::HasSubstr;
using Names = std::map<float, std::string>;

// Label 3: two blocks of 2 x 2 x 2 voxels that share an edge only. Label 200: one block at the border.
ShapeImage three_blocks() {
  ShapeImage image =
      shape_image({12, 10, 8}, {{{2, 0, 0}, {0, 3, 0}, {0, 0, 5}}}, {100, 50, 20}, [](const Point&) { return 0; });
  const auto fill = [&](std::array<int, 3> from, std::array<int, 3> to, std::uint8_t label) {
    for (int k = from[2]; k <= to[2]; ++k)
      for (int j = from[1]; j <= to[1]; ++j)
        for (int i = from[0]; i <= to[0]; ++i) image.values[image.grid.index(i, j, k)] = label;
  };
  fill({2, 2, 2}, {3, 3, 3}, 3);
  fill({4, 4, 2}, {5, 5, 3}, 3);
  fill({10, 7, 5}, {11, 8, 6}, 200);
  return image;
}

TEST(LabelList, StatesVolumeBoxPiecesAndBorderOfEachLabel) {
  const ShapeImage image = three_blocks();
  const std::vector<LabelEntry> labels = list_labels(labels_of(image), "image");
  ASSERT_EQ(labels.size(), 2u);
  EXPECT_EQ(labels[0].label, 3);
  EXPECT_EQ(labels[0].voxels, 16u);
  EXPECT_DOUBLE_EQ(labels[0].volume_mm3, 16 * 30);
  EXPECT_EQ(labels[0].pieces, 2u);
  EXPECT_EQ(labels[0].largest_piece, 8u);
  EXPECT_FALSE(labels[0].touches_border);
  EXPECT_EQ(labels[1].label, 200);
  EXPECT_EQ(labels[1].pieces, 1u);
  EXPECT_TRUE(labels[1].touches_border);
  // The first voxel's centre is 5.5, 4.5 and 3.5 voxels before the middle; the box holds the voxels' full width.
  const Point low = {100 + (2 - 6) * 2.0, 50 + (2 - 5) * 3.0, 20 + (2 - 4) * 5.0};
  const Point high = {100 + (6 - 6) * 2.0, 50 + (6 - 5) * 3.0, 20 + (4 - 4) * 5.0};
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(labels[0].low[c], low[c], 1e-9);
    EXPECT_NEAR(labels[0].high[c], high[c], 1e-9);
  }
}

TEST(LabelList, RefusesAnImageOfGreyValues) {
  ShapeImage shape = upright_image({30, 30, 30}, [](const Point&) { return 0; });
  LabelImage image = labels_of(shape);
  for (std::size_t v = 0; v < image.values.size(); ++v) image.values[v] = static_cast<float>(v);
  EXPECT_THROW(list_labels(image, "image"), InputError);
}

// ---- names ---------------------------------------------------------------------------------------------------------

const Names kNames = {{3, "left kidney"}, {200, "spleen"}};

std::string with_extension(std::string nifti, const std::string& text, bool big) {
  const std::size_t size = (text.size() + 8 + 15) / 16 * 16;
  std::string extension(4 + size, '\0');
  extension[0] = 1;
  const auto put = [&](std::string& bytes, std::size_t at, auto value) {
    std::memcpy(bytes.data() + at, &value, sizeof value);
    if (big)
      std::reverse(bytes.begin() + static_cast<std::ptrdiff_t>(at),
                   bytes.begin() + static_cast<std::ptrdiff_t>(at + sizeof value));
  };
  put(extension, 4, static_cast<std::int32_t>(size));
  extension.replace(12, text.size(), text);
  put(nifti, 108, static_cast<float>(348 + extension.size()));
  if (big) put(nifti, 0, std::int32_t{348});
  return nifti.substr(0, 348) + extension + nifti.substr(352);
}

class LabelNames : public testing::Test {
 protected:
  const std::filesystem::path folder_ = fresh_folder();
  const ShapeImage image_ = three_blocks();

  void expect_names(const std::string& file) {
    EXPECT_EQ(read_label_names(folder_ / file), kNames);
    const ProgramRun run = run_surface(folder_, "--list " + file);
    EXPECT_THAT(run.out, AllOf(HasSubstr("  left kidney"), HasSubstr("  spleen"), HasSubstr("touches")));
  }
};

TEST_F(LabelNames, AreReadFromTheLabelTableOfANiftiExtension) {
  const std::string xml =
      "<?xml version=\"1.0\"?> <CaretExtension><VolumeInformation Index=\"0\"><LabelTable>\n"
      "<Label Key=\"3\" Red=\"1.0\" Alpha=\"1\"><![CDATA[left kidney]]></Label>\n"
      "<Label Key=\"200\" Red=\"0.5\">spleen</Label>\n</LabelTable></VolumeInformation></CaretExtension>\n";
  write_bytes(folder_ / "a.nii.gz", gzipped(with_extension(as_nifti(image_, 2), xml, false)));
  expect_names("a.nii.gz");
  write_bytes(folder_ / "big.nii", with_extension(as_nifti(image_, 2), xml, true));
  EXPECT_EQ(read_label_names(folder_ / "big.nii"), kNames);
}

TEST_F(LabelNames, AreReadFromTheSegmentFieldsOfANrrd) {
  std::string nrrd = as_nrrd(image_, false, true);
  nrrd.insert(nrrd.find("\n\n"),
              "\nSegment0_ID:=Segment_1\nSegment0_LabelValue:=200\nSegment0_Name:=spleen\n"
              "Segment1_LabelValue:=3\nSegment1_Name:=left kidney");
  write_bytes(folder_ / "a.seg.nrrd", nrrd);
  expect_names("a.seg.nrrd");
}

TEST_F(LabelNames, OfAHundredSegmentsAreReadAlthoughTheHeaderIsLong) {
  std::string nrrd = as_nrrd(image_, false, false), fields;
  for (int s = 0; s < 120; ++s) fields += "\nSegment" + std::to_string(s) + "_Tags:=" + std::string(1000, 't');
  nrrd.insert(
      nrrd.find("\n\n"),
      fields + "\nSegment0_LabelValue:=200\nSegment0_Name:=spleen\nSegment1_LabelValue:=3\nSegment1_Name:=left kidney");
  write_bytes(folder_ / "a.nrrd", nrrd);
  expect_names("a.nrrd");
}

TEST_F(LabelNames, AreReadFromFilesBesideTheImage) {
  write_bytes(folder_ / "case.nii", as_nifti(image_, 2));
  for (
      const auto& [file, text] : std::vector<std::pair<const char*, const char*>>{
          {"case.json", R"({"3": "left kidney", "200": "spleen"})"},
          {"case.json", R"({"labels": {"left kidney": 3, "spleen": 200, "both": [3, 200]}, "numTraining": 12})"},
          {"labels.json", R"([{"value": 3, "name": "left kidney"}, {"value": 200, "name": "spleen"}])"},
          {"case.json",
           R"({"segmentAttributes": [[{"labelID": 3, "SegmentLabel": "left kidney"}, {"labelID": 200, "SegmentLabel": "spleen"}]]})"},
          {"case.csv", "label;name\r\n3;left kidney\r\n200;\"spleen\"\r\n"},
          {"labels.csv",
           "\xef\xbb\xbf"
           "3,left kidney\n200,spleen\n"},  // a byte order mark first, and no heading
          {"labels.csv", "name,index,red\nleft kidney,3,255\nspleen,200,0\n"},
          {"case.tsv", "index\tname\n3\tleft kidney\n200\tspleen\n"}}) {
    SCOPED_TRACE(text);
    write_bytes(folder_ / file, text);
    EXPECT_EQ(read_label_names(folder_ / "case.nii"), kNames);
    std::filesystem::remove(folder_ / file);
  }
}

TEST_F(LabelNames, AreNotTakenFromAFileThatDescribesSomethingElse) {
  write_bytes(folder_ / "case.nii", as_nifti(image_, 2));
  for (const char* text : {R"({"EchoTime": 3, "Manufacturer": "unknown"})", "not JSON", "[1, 2, 3]", ""}) {
    write_bytes(folder_ / "case.json", text);
    EXPECT_EQ(read_label_names(folder_ / "case.nii"), Names{}) << text;
  }
}

TEST_F(LabelNames, SurviveAFileOfManyLevels) {
  write_bytes(folder_ / "case.nii", as_nifti(image_, 2));
  write_bytes(folder_ / "case.json", std::string(400'000, '[') + std::string(400'000, ']'));
  EXPECT_EQ(read_label_names(folder_ / "case.nii"), Names{});
}

TEST_F(LabelNames, StandInTheSentenceThatListsAllLabels) {
  ShapeImage image = upright_image({30, 4, 4}, [](const Point& p) { return static_cast<int>(p[0] + 14.5); });
  write_bytes(folder_ / "case.nii", as_nifti(image, 2));
  write_bytes(folder_ / "case.csv", "29,spleen\n1,liver\n");
  const ProgramRun run = run_surface(folder_, "case.nii --labels 77 -o s.ply", 2);
  EXPECT_THAT(run.errors, AllOf(HasSubstr("1 liver (16 voxels)"), HasSubstr("29 spleen (16 voxels)")));
}

TEST_F(LabelNames, ListIsForImagesAndWritesJsonToo) {
  write_bytes(folder_ / "case.nii", as_nifti(image_, 2));
  run_surface(folder_, "--list case.nii --report list.json");
  EXPECT_THAT(file_bytes(folder_ / "list.json"), AllOf(HasSubstr("\"label\": 3"), HasSubstr("\"pieces\": 2")));
  run_surface(folder_, "--list case.nii --labels 3", 2);
  EXPECT_THAT(run_surface(folder_, "--list organ.stl", 2).errors, HasSubstr("--list is for images"));
  EXPECT_THAT(run_surface(folder_, "case.nii", 2).errors, HasSubstr("--output"));
}

}  // namespace
}  // namespace palpate
