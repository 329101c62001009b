// Every pair of effects acts together as a full solve says, or is refused for a reason; and docs/effects.md tells what is found here.
#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <iterator>

#include "tests/effects/effects.h"
#include "tests/effects/pairs.h"

namespace palpate::tests {
namespace {

TEST(EffectPairs, ActTogetherAsAFullSolveSaysOrAreRefusedAsThePageTells) {
  std::vector<std::vector<PairFound>> found;
  for (std::size_t i = 0; i < effects().size(); ++i) {
    found.push_back(play_pairs_of(i));
    for (const PairFound& pair : found.back())
      EXPECT_EQ(pair.faults, "") << pair.effects[0] << " with " << pair.effects[1];
  }
  std::ifstream in(PALPATE_SOURCE_FOLDER "/docs/effects.md");
  const std::string page{std::istreambuf_iterator<char>(in), {}};
  EXPECT_EQ(page, page_of(found)) << "make -f Makefile.data effects-page writes it anew";
}

// What no scene of two shows: jaws, sutures and a needle in an organ that breathes, under every tissue; alone, and against another organ
// that it is sewn to.
TEST(EffectCrowds, ActTogetherAsAFullSolveSays) {
  const std::vector<const char*> crowd = {
      "collision deformed", "contact patch", "relaxation", "queries", "report", "inside", "crossings", "skin", "dent",
      "volumes held",       "loads",         "grasps",     "links",   "needles"};
  const std::vector<std::vector<const char*>> tissues = {
      {"force response (Q)", "radial response (P)"}, {"large"}, {"large beside"}, {"large renewed"}};
  for (const char* law : {"law sticking", "law sliding", "law unilateral", "law coulomb"})
    for (const auto& tissue : tissues) {
      std::vector<const char*> all = crowd;
      all.push_back(law), all.insert(all.end(), tissue.begin(), tissue.end());
      // Beside the touch, a tool that is given a force next to a needle stays flagged where it has no friction (docs/method.md, section 22).
      const bool slides = std::strcmp(law, "law sliding") == 0 || std::strcmp(law, "law unilateral") == 0;
      if (!slides || std::strcmp(tissue[0], "large beside") * std::strcmp(tissue[0], "large renewed") != 0)
        all.push_back("force control");
      EXPECT_EQ(faults_of_crowd(all), "") << law << ", " << tissue[0];
      if (std::strcmp(law, "law coulomb") != 0) continue;
      all.insert(all.end(), {"organs that touch", "links between organs"});
      EXPECT_EQ(faults_of_crowd(all), "") << law << ", " << tissue[0] << ", two organs";
    }
}

// The same beside a slit that a blade with toughness cuts from step 60 on; alone, under a plate, and against another organ that it is sewn to. Without
// friction as points: the referee does not know the mean place of a disc that slides near an edge (docs/method.md, section 6).
TEST(EffectCrowds, ActTogetherBesideACutAsAFullSolveSays) {
  const std::vector<const char*> crowd = {
      "collision deformed", "relaxation", "preload", "report", "motions", "loads", "links", "cut", "force control"};
  for (const char* law : {"law sliding", "law unilateral"}) {
    std::vector<const char*> all = crowd;
    all.insert(all.end(), {law, "contact point"});
    EXPECT_EQ(faults_of_crowd(all), "") << law;
  }
  for (const char* law : {"law sticking", "law coulomb"}) {
    std::vector<const char*> all = crowd;
    all.insert(all.end(), {law, "contact patch", "grasps"});
    EXPECT_EQ(faults_of_crowd(all), "") << law;
    all.push_back("obstacles");
    EXPECT_EQ(faults_of_crowd(all), "") << law << ", a plate";
    all.insert(all.end(), {"organs that touch", "links between organs"});
    EXPECT_EQ(faults_of_crowd(all), "") << law << ", a plate, two organs";
  }
  for (const char* tissue : {"large", "large beside", "large renewed"}) {
    std::vector<const char*> all = crowd;
    all.insert(all.end(), {"law coulomb", "contact patch", "grasps", tissue});
    EXPECT_EQ(faults_of_crowd(all), "") << tissue;
    all.insert(all.end(), {"obstacles", "organs that touch", "links between organs"});
    EXPECT_EQ(faults_of_crowd(all), "") << tissue << ", a plate, two organs";
  }
}

// The same with a plate that presses the organ, with friction. Beside the touch, a tool that is given a force next to a needle and a plate stays
// flagged, and so do jaws that slip next to a needle, a held volume, loads and a plate (docs/method.md, section 23).
TEST(EffectCrowds, ActTogetherUnderAPlateAsAFullSolveSays) {
  const std::vector<const char*> crowd = {
      "collision deformed", "contact patch", "relaxation", "queries",   "report",  "inside",
      "volumes held",       "loads",         "links",      "obstacles", "needles", "law coulomb"};
  for (const char* tissue : {"force response (Q)", "large", "large beside", "large renewed"}) {
    const bool beside = std::strncmp(tissue, "large ", 6) == 0;
    std::vector<const char*> all = crowd;
    all.push_back(tissue);
    if (!beside) all.insert(all.end(), {"grasps", "force control"});
    EXPECT_EQ(faults_of_crowd(all), "") << tissue;
    if (beside) all.push_back("grasps");
    all.insert(all.end(), {"organs that touch", "links between organs"});
    EXPECT_EQ(faults_of_crowd(all), "") << tissue << ", two organs";
  }
}

}  // namespace
}  // namespace palpate::tests
