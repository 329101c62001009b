// The bundles that a study has baked before: which of them it takes for those of its inputs.
#include "studies/accuracy/bake.h"

#include <gmock/gmock.h>

#include <fstream>

#include "formats/organ_config.h"
#include "tests/support/box_files.h"
#include "tests/support/test_files.h"

namespace palpate::accuracy {
namespace {

// An organ whose material reads a measured curve and whose boundary set reads a field, with rules that make its mesh.
class Bakes : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directories(organ_ / "boundary");
    std::filesystem::create_directories(folder_ / "bin");
    tests::write_box_files(folder_);
    write(folder_ / "pipelines/built.mk",
          "show-resolutions:\n\t@echo 200 200\nmesh:\n\t@mkdir -p $(DATA)/box/200 && cp box.msh "
          "$(DATA)/box/200/mesh.msh\n");
    write(folder_ / "bin/palpate-precompute", "a program");
    write(organ_ / "organ.toml", tests::kOrgan + R"([response]
curve = "curve.csv"
source = "test"
height = { value = 10, unit = "mm" }
radius = { value = 5, unit = "mm" }
young = { value = 5.4, unit = "kPa", source = "test" }
poisson = { value = 0.45, source = "test" }
)");
    write(organ_ / "boundary/back.toml",
          tests::kBoundary + "[[motion]]\nname = \"breath\"\nkind = \"field\"\nfile = \"field.csv\"\n");
    write(organ_ / "curve.csv", "displacement_mm,force_N\n1,1\n2,2\n3,3\n4,4\n5,5\n");
    write(organ_ / "boundary/field.csv", field());
  }

  static std::string field() {
    std::string text = "x,y,z,ux,uy,uz\n";
    for (const char* x : {"0", "20", "40", "60"})
      for (const char* y : {"0", "25", "50"})
        for (const char* z : {"0", "20", "40"}) text += std::string(x) + "," + y + "," + z + ",0,0,1\n";
    return text;
  }
  static void write(const std::filesystem::path& file, const std::string& text) { std::ofstream(file) << text; }

  StudyOptions options() const {
    StudyOptions options;
    options.organ = "box", options.boundary = "back";
    options.source = folder_, options.bin = folder_ / "bin", options.data = folder_ / "data";
    return options;
  }
  std::string fingerprint() const {
    const OrganCase organ(options());
    return Bakery(organ, StudySites{}).look({.resolution = "200", .element = "p1"}).fingerprint;
  }

  const std::filesystem::path folder_ = tests::fresh_folder(), organ_ = folder_ / "pipelines/box";
};

TEST_F(Bakes, AnotherCurveOrFieldOfTheSameNameIsAnotherBundle) {
  const std::string first = fingerprint();
  EXPECT_EQ(fingerprint(), first);
  write(organ_ / "curve.csv", "displacement_mm,force_N\n1,1\n2,2\n3,3\n4,4\n5,6\n");
  const std::string curve = fingerprint();
  EXPECT_NE(curve, first);
  write(organ_ / "boundary/field.csv", field() + "61,50,40,0,0,1\n");
  EXPECT_NE(fingerprint(), curve);
}

TEST_F(Bakes, ABoundarySetWithNodesNearTheSitesReadsTheSameFiles) {
  const OrganCase organ(options());
  StudySites sites;
  sites.radius = 0.01;
  sites.touch.push_back({{0.06, 0.025, 0.02}, {-1, 0, 0}, {0, 1, 0}});
  for (const auto& [key, file] : files_of({}, read_boundary_config(organ.boundary_file(sites, "200"))))
    EXPECT_TRUE(std::filesystem::equivalent(file, organ_ / "boundary/field.csv")) << key;
}

}  // namespace
}  // namespace palpate::accuracy
