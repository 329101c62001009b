// Random worlds whose organs are linked: random_links.h says what is looked at. organ_pushes --links=1 plays as many as it is asked for.
#include "tests/runtime/world/random_links.h"

namespace palpate::tests {
namespace {

TEST(WorldLinks, OfRandomWorldsKeepTheirLaws) {
  LinkCounts counts;
  for (std::uint64_t seed = 0; seed < 24; ++seed)
    RandomLinks(seed, &counts, [&](const std::string& found) {
      ADD_FAILURE() << "seed " << seed << ", " << found;
    }).play(60);
  EXPECT_GT(counts.broken, 0);
  EXPECT_GT(counts.touching, 0);
  EXPECT_GT(counts.flagged, 0);
  EXPECT_LT(counts.flagged, counts.steps / 2) << "laws are looked at in steps without a flag";
}

}  // namespace
}  // namespace palpate::tests
