// palpate-precompute as its users run it: the bundle, the error messages, several ranks. PALPATE_PRECOMPUTE is its
// path.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>

#include "formats/program.h"
#include "tests/precompute/program_fixture.h"

namespace palpate::tests {
namespace {

using formats::SectionId;
using ::testing::HasSubstr;

class Program : public ProgramFixture {};

TEST_F(Program, WritesABundleThatTheReaderAccepts) {
  const std::string bytes = made("a.h5", "--image box.msh");
  const auto index = index_of(bytes);
  EXPECT_EQ(index.counts.nodes, 7u * 6 * 5);
  EXPECT_EQ(index.counts.surface_nodes, 210u - 5 * 4 * 3);
  EXPECT_EQ(index.counts.touchable, index.counts.surface_nodes - 6 * 5);  // all but the clamped face
  EXPECT_EQ(formats::find_section(index, SectionId::displacement_interior), nullptr);
  // Coordinates are in metres; surface nodes come first, in the order of the file.
  const auto nodes = section<double>(bytes, SectionId::nodes);
  EXPECT_DOUBLE_EQ(nodes[3], 0.01);
  for (const double r : section<double>(bytes, SectionId::residual)) EXPECT_LE(r, 1e-9);
  const std::string text = text_section(bytes, SectionId::provenance);
  for (const char* key : {"\"solver\":\"PETSc", "\"reciprocity_error\":", "\"cast_error\":", "\"image_sha256\":\"",
                          "\"young_source box\":\"test\""})
    EXPECT_THAT(text, HasSubstr(key));
  // T^u of a node at that node is the identity on its free dofs.
  const auto touchable = section<std::int32_t>(bytes, SectionId::touchable);
  const auto fixed = section<std::uint8_t>(bytes, SectionId::fixed);
  const auto rows = section<float>(bytes, SectionId::displacement_surface);
  const std::size_t surface = index.counts.surface_nodes;
  for (std::size_t k = 0; k < touchable.size(); ++k)
    for (std::size_t j = 0; j < 3; ++j)
      for (std::size_t i = 0; i < 3; ++i) {
        const auto n = static_cast<std::size_t>(touchable[k]);
        ASSERT_EQ(rows[((3 * k + j) * surface + n) * 3 + i], i == j && !fixed[3 * n + j] ? 1.0f : 0.0f);
      }
}

TEST_F(Program, GivesTheSameBytesFromOneToFourRanksAndAgain) {
  const std::string one = made("one.h5", "--batch 24");
  EXPECT_TRUE(made("again.h5", "--batch 24") == one);
  for (const int ranks : {2, 3, 4}) EXPECT_TRUE(made("more.h5", "--batch 24", ranks) == one) << ranks << " ranks";
}

std::size_t count_of(const std::string& text, const std::string& what) {
  std::size_t count = 0;
  for (auto at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++count;
  return count;
}

// PETSc itself says what it did with each batch: 160 touchable nodes, 8 in a batch of 24 columns.
TEST_F(Program, EveryBatchOfColumnsGoesThroughPetscsConjugateGradients) {
  const std::string views = "--element-stiffness --batch 24 -- -ksp_converged_reason -ksp_view";
  const std::string factor = made("factor.h5", views);
  const std::size_t of_element = 2;
  const std::size_t batches = (index_of(factor).counts.touchable + 7) / 8 + of_element;
  EXPECT_TRUE(said_.find("PETSc CG on 1 rank, preconditioner: ") != std::string::npos) << said_;
  EXPECT_EQ(count_of(said_, "Linear solve converged due to CONVERGED_RTOL iterations 0\n"), batches) << said_;
  EXPECT_EQ(count_of(said_, "PC Object: (column_) 1 MPI process\n  type: supernodal\n"), batches) << said_;
  EXPECT_EQ(count_of(said_, "KSP Object: 1 MPI process\n  type: cg\n"), batches) << said_;
  for (const auto n : section<std::int32_t>(factor, SectionId::iterations)) ASSERT_EQ(n, 0);

  // CG starts from zero with the same preconditioner: one iteration, then the test of the true residuals.
  const std::string zero = made("zero.h5", "--element-stiffness --batch 24 -- -ksp_converged_reason -ksp_knoll 0");
  EXPECT_EQ(count_of(said_, "CONVERGED_RTOL iterations 1\n"), batches) << said_;
  EXPECT_EQ(count_of(said_, "CONVERGED_RTOL iterations 0\n"), batches) << said_;
  for (const auto n : section<std::int32_t>(zero, SectionId::iterations)) ASSERT_LE(n, 1);

  const auto iterations = section<std::int32_t>(
      made("multigrid.h5", "--batch 24 -- -column_pc_type multigrid -ksp_view -ksp_monitor"), SectionId::iterations);
  EXPECT_THAT(said_, HasSubstr("PC Object: (column_) 1 MPI process\n  type: multigrid\n"));
  EXPECT_THAT(said_, HasSubstr(" 10 KSP Residual norm"));
  EXPECT_GT(*std::max_element(iterations.begin(), iterations.end()), 5);
}

TEST_F(Program, StoresALawOfYeohAndNoneWhereStiffeningSaysAll) {
  EXPECT_TRUE(section<double>(made("neo.h5", "--large-deformation"), SectionId::large_law).empty());
  write("organ.toml", kOrgan + "yeoh = { c2 = 0.1, c3 = 2, unit = \"kPa\", source = \"a paper\" }\n");
  const std::string bytes = made("yeoh.h5", "--large-deformation");
  EXPECT_EQ(section<double>(bytes, SectionId::large_law), (std::vector<double>{1, 100, 2000, 0}));
  EXPECT_EQ(section<double>(bytes, SectionId::large_stiffening), std::vector<double>{-1});
  EXPECT_THAT(bytes, HasSubstr("\"law_source "));
}

TEST_F(Program, StoresAnOrderOfEliminationForLargeDeformation) {
  write("organ.toml", kOrgan + "stiffening = { value = 2.5, source = \"test\" }\n");
  for (const std::string options : {"", "-- -column_pc_type multigrid"}) {
    const std::string bytes = made("large.h5", "--large-deformation " + options);
    EXPECT_EQ(section<double>(bytes, SectionId::large_stiffening), std::vector<double>{2.5});
    auto order = section<std::int32_t>(bytes, SectionId::large_order);
    const auto fixed = section<std::uint8_t>(bytes, SectionId::fixed);
    std::vector<std::int32_t> free;
    for (std::size_t n = 0; n < fixed.size() / 3; ++n)
      if (!fixed[3 * n] || !fixed[3 * n + 1] || !fixed[3 * n + 2]) free.push_back(static_cast<std::int32_t>(n));
    EXPECT_NE(order, free) << "not an elimination's order";
    std::sort(order.begin(), order.end());
    EXPECT_EQ(order, free);
  }
  EXPECT_TRUE(section<std::int32_t>(made("linear.h5"), SectionId::large_order).empty());
  EXPECT_TRUE(section<std::int32_t>(file_bytes(folder_ / "large.h5"), SectionId::large_support_nodes).empty());
  write("organ.toml", std::string(kOrgan).replace(kOrgan.find("\"p1\""), 4, "\"p2-p0\""));
  EXPECT_EQ(run("no.h5", "--large-deformation"), 2);
  EXPECT_THAT(said_, HasSubstr("found p2-p0"));
}

TEST_F(Program, StoresTheInteriorByTheOptionAsByTheKey) {
  const auto inside = [](const std::string& bytes) { return section<float>(bytes, SectionId::displacement_interior); };
  EXPECT_TRUE(inside(made("surface.h5")).empty());
  const auto by_option = inside(made("option.h5", "--interior"));
  write("bc.toml", kBoundary + "[store]\ninterior = true\n");
  EXPECT_FALSE(by_option.empty());
  EXPECT_EQ(by_option, inside(made("key.h5")));
}

TEST_F(Program, StoresTheStiffnessOfSoftSupportsForLargeDeformation) {
  write("bc.toml",
        "name = \"soft\"\n[[foundation]]\nname = \"below\"\nselect = { patch = \"x0\" }\n"
        "normal = { value = 3e5, unit = \"N/m^3\", source = \"test\" }\n"
        "tangential = { value = 1e5, unit = \"N/m^3\", source = \"test\" }\n"
        "[[spring]]\nname = \"rope\"\nfrom = { patch = \"x1\" }\nstiffness = { value = 40, unit = \"N/m\", source = "
        "\"test\" }\n");
  const std::string bytes = made("large.h5", "--large-deformation");
  const auto nodes = section<std::int32_t>(bytes, SectionId::large_support_nodes);
  const auto stiffness = section<double>(bytes, SectionId::large_support_stiffness);
  ASSERT_EQ(9 * nodes.size(), 2 * stiffness.size());
  // A shift of the whole box by 1 m feels all of the foundation's 50 x 40 mm, and the springs along every axis.
  double force[3] = {};
  for (std::size_t p = 0; 9 * p < stiffness.size(); ++p)
    for (std::size_t i = 0; i < 3; ++i)
      force[i] += (nodes[2 * p] == nodes[2 * p + 1] ? 1 : 2) * stiffness[9 * p + 4 * i];
  EXPECT_NEAR(force[0], 3e5 * 0.05 * 0.04 + 40, 1e-9 * force[0]);
  EXPECT_NEAR(force[1], 1e5 * 0.05 * 0.04 + 40, 1e-9 * force[1]);
  EXPECT_NEAR(force[2], 1e5 * 0.05 * 0.04 + 40, 1e-9 * force[2]);
  EXPECT_TRUE(section<std::int32_t>(made("linear.h5"), SectionId::large_support_nodes).empty());
}

TEST_F(Program, GivesTheSameBytesFromOneAndTwoRanksWithMultigrid) {
  const std::string options = "--batch 24 -- -column_pc_type gamg";
  EXPECT_TRUE(made("one.h5", options) == made("two.h5", options, 2));
}

TEST_F(Program, GivesTheSameBytesForAnyNumberOfRanksWithThePressureFormInEitherPrecision) {
  write("organ.toml", std::string(kOrgan).replace(kOrgan.find("\"p1\""), 4, "\"p1-anp\""));
  const char* kinds[2] = {"supernodal", "supernodal_single"};
  std::vector<float> found[2];
  for (const int single : {0, 1}) {
    const std::string options = fmt::format("--batch 24 -- -column_pc_type {}", kinds[single]);
    const std::string one = made("one.h5", options);
    EXPECT_THAT(said_, HasSubstr(single ? "quasi-definite factor in single precision)" : "quasi-definite factor)"));
    found[single] = section<float>(one, SectionId::displacement_surface);
    for (const double r : section<double>(one, SectionId::residual)) EXPECT_LE(r, 1e-9);
    for (const int ranks : {2, 3}) EXPECT_TRUE(made("more.h5", options, ranks) == one) << kinds[single] << ' ' << ranks;
  }
  ASSERT_EQ(found[0].size(), found[1].size());
  for (std::size_t i = 0; i < found[0].size(); ++i) ASSERT_NEAR(found[0][i], found[1][i], 2e-7);
}

TEST_F(Program, GivesTheSameTensorsWithMultigridAsWithAFactor) {
  const std::string factor = made("factor.h5"), multigrid = made("multigrid.h5", "--memory 0.0001 --tolerance 1e-11");
  EXPECT_THAT(said_, HasSubstr("PETSc CG with algebraic multigrid"));
  const auto a = section<float>(factor, SectionId::displacement_surface);
  const auto b = section<float>(multigrid, SectionId::displacement_surface);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) ASSERT_NEAR(a[i], b[i], 2e-7);  // one rounding of f32 near 1, twice
  for (const auto n : section<std::int32_t>(multigrid, SectionId::iterations)) ASSERT_LT(n, 200);
}

TEST_F(Program, SolvesAMeshTooSmallForLevelsWithMultigrid) {
  write_mesh(folder_ / "box.msh", box_mesh({1, 1, 1}, {10, 10, 10}));
  write("bc.toml", "name = \"one\"\n[[fixed]]\ndofs = \"xyz\"\nselect = { patch = \"x0\" }\n");
  EXPECT_EQ(run("x.h5", "-- -column_pc_type gamg"), 0) << said_;
}

TEST_F(Program, StoresTheInteriorOnlyWhenAsked) {
  ASSERT_EQ(run("surface.h5"), 0) << said_;
  write("bc.toml", kBoundary + "[touchable]\nselect = { patch = \"x1\" }\n[store]\ninterior = true\n");
  const std::string bytes = made("volume.h5");
  const auto index = index_of(bytes);
  EXPECT_EQ(index.counts.touchable, 6u * 5);
  const auto* interior = formats::find_section(index, SectionId::displacement_interior);
  ASSERT_NE(interior, nullptr);
  EXPECT_EQ(interior->shape[2], 5u * 4 * 3);
  // A push on the end face moves the inside too, but less than the touched node.
  double most = 0;
  for (const float u : section<float>(bytes, SectionId::displacement_interior))
    most = std::max(most, std::abs(static_cast<double>(u)));
  EXPECT_GT(most, 0.05);
  EXPECT_LT(most, 1);
}

TEST_F(Program, StoresDoublesWhenAsked) {
  ASSERT_EQ(run("f64.h5", "--store f64"), 0) << said_;
  const auto rounded = section<float>(made("f32.h5"), SectionId::displacement_surface);
  const std::string bytes = file_bytes(folder_ / "f64.h5");
  const auto exact = section<double>(bytes, SectionId::displacement_surface);
  ASSERT_EQ(rounded.size(), exact.size());
  for (std::size_t i = 0; i < exact.size(); ++i) ASSERT_EQ(rounded[i], static_cast<float>(exact[i]));
  EXPECT_THAT(text_section(bytes, SectionId::provenance), HasSubstr("\"cast_error\":0.0"));
}

// The error that --low-rank allows, the one that is stated, and the one that is found against the solved columns.
TEST_F(Program, PacksItsColumnsWhenAskedAndStatesWhatThatCosts) {
  const std::string solved = made("solved.h5", "--batch 24");
  const struct {
    const char *options, *words;
    double allowed;
  } forms[] = {{"--low-rank 1e-2", "f32 compliance in", 1e-2},
               {"--low-rank 1e-2 --store f16", "f16 compliance in", 1.1e-2},  // and the rounding to f16
               {"--store f16", "f16 rows", 1e-3}};
  for (const auto& form : forms) {
    const std::string options = std::string("--batch 24 ") + form.options;
    const std::string packed = made("packed.h5", options);
    EXPECT_THAT(said_, HasSubstr(form.words));
    EXPECT_LT(packed.size(), solved.size());
    for (const char* ending : {".part", ".part.new", ".journal"})
      EXPECT_FALSE(std::filesystem::exists(folder_ / (std::string("packed.h5") + ending))) << ending;
    const auto provenance = nlohmann::json::parse(text_section(packed, SectionId::provenance));
    EXPECT_GT(provenance["stored_error"], 0.0);
    EXPECT_LE(provenance["stored_error"], form.allowed);
    EXPECT_LE(provenance["worst_residual"], 1e-9);
    EXPECT_TRUE(made("two.h5", options, 2) == packed) << form.options;
  }
  EXPECT_EQ(run("x.h5", "--low-rank 2"), 2);
  EXPECT_THAT(said_, HasSubstr("--low-rank: "));
  EXPECT_TRUE(nothing_left("x.h5"));
}

TEST_F(Program, TellsItsPlanAndWritesNothing) {
  ASSERT_EQ(execute(arguments("x.h5", "--plan --quiet")), 0) << said_;
  for (const char* part : {"mesh    210 nodes", "solver  ", "why     ", "memory  ", "time    ", "bundle  "})
    EXPECT_THAT(said_, HasSubstr(part));
  EXPECT_TRUE(nothing_left("x.h5"));
  ASSERT_EQ(execute(arguments("x.h5", "--plan --quiet --json -")), 0) << said_;
  // The text also has the warning that p1 locks at nu = 0.45.
  const auto plan = nlohmann::json::parse(said_.substr(std::min(said_.find('{'), said_.size())), nullptr, false);
  ASSERT_TRUE(plan.is_object()) << said_;
  EXPECT_EQ(plan["columns"], 360);
  EXPECT_TRUE(nothing_left("x.h5"));
}

TEST_F(Program, ReportsAsJsonAndIsQuietWhenAsked) {
  ASSERT_EQ(run("x.h5", "--quiet --json report.json"), 0);
  // --quiet leaves warnings alone (here: p1 locks at nu = 0.45) and nothing else.
  EXPECT_EQ(said_.rfind("warning: organ.toml: \"p1\"", 0), 0u) << said_;
  EXPECT_EQ(said_.find('\n'), said_.size() - 1) << said_;
  const auto report = nlohmann::json::parse(file_bytes(folder_ / "report.json"), nullptr, false);
  ASSERT_TRUE(report.is_object());
  EXPECT_EQ(report["columns"], 360);
  ASSERT_EQ(report["warnings"].size(), 1u);
  EXPECT_EQ("warning: " + std::string(report["warnings"][0]) + "\n", said_);
  EXPECT_EQ(report["bundle_bytes"], std::filesystem::file_size(folder_ / "x.h5"));
  EXPECT_LE(report["certificate"]["worst_residual"], 1e-9);
  EXPECT_EQ(report["stages"].front()["name"], "read");
  EXPECT_EQ(report["stages"].back()["name"], "rename");
  EXPECT_GT(report["predicted_and_took"]["bytes"]["predicted"], 0);
  // Without --quiet: a line for each stage and a summary.
  ASSERT_EQ(run("x.h5"), 0);
  for (const char* stage : {"read: ", "assemble: ", "plan: ", "factor: ", "columns: ", "seal: "})
    EXPECT_THAT(said_, ::testing::ContainsRegex(std::string(stage) + "[0-9.]+ s, [0-9.]+ GB\n"));
  EXPECT_THAT(said_, HasSubstr("predicted / took: memory "));
  EXPECT_THAT(said_, HasSubstr("x.h5: 360 columns, "));
}

TEST_F(Program, StoresTheSagUnderGravity) {
  // nu = 0, held in x at x = 0 and in y and z everywhere: a column under its own weight, u = rho g (L x - x^2 / 2) / E.
  write("organ.toml", std::string(kOrgan).replace(kOrgan.find("0.45"), 4, "0.0"));
  write("bc.toml",
        "name = \"column\"\n[[fixed]]\ndofs = \"x\"\nselect = { patch = \"x0\" }\n"
        "[[fixed]]\ndofs = \"yz\"\nselect = { everything = true, where = \"all\" }\n"
        "[preload]\ngravity = { value = [9.81, 0, 0], unit = \"m/s^2\" }\n");
  const std::string bytes = made("g.h5");
  const auto u = section<double>(bytes, SectionId::preload_displacement);
  const auto nodes = section<double>(bytes, SectionId::nodes);
  ASSERT_EQ(u.size(), nodes.size());
  const double scale = 1060 * 9.81 / 5400, length = 0.06;
  double mean = 0;
  int count = 0;
  for (std::size_t n = 0; n < nodes.size() / 3; ++n)
    if (nodes[3 * n] == 0.06) mean += u[3 * n], ++count;
  // The end face moves by rho g L^2 / 2 E; with 6 elements along the bar the error is at most (1/6)^2 of that.
  EXPECT_NEAR(mean / count, scale * length * length / 2, scale * length * length / 2 / 36);
  write("organ.toml", std::string(kOrgan).erase(kOrgan.find("density")));
  EXPECT_EQ(run("none.h5"), 2);
  EXPECT_THAT(said_, HasSubstr("density"));
}

TEST_F(Program, StoresMotionsBesideTheSameColumns) {
  const std::string plain = made("plain.h5");
  write("bc.toml", kBoundary +
                       "[[motion]]\nname = \"shift\"\nkind = \"piston\"\naxis = [0, 2, 0]\n"
                       "[[motion]]\nname = \"filling\"\nkind = \"pressure\"\nselect = { patch = \"z1\" }\n"
                       "[[motion]]\nname = \"weight\"\nkind = \"gravity\"\n");
  const std::string bytes = made("one.h5");
  EXPECT_EQ(bytes, made("two.h5", "", 2));
  EXPECT_EQ(section<std::int32_t>(bytes, SectionId::motion_kinds), (std::vector<std::int32_t>{1, 4, 5, 5, 5}));
  EXPECT_EQ(text_section(bytes, SectionId::motion_names), "shift\nfilling\nweight x\nweight y\nweight z\n");
  const auto field = section<float>(bytes, SectionId::motion_surface);
  const auto fixed = section<std::uint8_t>(bytes, SectionId::fixed);
  const std::size_t ns = index_of(bytes).counts.surface_nodes;
  ASSERT_EQ(field.size(), 5 * 3 * ns);
  for (std::size_t i = 0; i < 3 * ns; ++i)
    if (fixed[i]) {
      ASSERT_EQ(field[i], i % 3 == 1 ? 1.0f : 0.0f) << "a unit of the axis, whatever its length";
    }
  for (const SectionId id : {SectionId::displacement_surface, SectionId::force, SectionId::residual})
    EXPECT_EQ(section<char>(bytes, id), section<char>(plain, id));
  for (const SectionId id : {SectionId::motion_names, SectionId::motion_kinds, SectionId::motion_surface,
                             SectionId::motion_volume, SectionId::motion_residual})
    EXPECT_EQ(formats::find_section(index_of(plain), id), nullptr);
  EXPECT_EQ(formats::find_section(index_of(bytes), SectionId::motion_interior), nullptr);
  // A hyperelastic body moves with all of its nodes.
  const std::string large = made("large.h5", "--large-deformation");
  EXPECT_EQ(section<float>(large, SectionId::motion_interior).size(), 5 * 3 * (index_of(large).counts.nodes - ns));
  // And a pressure with the triangles on which it acts: those of the face, as the mesh has them.
  EXPECT_EQ(formats::find_section(index_of(bytes), SectionId::motion_pressed), nullptr);
  const auto pressed = section<std::uint8_t>(large, SectionId::motion_pressed);
  const auto triangles = section<std::int32_t>(large, SectionId::triangles);
  const auto nodes = section<double>(large, SectionId::nodes);
  ASSERT_EQ(pressed.size(), 5 * triangles.size() / 3);
  for (std::size_t i = 0; i < pressed.size(); ++i) {
    const std::size_t motion = i / (triangles.size() / 3), t = i % (triangles.size() / 3);
    const auto on_top = [&](std::int32_t n) { return nodes[3 * static_cast<std::size_t>(n) + 2] > 0.04 - 1e-9; };
    const bool on = motion == 1 && std::all_of(&triangles[3 * t], &triangles[3 * t] + 3, on_top);
    ASSERT_EQ(pressed[i], on ? 1 : 0) << motion << " " << t;
  }
}

TEST_F(Program, StoresCorridorsBesideTheSameColumnsInEveryForm) {
  const std::string corridors =
      "[[corridor]]\nname = \"biopsy\"\nfrom = [-5, 20, 20]\nto = [30, 25, 20]\nradius = 2\n"
      "[[corridor]]\nname = \"ball\"\nfrom = [50, 40, 30]\nto = [50, 40, 30]\nradius = 3\n";
  const std::string interior = "[store]\ninterior = true\n";
  write("bc.toml", kBoundary + interior);
  const std::string plain = made("plain.h5");
  write("bc.toml", kBoundary + corridors + interior);
  const std::string bytes = made("one.h5");
  EXPECT_THAT(said_, HasSubstr(" in corridors), "));
  EXPECT_EQ(bytes, made("two.h5", "", 2));
  const std::string packed = made("small.h5", "--low-rank 1e-2 --store f16");
  const auto index = index_of(bytes);
  const auto nodes = section<std::int32_t>(bytes, SectionId::corridor_nodes);
  ASSERT_GT(nodes.size(), 4u);
  EXPECT_EQ(index.counts.corridor, nodes.size());
  EXPECT_GE(nodes.front(), static_cast<std::int32_t>(index.counts.surface_nodes));
  for (const double r : section<double>(bytes, SectionId::corridor_residual)) EXPECT_TRUE(r > 0 && r <= 1e-9) << r;
  for (const SectionId id : {SectionId::displacement_surface, SectionId::force, SectionId::residual})
    EXPECT_EQ(section<char>(bytes, id), section<char>(plain, id));
  for (const SectionId id : {SectionId::corridor_nodes, SectionId::corridor_compliance, SectionId::corridor_surface,
                             SectionId::corridor_interior, SectionId::corridor_residual}) {
    EXPECT_EQ(formats::find_section(index_of(plain), id), nullptr);
    EXPECT_FALSE(section<char>(bytes, id).empty());
    EXPECT_EQ(section<char>(bytes, id), section<char>(packed, id)) << "packing keeps them";
  }
  EXPECT_THAT(text_section(bytes, SectionId::provenance),
              HasSubstr("\"corridor biopsy\":\"capsule from (-5, 20, 20) mm to (30, 25, 20) mm, radius 2 mm; "));
  write("bc.toml", kBoundary + corridors);
  const std::string surface = made("surface.h5");
  EXPECT_TRUE(section<float>(surface, SectionId::corridor_interior).empty());
  EXPECT_EQ(section<float>(surface, SectionId::corridor_surface), section<float>(bytes, SectionId::corridor_surface));
  write("bc.toml", kBoundary + "[[corridor]]\nname = \"off\"\nfrom = [80, 0, 0]\nto = [90, 0, 0]\nradius = 2\n");
  EXPECT_EQ(run("off.h5"), 2);
  EXPECT_THAT(said_, HasSubstr("bc.toml:8: [[corridor]] \"off\": "));
  EXPECT_TRUE(nothing_left("off.h5"));
}

TEST_F(Program, StoresTheRegionOfACutBesideTheSameColumnsInEveryForm) {
  const std::string cut = "[cut]\nregion = { sphere = { center = [60, 50, 40], radius = 25 } }\n";
  write("bc.toml", kBoundary);
  const std::string plain = made("plain.h5");
  write("bc.toml", kBoundary + cut);
  const std::string bytes = made("one.h5");
  EXPECT_THAT(said_, HasSubstr(" of a cut's region, "));
  EXPECT_EQ(bytes, made("two.h5", "", 2));
  const std::string packed = made("small.h5", "--low-rank 1e-2 --store f16");
  const auto nodes = section<std::int32_t>(bytes, SectionId::cut_nodes);
  const auto compliance = section<double>(bytes, SectionId::cut_compliance);
  ASSERT_GT(nodes.size(), 10u);
  EXPECT_EQ(index_of(bytes).counts.cut, nodes.size());
  EXPECT_EQ(compliance.size(), 9 * nodes.size() * (nodes.size() + 1) / 2);
  // Nodes of the region are numbered among those of the surface, and so are as many in reserve as it has nodes that may be divided.
  const auto before = index_of(plain).counts, with = index_of(bytes).counts;
  const auto reserve = section<std::int32_t>(bytes, SectionId::cut_reserve);
  ASSERT_EQ(reserve.size(), 2u);
  EXPECT_EQ(static_cast<std::uint64_t>(reserve[0] + reserve[1]), with.surface_nodes);
  EXPECT_EQ(with.nodes, before.nodes + static_cast<std::uint64_t>(reserve[1]));
  EXPECT_LT(nodes.back(), reserve[0]);
  EXPECT_GT(static_cast<std::uint64_t>(reserve[0]), before.surface_nodes);
  EXPECT_EQ(with.touchable - before.touchable, static_cast<std::uint64_t>(reserve[0]) - before.surface_nodes);
  EXPECT_EQ(with.corridor, 0u);
  const auto fixed = section<std::uint8_t>(bytes, SectionId::fixed);
  for (std::int32_t n = reserve[0]; n < reserve[0] + reserve[1]; ++n)
    EXPECT_EQ(fixed[3 * static_cast<std::size_t>(n)], 1);
  for (const SectionId id :
       {SectionId::cut_nodes, SectionId::cut_compliance, SectionId::cut_residual, SectionId::cut_reserve}) {
    EXPECT_EQ(formats::find_section(index_of(plain), id), nullptr);
    EXPECT_EQ(section<char>(bytes, id), section<char>(packed, id)) << "packing keeps them";
  }
  EXPECT_THAT(text_section(bytes, SectionId::provenance),
              HasSubstr(" nodes may be divided; " + std::to_string(nodes.size()) + " nodes with those beside them"));
}

TEST_F(Program, RefusesARegionOfACutThatItCannotStore) {
  const auto refused = [&](const std::string& more, const std::string& sentence) {
    write("bc.toml", kBoundary + more);
    EXPECT_EQ(run("x.h5"), 2) << said_;
    EXPECT_THAT(said_, HasSubstr(sentence));
    EXPECT_TRUE(nothing_left("x.h5"));
  };
  const std::string cut = "[cut]\nregion = { sphere = { center = [60, 50, 40], radius = 25 } }\n";
  refused("[cut]\nregion = { sphere = { center = [600, 50, 40], radius = 25 } }\n", "bc.toml:9: ");
  refused(cut + "reserve = -1\n", "bc.toml:10: cut: reserve: expected a number of nodes, 0 to 6000, found -1");
  write("organ.toml", std::string(kOrgan).replace(kOrgan.find("\"p1\""), 4, "\"p2-p0\""));
  refused(cut, "bc.toml:8: [cut] ");
  EXPECT_THAT(said_, HasSubstr("p2-p0"));
}

TEST_F(Program, RefusesBadInputWithOneSentenceAndLeavesNothing) {
  const auto refused = [&](const std::string& more, const std::string& sentence, int ranks = 0) {
    EXPECT_EQ(run("x.h5", more, ranks), 2) << said_;
    EXPECT_THAT(said_, HasSubstr(sentence));
    EXPECT_TRUE(nothing_left("x.h5"));
  };
  refused("--tolerance 2", "--tolerance");
  refused("--tolerance 1e-17", "found 1e-17");
  refused("-- -ksp_monitr", "-ksp_monitr");
  refused("-- -ksp_monitr", "-ksp_monitr", 2);
  refused("--image none.nrrd", "none.nrrd: ");
  write("organ.toml", std::string(kOrgan).replace(kOrgan.find("\"p1\""), 4, "\"p9\""));
  refused("", "found \"p9\"");
  write("organ.toml", std::string(kOrgan).replace(kOrgan.rfind("name = \"box\""), 12, "name = \"liver\""));
  refused("", "\"box\"");
  write("organ.toml", kOrgan);
  write("bc.toml", "name = \"loose\"\n[[fixed]]\ndofs = \"z\"\nselect = { patch = \"z0\" }\n");
  refused("", "3 of its 6");
  refused("", "3 of its 6", 2);
  refused("", ") mm along (0, 0, 1)");  // in the unit of the mesh, as the points of bc.toml
  write("bc.toml", "name = \"all\"\n[[fixed]]\ndofs = \"xyz\"\nselect = { everything = true }\n");
  refused("", "no node can be touched");
  write("bc.toml", kBoundary);
  std::filesystem::remove(folder_ / "box.msh");
  refused("", "box.msh");
}

TEST_F(Program, FailsWhenAColumnDoesNotConvergeAndNamesTheWorst) {
  EXPECT_EQ(run("x.h5", "-- -column_pc_type jacobi -ksp_max_it 2"), 1);
  EXPECT_THAT(said_, HasSubstr("the column of node"));
  EXPECT_THAT(said_, HasSubstr("true relative residual"));
  EXPECT_TRUE(nothing_left("x.h5"));
  EXPECT_EQ(run("x.h5", "-- -column_pc_type jacobi -ksp_max_it 2", 2), 1);
  EXPECT_TRUE(nothing_left("x.h5"));
}

TEST_F(Program, EndsOnAllRanksWhenOneFails) {
  // An error before the columns: only the second rank cannot read its file.
  EXPECT_EQ(run_unlike("x.h5", "--organ none.toml"), 2);
  EXPECT_THAT(said_, HasSubstr("palpate-precompute: none.toml"));
  EXPECT_TRUE(nothing_left("x.h5"));
  // An error among the columns: only the second rank may not iterate long enough.
  EXPECT_EQ(run_unlike("x.h5", "-- -column_pc_type jacobi -ksp_max_it 2"), 1);
  EXPECT_THAT(said_, HasSubstr("did not converge"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "x.h5"));  // the first rank's columns may be kept
}

}  // namespace
}  // namespace palpate::tests
