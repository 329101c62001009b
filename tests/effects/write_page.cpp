// Plays every pair of effects and writes the page: write_effects_page FILE. Exit code 3 where a pair is wrong.
#include <cstdio>
#include <fstream>

#include "tests/effects/effects.h"
#include "tests/effects/pairs.h"

int main(int argc, char** argv) {
  using namespace palpate::tests;
  if (argc != 2) return std::fputs("usage: write_effects_page FILE\n", stderr), 2;
  std::vector<std::vector<PairFound>> found;
  bool wrong = false;
  for (std::size_t i = 0; i < effects().size(); ++i) {
    found.push_back(play_pairs_of(i));
    for (const PairFound& pair : found.back()) {
      if (pair.faults.empty()) continue;
      wrong = true;
      std::fprintf(stderr, "%s with %s: %s\n", pair.effects[0], pair.effects[1], pair.faults.c_str());
    }
  }
  std::ofstream(argv[1], std::ios::trunc) << page_of(found);
  return wrong ? 3 : 0;
}
