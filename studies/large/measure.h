// One mesh with one material: every move, linear and large, against the converged solution of the same mesh; and the times.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "studies/hyperelastic/large_body.h"
#include "studies/large/moves.h"
#include "studies/large/played.h"

namespace palpate::large {

struct MeasureOptions {
  double radius;  // of the discs, m
  Pace pace;
  // Moves measured beside one another. Their errors are the same to rounding for any number; times are longer where threads share memory.
  int threads = 1;
  std::filesystem::path
      kept;  // a folder: every move is kept there when it is measured, and read from there by a later run
};

// body: the mesh and laws that the bundle was made of. Returns
//   moves: [{place, move, depth_mm, force_N, linear_field, linear_force, large_field, large_force (relative errors), flags,
//            residual, least_volume; unsolved: why there is no converged solution}]
//   touch: {linear, large: {median_us, most_us (99.9 %), worst_us, thread_median_us, thread_most_us, touches}}
//   shape: {linear, large: {median_us}}; create_ms: {linear, large}
//   newton: {steps_a_tick, assembly_ms, factor_ms, solve_ms (of one step)}: what it takes to follow a push tick by tick by
//           Newton's method with a kept analysis
// Errors: OperationError.
nlohmann::ordered_json measure(const std::filesystem::path& bundle, const LargeBody& body,
                               const std::vector<Move>& moves, const MeasureOptions& options);

}  // namespace palpate::large
