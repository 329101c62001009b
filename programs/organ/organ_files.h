// Writes an organ's folder: organ.toml, boundary/held.toml, scenes/press.toml, organ.mk; and new-organ.json with the warnings, which
// the pipeline shows beside those of its own steps.
#pragma once

#include "programs/organ/organ_choices.h"

namespace palpate {

// Call before the source is measured. Errors: InputError for a name with other characters than letters, digits, - and _, for one
// whose folder exists, and where the folder that is to hold it does not.
void check_organ_name(const OrganRequest& request);

// Warns (warnings_of), writes folder/name whole or not at all, and returns its path. Errors: OperationError; as warnings_of.
std::filesystem::path write_organ(const OrganRequest& request, const OrganSource& source);

// The same for several organs as one welded mesh, and in it a folder for each organ by itself.
std::filesystem::path write_organs(const OrganRequest& request, const std::vector<NamedLabel>& labels,
                                   const OrganGroup& group);

}  // namespace palpate
