// cut_scene_fuzz BUNDLE.h5 [--steps=100000] [--seed=0] [--scene-steps=300]: plays random scenes of an organ that is cut. After every fifth step its surface
// is closed, forces and places are finite and bounded; let go, it comes back to rest. Prints each fault with the seed that replays it.
// Exit code 0: none; 1: some; 2: bad usage.
#include <cstdio>

#include "tests/runtime/cut/random_cut_scene.h"
#include "tests/runtime/play_seeds.h"
#include "tests/runtime/read_option.h"

int main(int argc, char** argv) {
  palpate::tests::PlayOptions options{100000, 300};
  for (int a = 2; a < argc; ++a)
    if (!options.read(argv[a])) {
      std::fprintf(stderr, "%s: expected --steps=N, --seed=N or --scene-steps=N with a whole number of 0 or more\n",
                   argv[a]);
      return 2;
    }
  palpate_bundle* opened = nullptr;
  palpate_error error = {};
  if (argc < 2 || palpate_bundle_open_file(argv[1], nullptr, &opened, &error) != PALPATE_OK) {
    std::fprintf(stderr, "expected a bundle of an organ that may be cut: %s\n", argc < 2 ? "found none" : error.text);
    return 2;
  }
  const palpate::tests::BundlePointer bundle(opened);
  if (!options.check()) return 2;
  palpate_bundle_info info = {};
  palpate_bundle_fill_info(opened, &info, sizeof info);
  const bool has_large = info.has_large != 0;
  long done = 0, faces = 0, removed = 0, nodes = 0, pieces = 0, full = 0, flagged = 0;
  const bool found = palpate::tests::play_seeds(
      options.seed, options.steps, options.scene_steps, &done,
      [&](std::uint64_t at, int of_scene, const auto& told) {
        // Some under large deformation, where the bundle has what that needs.
        palpate::tests::RandomCutScene scene(
            opened, at, has_large ? static_cast<palpate_deformation_model>(at % 4) : PALPATE_DEFORMATION_LINEAR);
        std::string fault;
        for (int i = 0; i < of_scene && fault.empty(); ++i, ++done) {
          fault = scene.step();
          if (!fault.empty()) told("seed " + std::to_string(at) + ", step " + std::to_string(i) + ": " + fault);
        }
        if (fault.empty()) fault = scene.let_go();
        if (!fault.empty()) told("seed " + std::to_string(at) + ", at the end: " + fault);
        const palpate_cut_state& state = scene.state();
        faces += state.faces, removed += state.removed, nodes += state.nodes, pieces += state.pieces - 1;
        full += state.is_full, flagged += scene.flagged;
      },
      [&](double seconds) {
        std::printf(
            "%ld steps: %ld faces cut, %ld tetrahedra removed, %ld new nodes, %ld pieces off, %ld scenes full, %ld "
            "steps "
            "flagged, %.0f s\n",
            done, faces, removed, nodes, pieces, full, flagged, seconds);
      });
  return found ? 1 : 0;
}
