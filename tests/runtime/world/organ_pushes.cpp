// organ_pushes [--steps=100000] [--seed=0] [--scene-steps=500] [--links=0] [--deformation=0]: pushes organs on one another at random, one scene for each seed, and looks
// in every step whether a vertex has passed through (random_pushes.h). Prints each that has, with the seed that replays it:
//   organ_pushes --seed=SEED --steps=500
// Steps that tell of vertices inside are compared with the exact depth of all vertices.
// With --links=1 it plays random worlds whose organs are linked instead, and looks at the links' forces and laws (random_links.h).
// --deformation=1, 2, 3: the organs are hyperelastic bodies (palpate_deformation_model).
// Exit code 0: none, and no step tells in vain; 1: some; 2: bad usage.
#include <cstdio>

#include "tests/runtime/play_seeds.h"
#include "tests/runtime/read_option.h"
#include "tests/runtime/world/random_links.h"
#include "tests/runtime/world/random_pushes.h"

namespace {

using namespace palpate::tests;

bool play_links(const PlayOptions& options) {
  LinkCounts all;
  return play_seeds(
      options.seed, options.steps, options.scene_steps, &all.steps,
      [&](std::uint64_t at, int of_scene, const auto& told) {
        RandomLinks(at, &all, [&](const std::string& found) {
          told("seed " + std::to_string(at) + ", " + found);
        }).play(of_scene);
      },
      [&](double seconds) {
        std::printf(
            "%ld steps, %ld with a flag of missed laws, %ld in which links broke, %ld in which organs pressed one "
            "another; largest force %.3g of its bound; laws missed without a flag by %.3g of what is allowed at most; "
            "%ld found, %.0f s\n",
            all.steps, all.flagged, all.broken, all.touching, all.largest, all.missed, all.found, seconds);
      });
}

}  // namespace

int main(int argc, char** argv) {
  using palpate::tests::read_option;
  PlayOptions options{100000, 500};
  long long links = 0, deformation = 0;
  for (int a = 1; a < argc; ++a)
    if (!options.read(argv[a]) && !read_option(argv[a], "--links=", &links) &&
        !read_option(argv[a], "--deformation=", &deformation))
      return std::fprintf(stderr,
                          "%s: expected --steps=N, --seed=N, --scene-steps=N, --links=N or --deformation=N with a "
                          "whole number of 0 or more\n",
                          argv[a]),
             2;
  if (!options.check()) return 2;
  if (deformation > 3) return std::fprintf(stderr, "--deformation: expected 0 .. 3\n"), 2;
  if (links > 0) return play_links(options) ? 1 : 0;
  palpate::tests::PushCounts all;
  const bool found = palpate::tests::play_seeds(
      options.seed, options.steps, options.scene_steps, &all.steps,
      [&](std::uint64_t at, int of_scene, const auto& told) {
        palpate::tests::play_pushes(
            at, of_scene, 1, &all,
            [&](const palpate::tests::PassedThrough& passed) { told(palpate::tests::sentence_of(passed)); },
            static_cast<palpate_deformation_model>(deformation));
      },
      [&](double seconds) {
        std::printf(
            "%ld steps, %ld in which organs pressed one another, %ld with a flag, %ld that tell of vertices inside, "
            "%ld of them in vain; %ld vertices looked at, %ld inside the other organ, by %.4f of its edge beyond the "
            "motion of the step at most; %ld came in past a side; %.3g N at most; %ld have passed through, %.0f s\n",
            all.steps, all.pressed, all.flagged, all.told, all.told_in_vain, all.looked, all.inside, all.deepest,
            all.past_sides, all.largest, all.found, seconds);
      });
  return found || all.told_in_vain > 0 ? 1 : 0;
}
