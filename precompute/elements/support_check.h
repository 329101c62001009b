// Checks that the supports hold the organ. A body that can still move as a whole has a singular stiffness matrix, and
// conjugate gradients may then converge to a wrong answer without an error.
#pragma once

#include <filesystem>

#include "precompute/elements/elastic_body.h"

namespace palpate {

// A part is a set of tetrahedra that are joined through faces. The six rigid motions are the only ones that cost it no
// energy, so the supports must prevent all six. Parts that share only a vertex or an edge are hinged there; parts that
// are hinged or tied by springs are checked as one mechanism. Soft supports hold as [[fixed]] does, unless they are so soft
// against the part (12 orders below Young's modulus times its size) that K would have no correct digits. Errors: InputError
// that names a part that can still move and its motions; it names boundary_file as the file to correct, and positions in
// unit, the unit of the points in that file. Cost: one sort of the faces, then an eigenvalue problem of size 6 for each part,
// or 6 k where only k parts together are held.
void check_support(const ElasticBody& body, const std::filesystem::path& boundary_file, const LengthUnit& unit = {});

}  // namespace palpate
