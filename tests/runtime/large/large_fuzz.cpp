// large_fuzz [--steps=100000] [--seed=0] [--scene-steps=300]: plays random scenes of large deformation, one for each seed, and holds
// them against Newton's method, the work of their contacts, and rest. Prints each find with the seed that replays it:
//   large_fuzz --seed=SEED --steps=300
// Exit code 0: none; 1: some; 2: bad usage.
#include <cstdio>

#include "tests/runtime/large/random_large_scenes.h"
#include "tests/runtime/play_seeds.h"
#include "tests/runtime/read_option.h"

int main(int argc, char** argv) {
  palpate::tests::PlayOptions options{100000, 300};
  for (int a = 1; a < argc; ++a)
    if (!options.read(argv[a])) {
      std::fprintf(stderr, "%s: expected --steps=N, --seed=N or --scene-steps=N with a whole number of 0 or more\n",
                   argv[a]);
      return 2;
    }
  if (!options.check()) return 2;
  const palpate::tests::RandomLargeScenes scenes;
  palpate::tests::LargeFinds all;
  const bool found = palpate::tests::play_seeds(
      options.seed, options.steps, options.scene_steps, &all.steps,
      [&](std::uint64_t at, int of_scene, const auto& told) { scenes.play(at, of_scene, &all, told); },
      [&](double seconds) {
        std::printf(
            "%ld steps in %ld scenes: %ld with a force, %ld flagged; %ld held against Newton's method (%ld without a "
            "reference), "
            "force at most %.2f times its, %ld letting go of a larger one; %ld of them without a flag: field %.1f %%, "
            "force %.1f %% off at worst; "
            "energy without work "
            "%.1f %% at worst; %ld finds, %.0f s\n",
            all.steps, all.scenes, all.pressed, all.flagged, all.compared, all.without_reference, all.worst_force,
            all.letting_go, all.trusted, 100 * all.worst_field, 100 * all.worst_trusted_force, 100 * all.worst_gain,
            all.found, seconds);
      });
  return found ? 1 : 0;
}
