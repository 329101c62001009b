// cut_fuzz [--steps=100000] [--seed=0] [--scene-steps=100]: plays random cuts, one body for each seed, and checks the cut body after every step.
// Prints each fault with the seed that replays it:
//   cut_fuzz --seed=SEED --steps=100
// Exit code 0: none; 1: some; 2: bad usage.
#include <cstdio>

#include "tests/runtime/cut/cut_bodies.h"
#include "tests/runtime/play_seeds.h"
#include "tests/runtime/read_option.h"

int main(int argc, char** argv) {
  palpate::tests::PlayOptions options{100000, 100};
  for (int a = 1; a < argc; ++a)
    if (!options.read(argv[a])) {
      std::fprintf(stderr, "%s: expected --steps=N, --seed=N or --scene-steps=N with a whole number of 0 or more\n",
                   argv[a]);
      return 2;
    }
  if (!options.check()) return 2;
  long done = 0, cut = 0, removed = 0, severed = 0, nodes = 0, full = 0;
  const bool found = palpate::tests::play_seeds(
      options.seed, options.steps, options.scene_steps, &done,
      [&](std::uint64_t at, int of_scene, const auto& told) {
        palpate::tests::RandomCuts cuts(at);
        for (int i = 0; i < of_scene; ++i, ++done)
          if (const std::string fault = cuts.step(); !fault.empty()) {
            told("seed " + std::to_string(at) + ", step " + std::to_string(i) + ": " + fault);
            ++done;
            break;
          }
        cut += cuts.cut_faces, removed += cuts.removed, severed += cuts.severed, full += cuts.full;
        nodes += cuts.play.mesh.nodes() - cuts.body.node_count();
      },
      [&](double seconds) {
        std::printf(
            "%ld steps: %ld faces cut, %ld tetrahedra removed, %ld nodes new, %ld pieces severed, %ld steps without "
            "enough "
            "reserve, %.0f s\n",
            done, cut, removed, nodes, severed, full, seconds);
      });
  return found ? 1 : 0;
}
