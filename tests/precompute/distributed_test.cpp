// Groups of ranks that divide one operator: they give the same tensors and the same bytes as one rank, and when one rank fails,
// all end.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/precompute/program_fixture.h"

namespace palpate::tests {
namespace {

using formats::SectionId;
using ::testing::HasSubstr;

// A small box, because ranks that wait for one another on busy cores are slow.
const std::string kTouched = "[touchable]\nselect = { patch = \"x1\" }\n";

class Distributed : public ProgramFixture {
 protected:
  void SetUp() override {
    ProgramFixture::SetUp();
    write_mesh(folder_ / "box.msh", box_mesh({5, 3, 3}, {60, 50, 40}, 0.15));
    write("bc.toml", kBoundary + kTouched);
  }

  // Each rank runs a shell script; RANK is the number of the rank.
  int run_script(const std::string& bundle, int ranks, const std::string& before) {
    write("rank.sh", "RANK=$OMPI_COMM_WORLD_RANK\n" + before + "\nexec " + arguments(bundle, "--ranks-per-operator 2") +
                         " >> voice-$RANK.txt 2>&1\n");
    // The test looks for a rank that hangs.
    const int code = execute("timeout 120 " + kLaunch + " -n " + std::to_string(ranks) + " bash rank.sh");
    for (int r = 0; r < ranks; ++r) said_ += file_bytes(folder_ / ("voice-" + std::to_string(r) + ".txt"));
    return code;
  }
};

// The largest difference of displacements. The largest displacements are near 1.
double difference(const std::string& a, const std::string& b) {
  const auto p = section<float>(a, SectionId::displacement_surface),
             q = section<float>(b, SectionId::displacement_surface);
  EXPECT_EQ(p.size(), q.size());
  double worst = p.empty() ? 1 : 0;
  for (std::size_t i = 0; i < std::min(p.size(), q.size()); ++i)
    worst = std::max(worst, static_cast<double>(std::abs(p[i] - q[i])));
  return worst;
}

TEST_F(Distributed, TensorsAreThoseOfOneRankWithTheWholeOperator) {
  write("bc.toml",
        kBoundary + "[preload]\ngravity = { value = [0, 0, -9.81], unit = \"m/s^2\" }\n[store]\ninterior = true\n");
  for (const char* element : {"p1", "p1-anp"}) {
    std::string organ = kOrgan;
    organ.replace(organ.find("\"p1\""), 4, std::string("\"").append(element).append("\""));
    write("organ.toml", organ);
    const std::string one = made("one.h5", "--tolerance 1e-11");
    for (const char* pc : {"cholesky", "gamg"}) {
      const std::string two =
          made("two.h5", "--tolerance 1e-11 --ranks-per-operator 2 -- -column_pc_type " + std::string(pc), 2);
      EXPECT_LT(difference(one, two), 2e-7) << element << ' ' << pc;  // one rounding of f32 near 1, twice
      for (const double r : section<double>(two, SectionId::residual)) ASSERT_LE(r, 1e-11);
      EXPECT_THAT(text_section(two, SectionId::provenance), HasSubstr("operator divided among 2 ranks"));
      const auto u = section<double>(one, SectionId::preload_displacement),
                 v = section<double>(two, SectionId::preload_displacement);
      ASSERT_EQ(u.size(), v.size());
      for (std::size_t i = 0; i < u.size(); ++i) ASSERT_NEAR(u[i], v[i], 1e-9);  // of millimetres
    }
  }
}

TEST_F(Distributed, CorridorsAreThoseOfOneRank) {
  write("bc.toml",
        kBoundary + kTouched + "[[corridor]]\nname = \"biopsy\"\nfrom = [0, 20, 20]\nto = [60, 25, 20]\nradius = 2\n");
  const std::string one = made("one.h5", "--tolerance 1e-11");
  for (const char* pc : {"cholesky", "gamg"}) {
    const std::string two =
        made("two.h5", "--tolerance 1e-11 --ranks-per-operator 2 -- -column_pc_type " + std::string(pc), 2);
    EXPECT_EQ(section<std::int32_t>(one, SectionId::corridor_nodes),
              section<std::int32_t>(two, SectionId::corridor_nodes));
    for (const SectionId id : {SectionId::corridor_compliance, SectionId::corridor_surface}) {
      const auto c = section<float>(one, id), d = section<float>(two, id);
      ASSERT_EQ(c.size(), d.size());
      const float largest = *std::max_element(c.begin(), c.end());
      for (std::size_t i = 0; i < c.size(); ++i) ASSERT_NEAR(c[i], d[i], 2e-7 * largest) << pc;  // f32, twice
    }
  }
}

TEST_F(Distributed, OneAndTwoGroupsOfTwoGiveTheSameBytesWithMultigrid) {
  const std::string options = "--batch 24 --ranks-per-operator 2 -- -column_pc_type gamg";
  EXPECT_TRUE(made("two.h5", options, 2) == made("four.h5", options, 4));
}

// No solver reaches a tolerance below what double precision allows. Where one rank accepts its result all the same, a group must
// accept its own.
TEST_F(Distributed, ColumnsAtTheFloorOfDoublePrecisionPassAsOnOneRank) {
  for (const char* group : {"", "--ranks-per-operator 2"}) {
    ASSERT_EQ(run("x.h5", std::string("--tolerance 1e-15 ") + group, 2), 0) << said_;
    EXPECT_THAT(said_, HasSubstr("double precision")) << group;
  }
}

TEST_F(Distributed, TheOperatorIsDividedWhereNoRankHasTheMemoryForIt) {
  ASSERT_EQ(run("x.h5", "--memory 0.0001", 2), 0) << said_;
  EXPECT_THAT(said_, HasSubstr("each operator is divided among 2 ranks: algebraic multigrid"));
}

TEST_F(Distributed, RefusesGroupsThatDoNotFit) {
  EXPECT_EQ(run("x.h5", "--ranks-per-operator 2", 3), 2);
  EXPECT_THAT(said_, HasSubstr("--ranks-per-operator 2: "));
  EXPECT_TRUE(nothing_left("x.h5"));
}

// A larger box, whose columns take long enough for a kill in the middle.
constexpr std::array<int, 3> kLarger = {9, 7, 6};

TEST_F(Distributed, ARankThatIsKilledEndsAllAndHindersNoLaterRun) {
  write_mesh(folder_ / "box.msh", box_mesh(kLarger, {60, 50, 40}, 0.15));
  write("bc.toml", kBoundary);
  const std::string whole = made("whole.h5", "--ranks-per-operator 2", 2);
  // Rank 1, which writes nothing, is killed when the columns begin.
  EXPECT_NE(run_script("x.h5", 2,
                       "[ $RANK = 1 ] && { me=$$; (until [ -s x.h5.journal ]; do sleep 0.02; done; kill -9 "
                       "$me) & }"),
            0);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "x.h5")) << "it finished before it was killed";
  EXPECT_LT(difference(made("x.h5", "--ranks-per-operator 2", 2), whole), 2e-7);
}

TEST_F(Distributed, ARootThatCannotWriteEndsAllWithOneSentence) {
  write_mesh(folder_ / "box.msh", box_mesh(kLarger, {60, 50, 40}, 0.15));
  write("bc.toml", kBoundary);
  // Rank 2 is the root of the second group; no file may grow beyond 64 KiB under it.
  const int code = run_script("x.h5", 4, "trap '' XFSZ; [ $RANK = 2 ] && ulimit -f 64");
  EXPECT_EQ(code, 1) << said_;
  EXPECT_THAT(file_bytes(folder_ / "voice-0.txt"), HasSubstr("palpate-precompute: "));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "x.h5"));
}

}  // namespace
}  // namespace palpate::tests
