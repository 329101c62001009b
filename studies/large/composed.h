// Large deformation beside other effects: jaws that draw and turn, and two organs that press one another, each linear, large, and large beside the
// touch, against the converged solution of the coupled problem.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "studies/accuracy/sites.h"
#include "studies/hyperelastic/large_body.h"
#include "studies/large/played.h"

namespace palpate::large {

// Jaws of the sites' radius draw the first `places` sites outwards, by the pace's depths, and turn by 0.01 rad a millimetre. A copy of the organ, which faces
// each of these sites, comes nearer by these depths after both touch first; where no pair presses at a depth, there is no state.
// body: the mesh and laws that the bundle was made of. Returns
//   states: [{with: "grasp" or "organs", place, depth_mm, force_N, contacts, and for each of linear, large, beside and renewed: MODEL_field,
//             MODEL_force (relative errors), MODEL_flags; unsolved: why there is no converged solution}]
//   touch: {WITH: {MODEL: {median_us, most_us (99.9 %)}}}; deform: {WITH: {MODEL: {median_us}}}, of one organ
// Under beside and renewed the body is solved once in 10 touches. Errors: OperationError.
nlohmann::ordered_json measure_composed(const std::filesystem::path& bundle, const LargeBody& body,
                                        const accuracy::StudySites& sites, std::size_t places, const Pace& pace);

}  // namespace palpate::large
