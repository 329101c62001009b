// Scenes of several tool points about bodies that grips open, in which contacts once began in the air, were missed, stayed in the air or
// ended inside. Each scene is named by its seed and played to the step at which that was seen. The reference is the winding number of the
// surface that is drawn (random_scenes.h).
#include "tests/runtime/random_scenes.h"

#include "tests/stability/stability_case.h"

namespace palpate::tests {
namespace {

struct Played {
  std::uint64_t seed;
  int steps;
};

Contradictions expect_none(StabilityCase& stability, const std::vector<Played>& played) {
  const RandomScenes scenes;
  Contradictions all;
  for (const Played& scene : played)
    scenes.play(scene.seed, scene.steps, &all,
                [](const Contradiction& found) { std::printf("%s\n", sentence_of(found).c_str()); });
  stability.hold("contacts that contradict the exact test", static_cast<double>(all.found), 0,
                 "no more than the motion of one step");
  return all;
}

TEST(StabilityRandomScenes, WhatAContactThatEndsHasDoneStaysForTheStep) {
  StabilityCase stability(
      "a contact that ends takes its part out of the surface at once: what other contacts did against that part is "
      "left alone, and throws "
      "the surface by tens of mm before the next solution");
  expect_none(stability, {{67, 494}, {68, 482}, {112, 65}, {140, 73}, {182, 252}, {194, 136}, {195, 351}});
}

TEST(StabilityRandomScenes, APredictedSideCountsForItsStepAlone) {
  StabilityCase stability("a contact is kept by a surface that was predicted once, and is not asked again");
  expect_none(stability, {{61, 330}});
}

TEST(StabilityRandomScenes, ADiscInTheSurfaceThatDoesNotTouchOverHeldNodesIsFlagged) {
  StabilityCase stability("a disc over held nodes is mm inside the surface before it touches, and nothing says so");
  expect_none(stability, {{283, 360}, {400, 460}, {616, 280}});
}

TEST(StabilityRandomScenes, OnAFoldedSurfaceTheWindingNumberDecides) {
  StabilityCase stability("the nearest triangle is that of another part, or of one that has turned inside out");
  expect_none(stability, {{255, 341}, {492, 390}, {707, 150}, {1502, 367}, {1711, 101}, {1900, 172}});
}

TEST(StabilityRandomScenes, FrictionIsSolvedWithoutTheContactThatMayEnd) {
  StabilityCase stability(
      "the prediction without a contact has not converged, and the contact ends inside or stays in the air");
  expect_none(stability, {{410, 326}, {518, 100}, {1109, 186}});
}

TEST(StabilityRandomScenes, APointBehindAThinPartIsHeldByAContactThatActs) {
  StabilityCase stability(
      "a point has gone through held tissue without any force, or lies in front again: its contact pulls from the far "
      "side");
  expect_none(stability, {{419, 243}, {838, 207}, {1854, 457}});
}

TEST(StabilityRandomScenes, ManyScenesAgreeWithTheExactTest) {
  StabilityCase stability("contacts of several tools on a body that opens are false or missed");
  const std::uint64_t count = quick_or_long<std::uint64_t>(12, 400);
  std::vector<Played> played;
  for (std::uint64_t seed = 3000; seed < 3000 + count; ++seed) played.push_back({seed, 500});
  const Contradictions all = expect_none(stability, played);
  stability.hold("share of the points that a flag excuses", all.excused(), 0.15,
                 "a test that a flag always excuses would hide what it looks for");
}

}  // namespace
}  // namespace palpate::tests
