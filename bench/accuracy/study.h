// The study from its first mesh to accuracy.json: what is missing is measured, what was measured is kept.
#pragma once

#include "bench/accuracy/organ_case.h"

namespace palpate::accuracy {

// Errors: InputError, OperationError; what was measured before stays.
void run_study(const StudyOptions& options);

// The places of a study that was run. Errors: InputError.
StudyPlaces read_places(const std::filesystem::path& folder);

}  // namespace palpate::accuracy
