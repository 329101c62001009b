// Warnings of sizes, stiffnesses and supports that no organ has: each with its figure and what was meant.
#include "precompute/elements/plausibility.h"

#include <gmock/gmock.h>

#include <fstream>

#include "studies/bodies/box_mesh.h"
#include "tests/support/test_files.h"
#include "tests/support/texts.h"

namespace palpate::tests {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const std::string kOrgan = R"(name = "spleen"
mesh_unit = "mm"
frame = "none"
element = "p1-anp"
[[region]]
name = "spleen"
young = { value = 5.4, unit = "kPa", source = "Author 1999, table 1" }
poisson = { value = 0.45, source = "assumed" }
)";
const std::string kHeldAtOneEnd = "name = \"end\"\n[[fixed]]\ndofs = \"xyz\"\nselect = { patch = \"x0\" }\n";

class Plausibility : public testing::Test {
 protected:
  void SetUp() override { folder_ = fresh_folder(); }

  void write(const std::filesystem::path& name, const std::string& text) { std::ofstream(folder_ / name) << text; }

  // size: of a box in the mesh's unit.
  std::vector<std::string> warned(const std::string& organ, std::array<double, 3> size = {60, 50, 40},
                                  const std::string& boundary = kHeldAtOneEnd) {
    write("organ.toml", organ);
    write("end.toml", boundary);
    const BodyFiles files{"box.msh", folder_ / "organ.toml", folder_ / "end.toml"};
    TetrahedralMesh mesh = box_mesh({6, 5, 4}, size, 0.1);
    mesh.region_names = {"spleen"};
    const OrganConfig config = read_organ_config(files.organ);
    return plausibility_warnings(make_elastic_body(mesh, config, read_boundary_config(files.boundary), files), config,
                                 files);
  }

  std::filesystem::path folder_;
};

TEST_F(Plausibility, SaysNothingOfAnOrganAsTheyAre) {
  EXPECT_THAT(warned(kOrgan), IsEmpty());
}

TEST_F(Plausibility, WarnsOfAnOrganBelowACentimetreOrAboveAMetre) {
  EXPECT_THAT(warned(replaced(kOrgan, "\"mm\"", "\"m\""), {104, 50, 40}),
              ElementsAre(AllOf(HasSubstr("box.msh: the organ is 104 m long"), HasSubstr("104 mm"))));
  EXPECT_THAT(warned(kOrgan, {0.104, 0.05, 0.04}),
              ElementsAre(AllOf(HasSubstr("0.000104 m long"), HasSubstr("104 mm"))));
  EXPECT_THAT(warned(kOrgan, {10.01, 10, 10}), IsEmpty());
  EXPECT_THAT(warned(kOrgan, {999, 500, 400}), IsEmpty());
}

TEST_F(Plausibility, WarnsOfAStiffnessThatNoTissueHas) {
  EXPECT_THAT(warned(replaced(kOrgan, "kPa", "GPa")),
              ElementsAre(HasSubstr("organ.toml: [[region]] \"spleen\": young is 5.4 GPa")));
  EXPECT_THAT(warned(replaced(kOrgan, "kPa", "Pa")), ElementsAre(HasSubstr("5.4 kPa")));
  EXPECT_THAT(warned(replaced(kOrgan, "5.4", "0.101")), IsEmpty());
  EXPECT_THAT(warned(replaced(kOrgan, "5.4", "9999")), IsEmpty());
}

TEST_F(Plausibility, WarnsOfASmallHeldArea) {
  const std::string sentence = "end.toml: 0 %";
  EXPECT_THAT(warned(kOrgan, {60, 50, 40},
                     "name = \"points\"\n[[fixed]]\ndofs = \"xyz\"\nselect = { nearest = { points = [[0, 0, 0], [60, "
                     "0, 0], [0, 50, "
                     "0]] } }\n"),
              ElementsAre(HasSubstr(sentence)));
  // Soft supports hold too.
  EXPECT_THAT(warned(kOrgan, {60, 50, 40},
                     "name = \"soft\"\n[[foundation]]\nname = \"diaphragm\"\nselect = { patch = \"x0\" }\n"
                     "normal = { value = 1e6, unit = \"N/m^3\", source = \"assumed\" }\n"
                     "tangential = { value = 1e6, unit = \"N/m^3\", source = \"assumed\" }\n"),
              IsEmpty());
  EXPECT_THAT(warned(kOrgan, {60, 50, 40},
                     "name = \"springs\"\n[[spring]]\nname = \"ligament\"\nfrom = { patch = \"x0\" }\n"
                     "stiffness = { value = 30, unit = \"N/m\", source = \"assumed\" }\n"),
              IsEmpty());
  // Held along one axis is held: 60 x 50 of 14,800 mm2.
  EXPECT_THAT(warned(kOrgan, {60, 50, 40}, replaced(replaced(kHeldAtOneEnd, "xyz", "z"), "x0", "z0")), IsEmpty());
}

}  // namespace
}  // namespace palpate::tests
