// organ_pushes [--steps=100000] [--seed=0] [--scene-steps=500]: pushes organs on one another at random, one scene for each seed, and looks
// in every step whether a vertex has passed through (random_pushes.h). Prints each that has, with the seed that replays it:
//   organ_pushes --seed=SEED --steps=500
// Exit code 0: none; 1: some; 2: bad usage.
#include <chrono>
#include <cstdio>

#include "tests/runtime/read_option.h"
#include "tests/runtime/world/random_pushes.h"

int main(int argc, char** argv) {
  using palpate::tests::read_option;
  long long steps = 100000, seed = 0, scene_steps = 500;
  for (int a = 1; a < argc; ++a)
    if (!read_option(argv[a], "--steps=", &steps) && !read_option(argv[a], "--seed=", &seed) &&
        !read_option(argv[a], "--scene-steps=", &scene_steps))
      return std::fprintf(stderr,
                          "%s: expected --steps=N, --seed=N or --scene-steps=N with a whole number of 0 or more\n",
                          argv[a]),
             2;
  if (scene_steps < 1 || scene_steps > 1000000)
    return std::fprintf(stderr, "--scene-steps: expected 1 .. 1000000\n"), 2;
  palpate::tests::PushCounts all;
  long long first_failing = -1;
  const auto start = std::chrono::steady_clock::now();
  double told = 0;
  const auto summary = [&](double seconds) {
    std::printf(
        "%ld steps, %ld in which organs pressed one another, %ld with a flag; %ld vertices looked at, %ld inside the "
        "other organ, by %.4f of its edge beyond the motion of the step at most; %ld came in past a side; %ld have "
        "passed "
        "through, %.0f s\n",
        all.steps, all.pressed, all.flagged, all.looked, all.inside, all.deepest, all.past_sides, all.found, seconds);
    std::fflush(stdout);
  };
  for (long long at = seed; all.steps < steps; ++at) {
    palpate::tests::play_pushes(static_cast<std::uint64_t>(at),
                                static_cast<int>(std::min<long long>(scene_steps, steps - all.steps)), 1, &all,
                                [&](const palpate::tests::PassedThrough& found) {
                                  if (first_failing < 0) first_failing = at;
                                  std::printf("%s\n", palpate::tests::sentence_of(found).c_str());
                                });
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (seconds < told + 10) continue;
    told = seconds;
    summary(seconds);
  }
  summary(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  if (first_failing >= 0) std::printf("first failing seed: %lld\n", first_failing);
  return first_failing >= 0 ? 1 : 0;
}
