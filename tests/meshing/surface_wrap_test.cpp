// Wraps surfaces that are open, cross themselves or are no manifold: palpate-surface --wrap.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <numbers>

#include "meshing/surface/surface_checks.h"
#include "meshing/surface/surface_file.h"
#include "tests/meshing/run_surface.h"
#include "tests/support/closed_surfaces.h"

namespace palpate {
namespace {

using namespace tests;
using testing::HasSubstr;

class SurfaceWrap : public testing::Test {
 protected:
  const std::filesystem::path folder_ = fresh_folder();
  nlohmann::json report_;

  // Wraps the surface and returns the result, which must be sound.
  TriangleSurface wrapped(const TriangleSurface& soup, const std::string& says, const std::string& options = "") {
    write_off(folder_ / "soup.off", soup);
    const ProgramRun run = run_surface(folder_, "soup.off --wrap -o out.ply --report out.json " + options);
    if (run.code != 0) return {};
    EXPECT_THAT(run.errors, HasSubstr(says));
    report_ = nlohmann::json::parse(file_bytes(folder_ / "out.json"));
    const TriangleSurface surface = read_surface(folder_ / "out.ply", 1);
    EXPECT_EQ(first_defect(surface), "");
    return surface;
  }
  std::string refusal(const TriangleSurface& soup, const std::string& options = "") {
    write_off(folder_ / "soup.off", soup);
    const ProgramRun run = run_surface(folder_, "soup.off --wrap -o out.ply " + options, 2);
    EXPECT_FALSE(std::filesystem::exists(folder_ / "out.ply"));
    return run.errors;
  }
};

// The ball rolls on an offset of a tenth of its radius, 0.29 mm on these balls. Taking the offset off again leaves the
// square of it over the radius of curvature, below 0.01 mm, and the edges' rounding: 1 % of the volume of a ball of
// 50 mm is 0.17 mm of its radius.
constexpr double kVolume = 0.01;

TEST_F(SurfaceWrap, AHoleIsCappedAndTheRestStaysInPlace) {
  TriangleSurface open = sphere_surface(3, 50);
  std::erase_if(open.triangles, [&](const Triangle& t) { return open.points[t[0]][2] > 40; });
  const TriangleSurface surface = wrapped(open, "1 open loops");
  // a ball without the cap above z = 40: pi h^2 (3 R - h) / 3 with h = 10; the rim is a vertex ring a little below
  const double ball = 4 * std::numbers::pi / 3 * 125'000, cap = std::numbers::pi * 100 * 140 / 3;
  EXPECT_NEAR(enclosed_volume(surface) / (ball - cap), 1, 2 * kVolume);
  EXPECT_NEAR(report_["volume_error"].get<double>(), 0, kVolume);
  EXPECT_LT(report_["distance_to_reference_mm"]["p95"].get<double>(), 0.5);
  // the cap is far from every triangle of the input, by up to the hole's radius, which the report states
  EXPECT_GT(report_["distance_from_surface_mm"]["most"].get<double>(), 15);
}

TEST_F(SurfaceWrap, BallsThatCrossAreUnited) {
  TriangleSurface crossing = sphere_surface(3, 30);
  append(crossing, sphere_surface(3, 30, {30, 1, 2}));
  const TriangleSurface surface = wrapped(crossing, "parts overlap");
  // two balls at a distance d: 2 V - pi (2 R - d)^2 (d^2 + 4 d R) / (12 d)
  const double r = 30, d = std::sqrt(905.0);
  const double lens = std::numbers::pi * (2 * r - d) * (2 * r - d) * (d * d + 4 * d * r) / (12 * d);
  EXPECT_NEAR(enclosed_volume(surface) / (8 * std::numbers::pi / 3 * r * r * r - lens), 1, 2 * kVolume);
  EXPECT_LT(report_["distance_from_surface_mm"]["p95"].get<double>(), 0.5);
}

TEST_F(SurfaceWrap, BoxesThatShareAWallOrAnEdgeAreUnited) {
  TriangleSurface wall = box_surface(3, {0, 0, 0}, {30, 30, 30});
  append(wall, box_surface(3, {30, 0, 0}, {60, 30, 30}));
  EXPECT_NEAR(enclosed_volume(wrapped(wall, "ball")) / 54'000, 1, 2 * kVolume);
  TriangleSurface edge = box_surface(3, {0, 0, 0}, {30, 30, 30});
  append(edge, box_surface(3, {30, 30, 0}, {60, 60, 30}));
  EXPECT_NEAR(enclosed_volume(wrapped(edge, "ball")) / 54'000, 1, 2 * kVolume);
}

TEST_F(SurfaceWrap, AHollowBallComesOutFilledAndThatIsWarnedOf) {
  TriangleSurface hollow = sphere_surface(3, 50);
  const TriangleSurface solid = hollow, inner = sphere_surface(3, 46);
  const auto first = static_cast<std::int32_t>(hollow.points.size());
  hollow.points.insert(hollow.points.end(), inner.points.begin(), inner.points.end());
  for (const auto& [a, b, c] : inner.triangles) hollow.triangles.push_back({first + a, first + c, first + b});
  const TriangleSurface surface = wrapped(hollow, "thin walls");
  EXPECT_NEAR(enclosed_volume(surface) / enclosed_volume(solid), 1, kVolume);
  write_off(folder_ / "soup.off", solid);
  EXPECT_THAT(run_surface(folder_, "soup.off --wrap -o out.ply").errors, testing::Not(HasSubstr("a wrap fills")));
}

TEST_F(SurfaceWrap, ASheetIsRefusedForItEnclosesNothing) {
  TriangleSurface sheet = box_surface(6, {0, 0, 0}, {100, 100, 10});
  std::erase_if(sheet.triangles, [&](const Triangle& t) {
    return sheet.points[t[0]][2] + sheet.points[t[1]][2] + sheet.points[t[2]][2] > 0;
  });
  EXPECT_THAT(refusal(sheet), HasSubstr("enclose nothing"));
}

TEST_F(SurfaceWrap, WorkBeyondTheLimitIsRefusedAndItsAdviceWorks) {
  const TriangleSurface ball = sphere_surface(2, 50);
  const std::string errors = refusal(ball, "--wrap-mm 0.1");
  const std::string advice = "give a larger ball with --wrap-mm, such as ";
  ASSERT_THAT(errors, HasSubstr(advice));
  wrapped(ball, "ball", "--wrap-mm " + std::to_string(std::stod(errors.substr(errors.find(advice) + advice.size()))));
}

TEST_F(SurfaceWrap, OptionsThatDoNotFitAreRefused) {
  EXPECT_THAT(refusal(sphere_surface(1, 50), "--cavities keep"), HasSubstr("--wrap fills cavities"));
  run_surface(folder_, "soup.off --wrap-mm 3 -o out.ply", 2);
}

}  // namespace
}  // namespace palpate
