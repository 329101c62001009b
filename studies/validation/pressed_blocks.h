// Two blocks in contact, by the runtime and by CalculiX on the same meshes.
#pragma once

#include "studies/validation/against_calculix.h"
#include "studies/validation/cases.h"

namespace palpate::validation {

// Blocks whose vertices lie on one another, and blocks of other meshes, shifted.
std::vector<CalculixMesh> pressed_block_pairs(const Workshop& workshop);

}  // namespace palpate::validation
