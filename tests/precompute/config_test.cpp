// organ.toml and boundary/*.toml: what is read from them, and that every mistake in them gives one sentence with its
// line.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <numeric>

#include "formats/errors.h"
#include "formats/organ_config.h"
#include "formats/program.h"
#include "studies/bodies/box_mesh.h"
#include "tests/support/test_files.h"
#include "tests/support/texts.h"

namespace palpate::tests {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::filesystem::path file() {
  return scratch("config.toml");
}

template <class Read>
auto read_text(Read read, const std::string& text) {
  std::ofstream(file()) << text;
  return read(file());
}

template <class Read>
std::string refusal(Read read, const std::string& text) {
  const std::string sentence = input_error([&] { read_text(read, text); });
  if (sentence.empty()) return sentence;
  EXPECT_EQ(sentence.find('\n'), std::string::npos) << sentence;
  EXPECT_THAT(sentence, HasSubstr(file().string()));
  return sentence.substr(file().string().size());
}

const std::string kOrgan = R"(name = "liver"
mesh_unit = "mm"
frame = "LPS"
element = "p1"
[[region]]
name = "liver"
young = { value = 5.4, unit = "kPa", source = "a" }
poisson = { value = 0.45, source = "b" }
density = { value = 1.06, unit = "g/cm^3", source = "c" }
stiffening = { value = 2.5, source = "g" }
[response]
curve = "curves/c.csv"
source = "d"
height = { value = 13, unit = "mm" }
radius = { value = 1.5, unit = "cm" }
young = { value = 3156, unit = "Pa", source = "e" }
poisson = { value = 0.3, source = "f" }
degree = 7
)";

// Each change of the text is refused by a sentence that holds this noun.
template <class Read>
void expect_refusals(Read read, const std::string& text, const std::vector<std::array<std::string, 3>>& changes) {
  for (const auto& [from, to, noun] : changes)
    EXPECT_THAT(refusal(read, replaced(text, from, to)), HasSubstr(noun)) << from << " -> " << to;
}

TEST(OrganConfig, IsReadInSiUnits) {
  const OrganConfig organ = read_text(read_organ_config, kOrgan);
  EXPECT_EQ(organ.name, "liver");
  EXPECT_EQ(organ.frame, "LPS");
  EXPECT_EQ(organ.element, Element::p1);
  EXPECT_EQ(organ.mesh_unit, (LengthUnit{"mm", 1e-3}));
  ASSERT_EQ(organ.regions.size(), 1u);
  EXPECT_DOUBLE_EQ(organ.regions[0].young.value, 5400);
  EXPECT_EQ(organ.regions[0].young.source, "a");
  EXPECT_EQ(organ.regions[0].poisson.value, 0.45);
  ASSERT_TRUE(organ.regions[0].density.has_value());
  EXPECT_DOUBLE_EQ(organ.regions[0].density->value, 1060);
  ASSERT_TRUE(organ.regions[0].stiffening.has_value());
  EXPECT_EQ(organ.regions[0].stiffening->value, 2.5);
  ASSERT_TRUE(organ.response.has_value());
  EXPECT_EQ(organ.response->curve, file().parent_path() / "curves/c.csv");
  EXPECT_DOUBLE_EQ(organ.response->height, 0.013);
  EXPECT_DOUBLE_EQ(organ.response->radius, 0.015);
  EXPECT_EQ(organ.response->young, 3156);
  EXPECT_EQ(organ.response->degree, 7);
}

TEST(OrganConfig, RefusesEachFaultInOneSentenceWithItsLine) {
  expect_refusals(
      read_organ_config, kOrgan,
      {
          {"element = \"p1\"", "element = \"p1\"\ncolour = 3", ":5: unknown key \"colour\""},
          {"name = \"liver\"\nmesh", "mesh", ":1: the key \"name\""},
          {"\"mm\"", "\"inch\"", ":2: mesh_unit: "},
          {"\"mm\"", "5", ":2: mesh_unit: "},
          {"5.4", "-1", ":7: [[region]] 1: young: "},
          {"5.4", "\"5.4\"", ":7: [[region]] 1.young: value: "},
          {", source = \"a\"", "", ":7: [[region]] 1.young: the key \"source\""},
          {"\"a\"", "\"\"", "source: "},
          {"0.45", "0.4999999999", "poisson: expected a ratio"},
          {"0.45", "-0.9999999999", "poisson: expected a ratio"},
          {"0.45", "0.5", ":8: [[region]] 1: poisson: "},
          {"0.45", "-1", "poisson"},
          {"1.06", "0", "a density above 0"},
          {"2.5", "0", "stiffening: "},
          {"2.5", "1e5", "stiffening: "},
          {"degree = 7", "degree = 11", ":18: response: degree: "},
          {"value = 13", "value = 0", "a length above 0"},
          {"frame = ", "frame : ", ":3: not valid TOML"},
          {"[[region]]\nname = \"liver\"", "[region]\nname = \"liver\"", ":5: region: "},
          {"[response]",
           "[[region]]\nname = \"liver\"\nyoung = { value = 1, unit = \"Pa\", source = \"a\" }\npoisson = { value = "
           "0.1, source = \"a\" }\n[response]",
           "a name that"},
      });
  EXPECT_FALSE(read_text(read_organ_config, replaced(kOrgan, "stiffening = { value = 2.5, source = \"g\" }\n", ""))
                   .regions[0]
                   .stiffening.has_value());
  EXPECT_THAT(refusal(read_organ_config, "name = \"a\"\nmesh_unit = \"m\"\nframe = \"none\"\nelement = \"p1\"\n"),
              HasSubstr("at least one [[region]]"));
  EXPECT_THROW(read_organ_config("/no/such/organ.toml"), InputError);
}

std::string with_law(const std::string& law) {
  return replaced(kOrgan, "stiffening = { value = 2.5, source = \"g\" }", law);
}

// mu = 5400 Pa / 2.9 and c1 = 931 Pa.
TEST(OrganConfig, ReadsTheLawsOfYeohAndOgden) {
  const auto law_of = [](const std::string& law) {
    const auto region = read_text(read_organ_config, with_law(law)).regions.at(0);
    EXPECT_FALSE(region.stiffening.has_value());
    return region.law.value();
  };
  const StoredTissueLaw yeoh = law_of("yeoh = { c2 = -0.2, c3 = 300, unit = \"kPa\", source = \"h\" }");
  EXPECT_EQ(yeoh.numbers, (std::array<double, 4>{1, -200, 300000, 0}));
  EXPECT_EQ(yeoh.source, "h");
  EXPECT_EQ(law_of("ogden = { exponent = -4.7, source = \"h\" }").numbers, (std::array<double, 4>{2, -4.7, 0, 2}));
  EXPECT_EQ(law_of("ogden = { exponent = 2, share = 0.2, second_exponent = 9, source = \"h\" }").numbers,
            (std::array<double, 4>{2, 2, 0.2, 9}));
}

TEST(OrganConfig, RefusesConstantsUnderWhichATissueGivesWay) {
  const auto yeoh = [](const std::string& c2, const std::string& c3) {
    return with_law("yeoh = { c2 = " + c2 + ", c3 = " + c3 + ", unit = \"Pa\", source = \"h\" }");
  };
  const auto ogden = [](const std::string& constants) {
    return with_law("ogden = { " + constants + ", source = \"h\" }");
  };
  const auto refused = [](const std::string& text, const char* noun) {
    EXPECT_THAT(refusal(read_organ_config, text), HasSubstr(noun)) << text;
  };
  // 3 c2^2 = 5 c1 c3 at c2 = -394 Pa.
  EXPECT_EQ(refusal(read_organ_config, yeoh("-390", "100")), "");
  refused(yeoh("-400", "100"), ":10: [[region]] 1.yeoh: c2: ");
  refused(yeoh("10", "-1"), "3 c2^2 < 5 c1 c3");
  refused(yeoh("-1", "0"), "931");
  refused(yeoh("1e8", "0"), "c2: ");
  refused(yeoh("0", "1e8"), "c2: ");
  for (const char* exponent : {"0", "1.4", "-2.9", "51", "-51"})
    refused(ogden(std::string("exponent = ") + exponent), "exponent: expected a number from 1.5 to 50");
  refused(ogden("exponent = 2, share = 1, second_exponent = 9"), "share: ");
  refused(ogden("exponent = 2, share = 0, second_exponent = 9"), "share: ");
  refused(ogden("exponent = 2, share = 0.5, second_exponent = 1"), "second_exponent: ");
  refused(ogden("exponent = 2, share = 0.5"), "\"second_exponent\"");
  refused(ogden("exponent = 2, second_exponent = 9"), "second_exponent: expected share");
  refused(replaced(ogden("exponent = 2"), "[response]", "stiffening = { value = 2.5, source = \"g\" }\n[response]"),
          "stiffening: expected one law");
  refused(replaced(ogden("exponent = 2"), "[response]",
                   "yeoh = { c2 = 1, c3 = 1, unit = \"Pa\", source = \"g\" }\n[response]"),
          "ogden: expected one law");
}

const std::string kBoundary = R"(name = "back"
[[fixed]]
dofs = "xz"
select = { patch = "x0" }
[[fixed]]
dofs = "xyz"
select = [ { sphere = { center = [0, 0, 0], radius = 2 } }, { everything = true, where = "all" } ]
[touchable]
select = { half_space = { point = [1, 2, 3], normal = [0, 0, 1] } }
[preload]
gravity = { value = [0, 0, -9.81], unit = "m/s^2" }
[store]
interior = true
)";

const std::string kSupports = R"(name = "soft"
[[foundation]]
name = "diaphragm"
normal = { value = 0.2, unit = "kPa/mm", source = "a" }
tangential = { value = 500, unit = "N/m^3", source = "b" }
select = { patch = "z1" }
[[spring]]
name = "ligament"
from = { nearest = { points = [[1, 2, 3]] } }
to = [ { patch = "x0" }, { patch = "x1" } ]
stiffness = { value = 0.3, unit = "N/mm", source = "c" }
[[spring]]
name = "cord"
from = { patch = "y0" }
anchor = [1, 2, 3]
stiffness = { value = 20, unit = "N/m", source = "d" }
)";

TEST(BoundaryConfig, ReadsSoftSupportsInSiUnits) {
  const BoundaryConfig boundary = read_text(read_boundary_config, kSupports);
  EXPECT_TRUE(boundary.fixed.empty());
  ASSERT_EQ(boundary.foundations.size(), 1u);
  const auto& foundation = boundary.foundations[0];
  EXPECT_EQ(foundation.name, "diaphragm");
  EXPECT_DOUBLE_EQ(foundation.normal.value, 2e5);
  EXPECT_EQ(foundation.normal.source, "a");
  EXPECT_DOUBLE_EQ(foundation.tangential.value, 500);
  EXPECT_EQ(foundation.select.size(), 1u);
  ASSERT_EQ(boundary.springs.size(), 2u);
  EXPECT_DOUBLE_EQ(boundary.springs[0].stiffness.value, 300);
  EXPECT_EQ(boundary.springs[0].from[0].kind, Selector::Kind::nearest);
  EXPECT_EQ(boundary.springs[0].to.size(), 2u);
  EXPECT_FALSE(boundary.springs[0].anchor);
  EXPECT_TRUE(boundary.springs[1].to.empty());
  ASSERT_TRUE(boundary.springs[1].anchor);
  EXPECT_THAT(*boundary.springs[1].anchor, ElementsAre(1, 2, 3));
}

const std::string kMotions = kBoundary + R"([[motion]]
name = "diaphragm"
kind = "piston"
axis = [0, 0, 2]
select = { patch = "x0" }
[[motion]]
name = "tilt"
kind = "rotation"
axis = [1, 0, 0]
point = [1, 2, 3]
[[motion]]
name = "measured"
kind = "field"
file = "breath.csv"
[[motion]]
name = "filling"
kind = "pressure"
select = { label = { labels = [1], image = "painted.nrrd" } }
[[motion]]
name = "weight"
kind = "gravity"
)";

TEST(BoundaryConfig, ReadsMotions) {
  using Kind = BoundaryConfig::Motion::Kind;
  const BoundaryConfig boundary = read_text(read_boundary_config, kMotions);
  ASSERT_EQ(boundary.motions.size(), 5u);
  EXPECT_EQ(boundary.motions[0].kind, Kind::piston);
  EXPECT_THAT(boundary.motions[0].axis, ElementsAre(0, 0, 2));
  EXPECT_EQ(boundary.motions[0].select.size(), 1u);
  EXPECT_THAT(boundary.motions[1].point, ElementsAre(1, 2, 3));
  EXPECT_TRUE(boundary.motions[1].select.empty());
  EXPECT_EQ(boundary.motions[2].file, (NamedFile{"breath.csv", file().parent_path() / "breath.csv"}));
  EXPECT_EQ(boundary.motions[3].kind, Kind::pressure);
  EXPECT_EQ(boundary.motions[4].kind, Kind::gravity);
  EXPECT_THAT(files_of({}, boundary), ElementsAre(testing::Key("label_image_sha256 painted.nrrd"),
                                                  testing::Key("motion_file_sha256 breath.csv")));
}

TEST(BoundaryConfig, RefusesEachFaultOfAMotionInOneSentenceWithItsLine) {
  expect_refusals(read_boundary_config, kMotions,
                  {
                      {"\"piston\"", "\"shake\"", "[[motion]] 1: kind: "},
                      {"kind = \"piston\"\n", "", "the key \"kind\""},
                      {"axis = [0, 0, 2]\n", "", "the key \"axis\""},
                      {"[0, 0, 2]", "[0, 0, 0]", "axis: "},
                      {"[0, 0, 2]", "[0, 0]", "axis: expected"},
                      {"[0, 0, 2]", "\"up\"", "axis: expected"},
                      {"point = [1, 2, 3]\n", "", "the key \"point\""},
                      {"file = \"breath.csv\"\n", "", "the key \"file\""},
                      {"kind = \"gravity\"\n", "kind = \"gravity\"\naxis = [0, 0, 1]\n", "axis: "},
                      {"kind = \"gravity\"\n", "kind = \"gravity\"\nselect = { everything = true }\n",
                       "select: expected no select"},
                      {"kind = \"gravity\"\n", "kind = \"pressure\"\n", "the key \"select\""},
                      {"\"tilt\"", "\"diaphragm\"", "no other [[motion]]"},
                      {"\"tilt\"", "\"a\\nb\"", "without control characters"},
                      {"\"tilt\"", '"' + std::string(61, 'a') + '"', "at most 60 bytes"},
                      {"\"tilt\"", "\"\"", "name: "},
                      {"name = \"tilt\"", "name = \"tilt\"\namount = 3", "unknown key \"amount\""},
                  });
}

const std::string kCorridors = R"(name = "needle"
[[fixed]]
dofs = "xyz"
select = { everything = true }
[[corridor]]
name = "biopsy"
from = [1, 2, 3]
to = [4, 5, 6]
radius = 7
[[corridor]]
name = "ball"
from = [1, 1, 1]
to = [1, 1, 1]
radius = 0.5
)";

TEST(BoundaryConfig, ReadsCorridors) {
  const BoundaryConfig boundary = read_text(read_boundary_config, kCorridors);
  ASSERT_EQ(boundary.corridors.size(), 2u);
  EXPECT_EQ(boundary.corridors[0].name, "biopsy");
  EXPECT_THAT(boundary.corridors[0].from, ElementsAre(1, 2, 3));
  EXPECT_THAT(boundary.corridors[0].to, ElementsAre(4, 5, 6));
  EXPECT_EQ(boundary.corridors[0].radius, 7);
  EXPECT_EQ(boundary.corridors[1].line, 10);
}

TEST(BoundaryConfig, RefusesEachFaultOfACorridorInOneSentenceWithItsLine) {
  expect_refusals(read_boundary_config, kCorridors,
                  {
                      {"radius = 7", "radius = 0", ":9: [[corridor]] 1: radius: "},
                      {"radius = 7", "radius = -1", ":9: [[corridor]] 1: radius: "},
                      {"radius = 7\n", "", "the key \"radius\""},
                      {"from = [1, 2, 3]\n", "", "the key \"from\""},
                      {"to = [4, 5, 6]\n", "", "the key \"to\" is missing"},
                      {"[1, 2, 3]", "[1, 2]", "from: "},
                      {"[4, 5, 6]", "[4, 5, -1e300]", "to: "},
                      {"\"ball\"", "\"biopsy\"", "no other [[corridor]]"},
                      {"\"ball\"", "\"a\\nb\"", "without control characters"},
                      {"radius = 7", "radius = 7\nlength = 3", "unknown key \"length\""},
                  });
  std::string many = kCorridors;
  for (int i = 3; i <= 17; ++i)
    many += "[[corridor]]\nname = \"" + std::to_string(i) + "\"\nfrom = [0, 0, 0]\nto = [0, 0, 0]\nradius = 1\n";
  EXPECT_THAT(refusal(read_boundary_config, many), HasSubstr(":85: expected at most 16"));
}

const std::string kCut = R"(name = "scalpel"
[[fixed]]
dofs = "xyz"
select = { everything = true }
[cut]
region = [{ sphere = { center = [1, 2, 3], radius = 4 } },
          { and = [{ everything = true }, { box = { min = [0, 0, 0], max = [1, 1, 1] }, where = "surface" }] }]
)";

TEST(BoundaryConfig, ReadsTheRegionOfACutWithNodesInsideUnlessItSaysOther) {
  const BoundaryConfig boundary = read_text(read_boundary_config, kCut);
  ASSERT_TRUE(boundary.cut);
  EXPECT_EQ(boundary.cut->line, 5);
  ASSERT_EQ(boundary.cut->region.size(), 2u);
  EXPECT_EQ(boundary.cut->region[0].kind, Selector::Kind::sphere);
  EXPECT_TRUE(boundary.cut->region[0].whole_mesh);
  EXPECT_TRUE(boundary.cut->region[1].inner[0].whole_mesh);
  EXPECT_FALSE(boundary.cut->region[1].inner[1].whole_mesh);
  EXPECT_FALSE(boundary.fixed[0].select[0].whole_mesh) << "elsewhere nodes are those of the surface";
  EXPECT_FALSE(read_text(read_boundary_config, kCorridors).cut);
}

TEST(BoundaryConfig, RefusesEachFaultOfACutInOneSentenceWithItsLine) {
  expect_refusals(read_boundary_config, kCut,
                  {
                      {"region = [{ sphere", "regions = [{ sphere", "the key \"region\""},
                      {"radius = 4", "radius = -4", "radius: "},
                      {"[cut]", "[cut]\ndepth = 3", "unknown key \"depth\""},
                      {"sphere =", "facing = { direction = [0, 0, 1], within = 40 }, sphere =", "exactly one of"},
                  });
}

TEST(BoundaryConfig, RefusesEachFaultOfASoftSupportInOneSentenceWithItsLine) {
  const auto with = [](const std::string& from, const std::string& to) {
    return refusal(read_boundary_config, replaced(kSupports, from, to));
  };
  expect_refusals(read_boundary_config, kSupports,
                  {
                      {"\"kPa/mm\"", "\"kPa\"", ":4: [[foundation]] 1.normal: unit: "},
                      {"value = 0.2", "value = -0.2", "normal: "},
                      {", source = \"a\"", "", ":4: [[foundation]] 1.normal: the key \"source\""},
                      {"value = 0.2, unit = \"kPa/mm\", source = \"a\" }\ntangential = { value = 500",
                       "value = 0, unit = \"kPa/mm\", source = \"a\" }\ntangential = { value = 0", "normal:"},
                      {"value = 20", "value = 0", "stiffness: "},
                      {"{ patch = \"y0\" }", "{ patch = \"y0\" }\nto = { patch = \"x1\" }", "[[spring]] 2: anchor: "},
                      {"\"cord\"", "\"ligament\"", "[[spring]] 2: name: "},
                      {"to = [ { patch = \"x0\" }", "to = [ { path = \"x0\" }", ":10: select: "},
                      {"from = { patch = \"y0\" }", "", "[[spring]] 2: the key \"from\""},
                  });
  EXPECT_EQ(with("value = 0.2", "value = 0"), "");  // the tangential stiffness is left
}

TEST(BoundaryConfig, IsRead) {
  const BoundaryConfig boundary = read_text(read_boundary_config, kBoundary);
  EXPECT_EQ(boundary.name, "back");
  ASSERT_EQ(boundary.fixed.size(), 2u);
  EXPECT_THAT(boundary.fixed[0].dofs, ElementsAre(true, false, true));
  ASSERT_EQ(boundary.fixed[1].select.size(), 2u);
  EXPECT_EQ(boundary.fixed[1].select[0].kind, Selector::Kind::sphere);
  EXPECT_FALSE(boundary.fixed[1].select[0].whole_mesh);
  EXPECT_TRUE(boundary.fixed[1].select[1].whole_mesh);
  EXPECT_EQ(boundary.touchable.size(), 1u);
  ASSERT_TRUE(boundary.gravity.has_value());
  EXPECT_THAT(*boundary.gravity, ElementsAre(0, 0, -9.81));
  EXPECT_TRUE(boundary.store_interior);
}

TEST(BoundaryConfig, RefusesEachFaultInOneSentenceWithItsLine) {
  expect_refusals(read_boundary_config, kBoundary,
                  {
                      {"\"xz\"", "\"xw\"", ":3: [[fixed]] 1: dofs: "},
                      {"-9.81", "-9.81e6", "gravity: value: "},
                      {"\"xz\"", "\"xx\"", "each once"},
                      {"{ patch = \"x0\" }", "{ path = \"x0\" }", ":4: select: "},
                      {"{ patch = \"x0\" }", "{ patch = \"x0\", everything = true }", "expected exactly one of"},
                      {"{ patch = \"x0\" }", "{ patch = \"x0\", size = 3 }", "unknown key \"size\""},
                      {"{ patch = \"x0\" }", "[]", ":4: [[fixed]] 1: select: "},
                      {"radius = 2", "radius = -2", "a radius above 0"},
                      {"center = [0, 0, 0]", "center = [0, 0]", "three numbers"},
                      {"where = \"all\"", "where = \"inside\"", "surface, all"},
                      {"normal = [0, 0, 1]", "normal = [0, 0, 0]", "a vector that is not zero"},
                      {"interior = true", "interior = 1", ":13: store: interior: "},
                  });
  EXPECT_THAT(refusal(read_boundary_config, "name = \"a\"\n"), HasSubstr("[[fixed]], [[foundation]] or [[spring]]"));
}

// A box of 2 x 2 x 2 cells of size 1. Node number = i + 3 (j + 3 k); node 13 is the only one inside.
class Selectors : public ::testing::Test {
 protected:
  std::vector<std::int32_t> select(const std::string& selector) {
    const std::string text = "name = \"t\"\n[[fixed]]\ndofs = \"x\"\nselect = " + selector + "\n";
    const BoundaryConfig boundary = read_text(read_boundary_config, text);
    return select_nodes(boundary.fixed[0].select, mesh_, surface_, file());
  }
  std::string refused(const std::string& selector) {
    return input_error([&] { select(selector); });
  }
  void SetUp() override {
    mesh_ = box_mesh({2, 2, 2}, {2, 2, 2});
    mesh_.region_names = {"low", "high"};
    for (std::size_t t = 0; t < mesh_.tetrahedra.size(); ++t) {
      double z = 0;
      for (const auto n : mesh_.tetrahedra[t]) z += mesh_.nodes[n][2] / 4;
      mesh_.region[t] = z > 1;
    }
    for (std::int32_t n = 0; n < 27; ++n)
      if (n != 13) surface_.push_back(n);
  }
  TetrahedralMesh mesh_;
  std::vector<std::int32_t> surface_;
};

TEST_F(Selectors, FacingTakesSurfaceNodesWhoseNormalIsNearADirection) {
  // The middles of the faces have the faces' normals; those of edges and corners lie between.
  EXPECT_THAT(select("{ facing = { direction = [0, 0, 3], within = 1 } }"), ElementsAre(22));
  EXPECT_THAT(select("{ facing = { direction = [1, 0, 1], within = 1 } }"), ElementsAre(23));
  EXPECT_EQ(select("{ facing = { direction = [0, 0, 1], within = 60 } }").size(), 9u);
  EXPECT_EQ(select("{ facing = { direction = [0, 0, 1], within = 180 } }").size(), 26u);
  EXPECT_THAT(refused("{ facing = { direction = [0, 0, 1], within = 0 } }"), HasSubstr("an angle above 0"));
  EXPECT_THAT(refused("{ facing = { direction = [0, 0, 1], within = 9 }, where = \"all\" }"),
              HasSubstr("have no normal"));
}
TEST_F(Selectors, AndOrAndNotCombineOthers) {
  const std::string low = "{ half_space = { point = [0, 0, 0], normal = [0, 0, 1] } }";
  const std::string left = "{ half_space = { point = [0, 0, 0], normal = [1, 0, 0] } }";
  EXPECT_THAT(select("{ and = [" + low + ", " + left + "] }"), ElementsAre(0, 3, 6));
  EXPECT_EQ(select("{ or = [" + low + ", " + left + "] }").size(), 15u);
  EXPECT_EQ(select("{ not = [" + low + ", " + left + "] }").size(), 26u - 15);
  EXPECT_EQ(select("{ not = " + low + " }").size(), 17u);
  EXPECT_EQ(select("{ not = " + low + ", where = \"all\" }").size(), 18u);
  EXPECT_THAT(select("{ and = [" + low + ", { not = { or = [" + left + ", { patch = \"x1\" }] } }] }"),
              ElementsAre(1, 4, 7));
  // Nodes inside, as the inner selector says.
  EXPECT_EQ(select("{ or = [{ everything = true, where = \"all\" }] }").size(), 27u);
}
TEST_F(Selectors, ACombinationNamesTheLineOfTheSelectorThatPicksNothing) {
  const std::string far = "{ box = { min = [8, 8, 8], max = [9, 9, 9] } }", low = "{ patch = \"z0\" }",
                    high = "{ patch = \"z1\" }";
  EXPECT_THAT(refused("{ and = [\n" + low + ",\n" + far + "\n] }"), HasSubstr(":6: this selector"));
  EXPECT_THAT(refused("{ and = [" + low + ", " + high + "] }"), HasSubstr(":4: this selector"));
  EXPECT_THAT(refused("{ not = { everything = true } }"), HasSubstr("26 surface nodes"));
  EXPECT_THAT(refused("{ and = [] }"), HasSubstr("and: expected"));
}
TEST_F(Selectors, FilesOfOneNameInTwoFoldersHaveTwoKeys) {
  const std::string text = R"(name = "t"
[[fixed]]
dofs = "x"
select = { label = { labels = [3], image = "a/labels.nii" } }
[[fixed]]
dofs = "yz"
select = { not = { label = { labels = [3], image = "../b/labels.nii" } } }
[[motion]]
name = "in"
kind = "field"
file = "in/field.csv"
[[motion]]
name = "out"
kind = "field"
file = "out/field.csv"
)";
  const auto folder = file().parent_path();
  EXPECT_THAT(files_of({}, read_text(read_boundary_config, text)),
              ElementsAre(testing::Pair("label_image_sha256 ../b/labels.nii", folder / "../b/labels.nii"),
                          testing::Pair("label_image_sha256 a/labels.nii", folder / "a/labels.nii"),
                          testing::Pair("motion_file_sha256 in/field.csv", folder / "in/field.csv"),
                          testing::Pair("motion_file_sha256 out/field.csv", folder / "out/field.csv")));
}

TEST_F(Selectors, LabelAsksForTheNodesNearItsLabels) {
  const std::string text =
      "name = \"t\"\n[[fixed]]\ndofs = \"x\"\nselect = { and = [{ label = { labels = [3, 5], within = 2, "
      "image = \"painted.nrrd\" } }, { label = { labels = [7] } }] }\n";
  const BoundaryConfig boundary = read_text(read_boundary_config, text);
  EXPECT_THAT(files_of({}, boundary),
              ElementsAre(testing::Pair("label_image_sha256 painted.nrrd", file().parent_path() / "painted.nrrd")));
  std::vector<std::vector<double>> asked;
  const auto nodes = select_nodes(boundary.fixed[0].select, mesh_, surface_, file(), [&](const Selector& s) {
    asked.push_back(s.labels);
    std::vector<char> near(mesh_.nodes.size(), 0);
    near[2] = near[13] = 1;
    near[s.labels.size() == 2 ? 5 : 6] = 1;
    return near;
  });
  EXPECT_THAT(nodes, ElementsAre(2));
  EXPECT_THAT(asked, ElementsAre(std::vector<double>{3, 5}, std::vector<double>{7}));
  EXPECT_THAT(refused("{ label = { labels = [7] } }"), HasSubstr(":4: label: "));
  EXPECT_THAT(refused("{ label = { labels = [7], within = -1 } }"), HasSubstr("a distance of 0 or above"));
  EXPECT_THAT(refused("{ label = { labels = [] } }"), HasSubstr("labels: "));
}
TEST_F(Selectors, BoxTakesItsBoundaryToo) {
  EXPECT_THAT(select("{ box = { min = [0, 0, 0], max = [1, 1, 0] } }"), ElementsAre(0, 1, 3, 4));
}
TEST_F(Selectors, SphereTakesNodesWithinTheRadius) {
  EXPECT_THAT(select("{ sphere = { center = [0, 0, 0], radius = 1 } }"), ElementsAre(0, 1, 3, 9));
}
TEST_F(Selectors, HalfSpaceTakesTheSideTheNormalPointsAwayFrom) {
  EXPECT_THAT(select("{ half_space = { point = [0, 0, 0], normal = [2, 0, 0] } }"),
              ElementsAre(0, 3, 6, 9, 12, 15, 18, 21, 24));
}
TEST_F(Selectors, NearestTakesOneNodeForEachPoint) {
  EXPECT_THAT(select("{ nearest = { points = [[2.1, 2.2, 1.9], [-3, 0.1, 0]] } }"), ElementsAre(0, 26));
}
TEST_F(Selectors, NearestWarnsOfAPlaceFartherThanAnEdgeFromItsNode) {
  forget_warnings();
  select("{ nearest = { points = [[2.1, 2.2, 1.9], [-0.9, 0, 0]] } }");
  EXPECT_THAT(warnings(), ::testing::IsEmpty());
  select("{ nearest = { points = [[2, 2, 2], [300, 2, 2]] } }");
  ASSERT_EQ(warnings().size(), 1u);
  EXPECT_THAT(warnings()[0], HasSubstr(":4: nearest: [300, 2, 2] is 298 "));
}
TEST_F(Selectors, BelowQuantileTakesTheShareOfNodesThatIsLowestAndThoseLevelWithIt) {
  // There are 26 surface nodes, 9 of them at x = 0. A fifth of 26 is 6 nodes, which all have x = 0.
  EXPECT_THAT(select("{ below_quantile = { direction = [1, 0, 0], quantile = 0.2 } }"),
              ElementsAre(0, 3, 6, 9, 12, 15, 18, 21, 24));
  EXPECT_EQ(select("{ below_quantile = { direction = [0, 0, 1], quantile = 1 } }").size(), 26u);
  EXPECT_THAT(select("{ below_quantile = { direction = [-1, -1, -1], quantile = 0.03 } }"), ElementsAre(26));
}
TEST_F(Selectors, PatchTakesTheNodesOfANamedSurface) {
  EXPECT_THAT(select("{ patch = \"z1\" }"), ElementsAre(18, 19, 20, 21, 22, 23, 24, 25, 26));
  EXPECT_THAT(refused("{ patch = \"top\" }"), HasSubstr(":4: the mesh has no surface patch \"top\""));
}
TEST_F(Selectors, ContactTakesTheNodesThatTwoRegionsShareAlsoInside) {
  EXPECT_THAT(select("{ contact = [\"low\", \"high\"] }"), ElementsAre(9, 10, 11, 12, 13, 14, 15, 16, 17));
  EXPECT_THAT(select("{ contact = [\"low\", \"high\"], where = \"surface\" }"),
              ElementsAre(9, 10, 11, 12, 14, 15, 16, 17));
  EXPECT_THAT(refused("{ contact = [\"low\", \"bone\"] }"), HasSubstr("region \"bone\""));
}
TEST_F(Selectors, EverythingTakesTheSurfaceOrTheWholeMesh) {
  EXPECT_EQ(select("{ everything = true }"), surface_);
  EXPECT_EQ(select("{ everything = true, where = \"all\" }").size(), 27u);
}
TEST_F(Selectors, OfOneArrayAreUnited) {
  EXPECT_THAT(select("[ { nearest = { points = [[0, 0, 0]] } }, { nearest = { points = [[2, 0, 0], [0, 0, 0]] } } ]"),
              ElementsAre(0, 2));
}
TEST_F(Selectors, ThatPickNothingAreRefused) {
  EXPECT_THAT(refused("{ sphere = { center = [9, 9, 9], radius = 1 } }"), HasSubstr(":4: this selector"));
}

}  // namespace
}  // namespace palpate::tests
