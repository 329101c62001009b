// Runs the study from the first mesh to accuracy.json. Points that an earlier run measured are read, not measured again.
#pragma once

#include "studies/accuracy/organ_case.h"

namespace palpate::accuracy {

// A point that fails is reported and listed in accuracy.json under left_out. Errors: InputError; OperationError if there
// is no reference. Points measured before an error are kept.
void run_study(const StudyOptions& options);

// Reads the sites of a finished study. Errors: InputError.
StudySites read_sites(const std::filesystem::path& folder);

}  // namespace palpate::accuracy
