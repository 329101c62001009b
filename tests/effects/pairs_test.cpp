// Every pair of effects acts together as a full solve says, or is refused for a reason; and docs/effects.md tells what is found here.
#include <gtest/gtest.h>

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

}  // namespace
}  // namespace palpate::tests
