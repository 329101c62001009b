// Is the organ held? Every part must have none of its six rigid motions left; else K is singular, and conjugate
// gradients may converge to nonsense without a sign.
#pragma once

#include "precompute/elements/elastic_body.h"

namespace palpate {

// A part is a set of tetrahedra joined through faces: it moves rigidly at no energy, and in no other way. Parts that
// meet in one vertex or along one edge are hinged there; all parts hinged together are checked as one mechanism.
// Errors: InputError that names a part that can still move, and how. boundary_file is for the sentence.
// Cost: one sort of the faces, then 6 x 6 per part (6k x 6k where k parts can be held only together).
void check_support(const ElasticBody& body, const std::filesystem::path& boundary_file);

}  // namespace palpate
