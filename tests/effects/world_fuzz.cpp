// world_fuzz [--steps=100000] [--seed=0] [--scene-steps=600]: plays random worlds with all effects (random_worlds.h), one for each seed, and
// prints each fault with the seed that replays it: world_fuzz --seed=SEED --steps=1
// Exit code 0: none; 1: some; 2: bad usage.
#include <cstdio>

#include "tests/effects/random_worlds.h"
#include "tests/runtime/play_seeds.h"
#include "tests/runtime/read_option.h"

int main(int argc, char** argv) {
  using namespace palpate::tests;
  PlayOptions options{100000, 600};
  for (int a = 1; a < argc; ++a)
    if (!options.read(argv[a]))
      return std::fprintf(stderr,
                          "%s: expected --steps=N, --seed=N or --scene-steps=N with a whole number of 0 or more\n",
                          argv[a]),
             2;
  if (!options.check()) return 2;
  WorldCounts all;
  // A world is always played whole: what is left when it is let go depends on all its steps.
  const bool found = play_seeds(
      options.seed, options.steps, options.scene_steps, &all.steps,
      [&](std::uint64_t at, int, const auto& told) {
        RandomWorld(at, &all, told).play(static_cast<int>(options.scene_steps));
      },
      [&](double seconds) {
        std::printf(
            "%ld steps, %ld with a flag, %ld with a body under large deformation, %ld in which organs pressed one "
            "another, %ld faces cut; %.3g N and %.3g mm at most, %.3g mm left at most of a world that was let go; %ld "
            "found, %.0f s\n",
            all.steps, all.flagged, all.large, all.touching, all.cut, all.force, 1e3 * all.displacement, 1e3 * all.left,
            all.found, seconds);
      });
  return found ? 1 : 0;
}
