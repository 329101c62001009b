// The study from its first mesh to accuracy.json: what is missing is measured, what was measured is kept.
#pragma once

#include "studies/accuracy/organ_case.h"

namespace palpate::accuracy {

// A point that fails is told, and stands in accuracy.json as left out. Errors: InputError; OperationError where there is
// no reference; what was measured before stays.
void run_study(const StudyOptions& options);

// The places of a study that was run. Errors: InputError.
StudyPlaces read_places(const std::filesystem::path& folder);

}  // namespace palpate::accuracy
