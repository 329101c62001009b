// Reads the tissue below the surface from the bundle, for the compliance under a patch (surface_measure.h).
#pragma once

#include "runtime/bundle/bundle.h"
#include "runtime/surface/surface_measure.h"

namespace palpate {

// The element that the provenance names; p1 where it names none. Errors: that of a section that cannot be mapped.
palpate_status read_element(palpate_bundle& bundle, StoredElement* element, palpate_error* error);

// Fills measure with the tissue at each surface node, from Young's modulus and Poisson's ratio of its region (the mean over the
// tetrahedra around the node where regions meet) and from the element named in the provenance. Errors: PALPATE_ERROR_CONTENT for
// moduli out of range; PALPATE_ERROR_MEMORY; the error of a section that cannot be mapped.
palpate_status read_tissue(palpate_bundle& bundle, SceneMemory& memory, SurfaceMeasure& measure, palpate_error* error);

}  // namespace palpate
