// The tissue under the surface, from the bundle: what a patch takes for the compliance that the mesh does not resolve.
#pragma once

#include "runtime/bundle/bundle.h"
#include "runtime/surface/surface_measure.h"

namespace palpate {

// Sections that read_tissue maps, as a plan names them.
const char* tissue_sections(const palpate_bundle& bundle);

// Young's modulus and Poisson's ratio of the region at each surface node (where regions meet, the mean over the
// tetrahedra there) and the element from the provenance -> measure. Errors: PALPATE_ERROR_CONTENT for a material that is
// none; PALPATE_ERROR_MEMORY; whatever mapping a section fails with.
palpate_status read_tissue(palpate_bundle& bundle, SceneMemory& memory, SurfaceMeasure& measure, palpate_error* error);

}  // namespace palpate
