// The CSV file of measured forces.
#include "programs/fit/measurements.h"

#include <gmock/gmock.h>

#include <fstream>

#include "tests/support/test_files.h"
#include "tests/support/texts.h"

namespace palpate::fit {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::filesystem::path written(const std::string& text) {
  const auto file = tests::scratch("forces.csv");
  std::ofstream(file) << text;
  return file;
}

void expect_refused(const std::string& text, const std::string& part, const ReadOptions& options = {}) {
  const auto file = written(text);
  const std::string said = tests::input_error([&] { read_measurements(file, options); });
  EXPECT_THAT(said, HasSubstr(part)) << text;
  EXPECT_THAT(said, HasSubstr(file.string()));
}

const std::string kHeader = "x_mm,y_mm,z_mm,radius_mm,depth_mm,force_N\n";

TEST(Measurements, ConvertsUnitsAndGathersSpots) {
  const Measurements data = read_measurements(
      written("\xef\xbb\xbf# a comment\r\nforce_mN,depth_um,x_cm,y_m,z_mm,radius_mm,source,temperature\r\n"
              "20, 500 ,1,0.02,30,5,\"bench, \"\"A\"\"\",21\r\n\n40,1000,1,0.02,30,5,\"bench, \"\"A\"\"\",21\n"
              "10,500,1,0.02,40,5,bench B,21\n5,0,1,0.02,50,5,bench B,21\n"),
      {});
  ASSERT_EQ(data.rows.size(), 3u);  // a depth of 0 says nothing
  EXPECT_DOUBLE_EQ(data.rows[1].depth, 1e-3);
  EXPECT_DOUBLE_EQ(data.rows[1].force, 0.04);
  ASSERT_EQ(data.spots.size(), 2u);
  EXPECT_THAT(data.spots[0].at, ElementsAre(testing::DoubleEq(0.01), 0.02, testing::DoubleEq(0.03)));
  EXPECT_DOUBLE_EQ(data.spots[0].radius, 5e-3);
  EXPECT_EQ(data.rows[1].spot, 0);
  EXPECT_EQ(data.rows[2].spot, 1);
  EXPECT_THAT(data.places, ElementsAre("(10, 20, 30) mm", "(10, 20, 40) mm"));
  EXPECT_THAT(data.sources, ElementsAre("bench, \"A\"", "bench B"));
  EXPECT_THAT(data.unused, ElementsAre("temperature"));
  EXPECT_EQ(data.sha256.size(), 64u);
}

TEST(Measurements, GathersSpotsOfOnePlaceByItsName) {
  const Measurements data = read_measurements(
      written("place," + kHeader + "lobe,1,2,3,5,1,0.1\nlobe,1.1,2,3,5,1,0.1\ntip,1,2,3,5,1,0.1\n"), {});
  EXPECT_THAT(data.places, ElementsAre("lobe", "tip"));
  ASSERT_EQ(data.spots.size(), 3u);
  EXPECT_EQ(data.spots[1].place, 0);
  EXPECT_EQ(data.spots[2].place, 1);
}

TEST(Measurements, TakesTheRadiusFromTheCommandLineAndLeavesOutDeepRows) {
  ReadOptions options;
  options.radius = 4e-3, options.most_depth = 2e-3;
  const Measurements data =
      read_measurements(written("x_mm,y_mm,z_mm,depth_mm,force_N\n1,2,3,1,0.1\n1,2,3,2.5,0.3\n"), options);
  EXPECT_EQ(data.spots[0].radius, 4e-3);
  EXPECT_EQ(data.rows.size(), 1u);
  EXPECT_EQ(data.left_out, 1);
}

TEST(Measurements, OfAPlateNeedDepthAndForceAlone) {
  ReadOptions options;
  options.plate = true;
  const Measurements data =
      read_measurements(written("displacement_mm,force_N,radial_mm\n0,0,0\n0.5,0.1,0.2\n"), options);
  EXPECT_DOUBLE_EQ(data.rows.at(0).depth, 5e-4);
  EXPECT_THAT(data.unused, ElementsAre("radial_mm"));
  expect_refused(kHeader + "1,2,3,5,1,0.1\n", "depth_mm and force_N", options);
}

TEST(Measurements, NameTheIndenterThatTheOtherColumnsAreOf) {
  const std::string ball = "indenter,x_mm,y_mm,z_mm,ball_radius_mm,depth_mm,force_N\n";
  ReadOptions plate;
  plate.plate = true;
  EXPECT_EQ(read_measurements(written("indenter," + kHeader + "disc,1,2,3,5,1,0.1\n"), {}).rows.size(), 1u);
  EXPECT_GT(read_measurements(written(ball + "ball,1,2,3,5,1,0.1\n"), {}).spots.at(0).ball_depth, 0);
  EXPECT_EQ(read_measurements(written("indenter,depth_mm,force_N\nplate,1,0.1\n"), plate).rows.size(), 1u);
  expect_refused("indenter," + kHeader + "cone,1,2,3,5,1,0.1\n", ":2: expected disc, ball or plate");
  expect_refused("indenter," + kHeader + "ball,1,2,3,5,1,0.1\n", "ball_radius_mm");
  expect_refused("indenter," + kHeader + "plate,1,2,3,5,1,0.1\n", "--plate");
  expect_refused(ball + "disc,1,2,3,5,1,0.1\n", "found \"disc\"");
  expect_refused("indenter,depth_mm,force_N\ndisc,1,0.1\n", "found \"disc\"", plate);
}

TEST(Measurements, AreRefusedWithFileLineAndWhatWasFound) {
  expect_refused("", "found no header");
  expect_refused("x_mm,y_mm,z_mm,depth_mm,force_N\n", "column for radius");
  expect_refused("x_mm;y_mm;z_mm\n", "not by semicolons");
  expect_refused("x_in,y_mm,z_mm,radius_mm,depth_mm,force_N\n", "found \"x_in\"");
  expect_refused("x_mm,y_mm,z_mm,radius_mm,depth_mm,force\n", "found \"force\"");
  expect_refused("depth_mm," + kHeader, "found depth twice");
  expect_refused(kHeader, "depth above 0");
  expect_refused(kHeader + "1,2,3,5,1\n", ":2: expected 6 cells");
  expect_refused("# lines count\n" + kHeader + "1,2,3,5,1,0.1\n1,2,3,5,1,0.1N\n", ":4: ");
  expect_refused(kHeader + "1,2,3,5,1,nan\n", "column force_N");
  expect_refused(kHeader + "1,2,3,5,-1,0.1\n", "found \"-1\"");
  expect_refused(kHeader + "1,2,3,0,1,0.1\n", ":2: expected a radius");
  expect_refused("place," + kHeader + "\"a,1,2,3,5,1,0.1\n", ":2: expected a quote");
  ReadOptions shallow;
  shallow.most_depth = 1e-4;
  expect_refused(kHeader + "1,2,3,5,1,0.1\n", "--most-depth", shallow);
}

}  // namespace
}  // namespace palpate::fit
