// How deep one may push before linear elasticity itself is the error: Palpate's answer against CalculiX's large-strain
// solution (neo-Hookean, *HYPERELASTIC) of the same mesh, element and push.
#pragma once

#include <nlohmann/json.hpp>

#include "studies/accuracy/bake.h"
#include "studies/accuracy/organ_case.h"

namespace palpate::accuracy {

// Both sides: linear tetrahedra, so that nothing but the strain's size differs; nu = 0.45, at which they do not lock.
inline constexpr double kLargeStrainPoisson = 0.45;
BundleSetting large_strain_bundle(const OrganCase& organ);

// The nodes of a disc about a place held at depths along its inward direction. What was solved before is kept in
// the study's points. {place, at_mm, nodes, steps: [{depth_mm, force_N, force_large_N, force_error, field_error,
// field_error_mm}], depth_mm_at: {"1": {force, field}, "5": .., "10": ..}, ended: why CalculiX went no deeper, or ""};
// a depth that was not reached is null. Errors: OperationError where CalculiX solves nothing.
nlohmann::json push_deep(const OrganCase& organ, const Bakery& bakery, const StudyPlaces& places, std::size_t place);

}  // namespace palpate::accuracy
