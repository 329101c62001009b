// collision_fuzz [--steps=1000000] [--seed=0] [--scene-steps=500] [--bump=0]: plays random scenes, one for each seed, and compares
// every step with the exact inside test of the deformed mesh; with a bump (um), of a finer surface with bumps of that height. Prints
// each contradiction with the seed that replays it:
//   collision_fuzz --seed=SEED --steps=500
// Exit code 0: none; 1: some, or flags excused more than kMostExcused of the tool points; 2: bad usage.
#include <cstdio>

#include "tests/runtime/play_seeds.h"
#include "tests/runtime/random_scenes.h"
#include "tests/runtime/read_option.h"

namespace {

// Of the tool points of a run of 100,000 steps or more.
constexpr double kMostExcused = 0.15;

}  // namespace

int main(int argc, char** argv) {
  using palpate::tests::read_option;
  palpate::tests::PlayOptions options{1000000, 500};
  long long bump = 0;
  for (int a = 1; a < argc; ++a)
    if (!options.read(argv[a]) && !read_option(argv[a], "--bump=", &bump)) {
      std::fprintf(stderr,
                   "%s: expected --steps=N, --seed=N, --scene-steps=N or --bump=N with a whole number of 0 or more\n",
                   argv[a]);
      return 2;
    }
  if (!options.check()) return 2;
  const palpate::tests::RandomScenes scenes(1e-6 * static_cast<double>(bump));
  palpate::tests::Contradictions all;
  const bool found = palpate::tests::play_seeds(
      options.seed, options.steps, options.scene_steps, &all.steps,
      [&](std::uint64_t at, int of_scene, const auto& told) {
        scenes.play(at, of_scene, &all, [&](const palpate::tests::Contradiction& contradiction) {
          told(palpate::tests::sentence_of(contradiction));
        });
      },
      [&](double seconds) {
        std::printf(
            "%ld steps, %ld of them with a needle in the body, of %ld tool points: %ld within 2 mm of the surface, %ld "
            "in "
            "contact, %ld contacts begun, %ld ended; %ld out of the surface without their contact (%ld more not "
            "compared); excused %.2f %%: %ld deferred, %ld lost; %ld over held nodes; %ld contradictions, %.0f s\n",
            all.steps, all.pierced, all.points, all.near, all.touched, all.begun, all.ended, all.out, all.out_unknown,
            100 * all.excused(), all.deferred, all.lost, all.over_held, all.found, seconds);
      });
  const bool hides = all.steps >= 100000 && all.excused() > kMostExcused;
  if (hides) std::printf("flags excused more than %.0f %% of the tool points\n", 100 * kMostExcused);
  return found || hides ? 1 : 0;
}
