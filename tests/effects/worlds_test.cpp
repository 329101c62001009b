// Random worlds with all effects: random_worlds.h says what is looked at. world_fuzz plays as many as it is asked for.
#include <gtest/gtest.h>

#include <utility>

#include "tests/effects/random_worlds.h"

namespace palpate::tests {
namespace {

TEST(EffectWorlds, AtRandomAreFiniteAndBoundedAndComeBackToRestWhenLetGo) {
  WorldCounts counts;
  for (std::uint64_t seed = 0; seed < 8; ++seed)
    RandomWorld(seed, &counts, [](const std::string& found) { ADD_FAILURE() << found; }).play(200);
  EXPECT_GT(counts.large, counts.steps / 4);
  EXPECT_GT(counts.touching, 0);
  EXPECT_GT(counts.cut, 0);
  EXPECT_GT(counts.displacement, 0.005);
}

// Their bodies beside the touch have stiffened so much that the linear organ, under the same forces, would move by metres; contacts end and let go.
TEST(EffectWorlds, WhoseBodiesAreFarBehindTheirToolsStayBounded) {
  WorldCounts counts;
  for (const auto& [seed, steps] : {std::pair{58, 140}, std::pair{67, 160}})
    RandomWorld(static_cast<std::uint64_t>(seed), &counts, [](const std::string& found) {
      ADD_FAILURE() << found;
    }).play(steps);
  EXPECT_GT(counts.touching, 0);
}

// A cut under forces of many newtons that balance one another: the linear organ, which a part of the solution cancels, would open by metres at once.
TEST(EffectWorlds, WhoseStiffBodiesAreCutStayBounded) {
  WorldCounts counts;
  for (const auto& [seed, steps] : {std::pair{12, 110}, std::pair{64, 60}, std::pair{92, 100}})
    RandomWorld(static_cast<std::uint64_t>(seed), &counts, [](const std::string& found) {
      ADD_FAILURE() << found;
    }).play(steps);
  EXPECT_GT(counts.cut, 0);
}

// Large bodies whose lips press on one another with nothing from outside: each step's forces were smaller than the last ones, until they were too small for
// numbers.
TEST(EffectWorlds, WhoseCutBodiesAreLetGoComeToRest) {
  WorldCounts counts;
  for (const std::uint64_t seed : {21, 28, 77})
    RandomWorld(seed, &counts, [](const std::string& found) { ADD_FAILURE() << found; }).play(600);
  EXPECT_GT(counts.cut, 0);
}

}  // namespace
}  // namespace palpate::tests
