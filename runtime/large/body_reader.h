// The bundle's mesh as a body of tissue, for the effects that look inside the organ.
#pragma once

#include "runtime/large/hyperelastic_body.h"
#include "runtime/scene/section_reader.h"

namespace palpate {

// The mesh of the bundle's body, its element and the law of each region; without what stiffens and what is held. laws: [regions].
palpate_status read_body(const SectionReader& reader, const char* effect, HyperelasticBody* body, TissueLaw* laws);

// What large deformation asks of each region beyond the moduli.
palpate_status read_laws(const SectionReader& reader, const char* effect, TissueLaw* laws);

// of_arrays: takes the checked copies of the tetrahedra and their regions.
palpate_status read_tetrahedra(const SectionReader& of_arrays, HyperelasticBody* body);

palpate_status read_fixed(const SectionReader& reader, HyperelasticBody* body);

// Foundations and springs, where the bundle has them. of_scratch: takes their nodes.
palpate_status read_supports(const SectionReader& reader, const SectionReader& of_scratch, HyperelasticBody* body);

}  // namespace palpate
