// Runs palpate-surface on the liver from CGAL's data archive, as the Debian package libcgal-demo has it.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "meshing/surface/surface_checks.h"
#include "meshing/surface/surface_file.h"
#include "tests/meshing/run_surface.h"

namespace palpate {
namespace {

using namespace tests;

constexpr char kArchive[] = "/usr/share/doc/libcgal-dev/data.tar.gz";

std::filesystem::path liver_in(const std::filesystem::path& folder) {
  const std::string command =
      std::string("tar xzf ") + kArchive + " -C " + folder.string() + " data/images/liver.inr.gz";
  if (!std::filesystem::exists(kArchive) || std::system(command.c_str()) != 0) return {};
  return folder / "data/images/liver.inr.gz";
}

TEST(SurfaceLiver, CoarseLiverIsCleanAndAsLargeAsItsVoxels) {
  const std::filesystem::path folder = fresh_folder(), liver = liver_in(folder);
  if (liver.empty()) GTEST_SKIP() << "needs the package libcgal-demo";
  run_surface(folder, liver.string() + " --labels 255 --triangles 1160 -o " + (folder / "liver.off").string() +
                          " --report " + (folder / "liver.json").string());

  const TriangleSurface surface = read_surface(folder / "liver.off", 1);
  EXPECT_EQ(first_defect(surface), "");
  // 3,160,496 voxels of .6171875 x .6171875 x 1.33333 mm; the volume is restored exactly and written with 17 digits
  EXPECT_NEAR(enclosed_volume(surface) / 1605195.164650859, 1, 1e-9);

  const auto report = nlohmann::json::parse(std::ifstream(folder / "liver.json"));
  EXPECT_EQ(report["shells"], 1);
  EXPECT_EQ(report["handles"], 0);  // Euler number 2
  EXPECT_NEAR(report["triangles"].get<double>(), 1160, 0.02 * 1160);
  EXPECT_GT(report["radius_ratio"]["mean"].get<double>(), 0.94);
  // measured: mean 0.73 mm and 95 % at 2.2 mm; the bounds leave a sixth for another order of the triangles
  EXPECT_LT(report["distance_to_reference_mm"]["mean"].get<double>(), 0.85);
  EXPECT_LT(report["distance_to_reference_mm"]["p95"].get<double>(), 2.6);
  // smoothing may cut back a tip that is narrower than an edge by about one edge
  EXPECT_LT(report["distance_to_reference_mm"]["most"].get<double>(), report["edge_mm"]["mean"].get<double>());
}

TEST(SurfaceLiver, LabelThatTheLiverImageLacksListsItsLabels) {
  const std::filesystem::path folder = fresh_folder(), liver = liver_in(folder);
  if (liver.empty()) GTEST_SKIP() << "needs the package libcgal-demo";
  const ProgramRun run = run_surface(folder, liver.string() + " --labels 12 -o " + (folder / "liver.off").string(), 2);
  for (const char* label : {"84 (2 voxels)", "85 (17702", "127 (314086", "255 (3160496"}) {
    EXPECT_NE(run.errors.find(label), std::string::npos) << run.errors;
  }
}

}  // namespace
}  // namespace palpate
