// The depth at which linear elasticity becomes the main error: compares Palpate with CalculiX's large-strain solution
// (neo-Hookean, *HYPERELASTIC) for the same mesh, element and push.
#pragma once

#include <nlohmann/json.hpp>

#include "studies/accuracy/bake.h"
#include "studies/accuracy/organ_case.h"

namespace palpate::accuracy {

// Both use linear tetrahedra, so that only the treatment of large strain differs. They do not lock at nu = 0.45.
inline constexpr double kLargeStrainPoisson = 0.45;
BundleSetting large_strain_bundle(const OrganCase& organ);

// Moves the nodes of a disc about a site inwards to several depths, by superposition, corrected by P and Q (where the organ has a
// response), and as the hyperelastic body with CalculiX's law. The study's points keep solved pushes. Returns {site, nodes,
// resolution, poisson, steps: [{depth_mm, force_N, force_large_N, force_error, field_error, field_error_mm}] of the superposition,
// depth_mm_at: {"1": {force, field}, "5": .., "10": ..}, models: {linear, response, large: {steps: [{depth_mm, force_error,
// field_error}], touch_us, touch_us_99, shape_us, scene_MB, bundle_MB}}, ended: why CalculiX stopped, or ""}; a depth that was not
// reached is null. Errors: OperationError where CalculiX solves nothing.
nlohmann::json push_deep(const OrganCase& organ, const Bakery& bakery, const StudySites& sites, std::size_t site);

}  // namespace palpate::accuracy
