#include "runtime/large/body_reader.h"

#include "formats/averaged_shear.h"
#include "formats/tissue_laws.h"
#include "runtime/surface/surface_tissue.h"

namespace palpate {

using formats::SectionId;

namespace {

// row: of large/law, with a law other than that of large/stiffening. Returns whether its constants are within their limits.
bool read_law(const double* row, TissueLaw* law) {
  law->form = form_of_row(row);
  return law->form.kind == LawForm::Kind::yeoh ? formats::yeoh_law_takes(law->shear, row[1], row[2])
                                               : formats::ogden_law_takes(row[1], row[2], row[3]);
}

}  // namespace

palpate_status read_body(const SectionReader& reader, const char* effect, HyperelasticBody* body, TissueLaw* laws) {
  const double *young = nullptr, *poisson = nullptr;
  palpate_status status = reader.map(SectionId::nodes, &body->nodes);
  if (status == PALPATE_OK) status = reader.map(SectionId::young, &young);
  if (status == PALPATE_OK) status = reader.map(SectionId::poisson, &poisson);
  if (status != PALPATE_OK) return status;
  for (std::uint64_t r = 0; r < reader.counts().regions; ++r) {
    if (!(young[r] > 0 && young[r] <= 1e15 && poisson[r] > -1 && poisson[r] < 0.5))
      return reader.not_usable(SectionId::young, r);
    laws[r] = {young[r] / (2 * (1 + poisson[r])), young[r] / (3 * (1 - 2 * poisson[r])), {}};
  }
  StoredElement element = StoredElement::p1;
  if ((status = read_element(reader.bundle(), &element, reader.error())) != PALPATE_OK) return status;
  if (element == StoredElement::p2_p0)
    return fail(reader.error(), PALPATE_ERROR_EFFECT, 0,
                "%s: expected a bundle of the elements p1, p1-anp or p1-ang, found p2-p0; rebuild it with one of them",
                effect);
  body->nodal_dilatation = element != StoredElement::p1;
  body->averaged_shear = element == StoredElement::p1_ang ? formats::kAveragedShear : 0;
  body->laws = laws;
  body->node_count = static_cast<std::int32_t>(reader.counts().nodes);
  body->tetrahedron_count = static_cast<std::int32_t>(reader.counts().tetrahedra);
  body->region_count = static_cast<std::int32_t>(reader.counts().regions);
  for (std::int64_t i = 0; i < 3 * static_cast<std::int64_t>(body->node_count); ++i)
    if (!(std::fabs(body->nodes[i]) <= 1e6)) return reader.not_usable(SectionId::nodes, static_cast<std::uint64_t>(i));
  return PALPATE_OK;
}

palpate_status read_laws(const SectionReader& reader, const char* effect, TissueLaw* laws) {
  const double *stiffening = nullptr, *rows = nullptr;
  if (const palpate_status status = reader.map_for(effect, SectionId::large_stiffening, &stiffening)) return status;
  const formats::SectionEntry* const entry = reader.find(SectionId::large_law);
  if (entry)
    if (const palpate_status status = reader.map(SectionId::large_law, &rows)) return status;
  for (std::uint64_t r = 0; r < reader.counts().regions; ++r) {
    const double* const row = rows ? rows + formats::kLawNumbers * r : nullptr;
    if (row && row[0] != 0) {
      if (!(row[0] == 1 || row[0] == 2))
        return fail(
            reader.error(), PALPATE_ERROR_CONTENT, entry->offset + sizeof(double) * formats::kLawNumbers * r,
            "large/law: expected a law from 0 to %d, found %g; use a newer version of Palpate, or rebuild the bundle",
            formats::kStoredLaws - 1, row[0]);
      if (!read_law(row, laws + r)) return reader.not_usable(SectionId::large_law, formats::kLawNumbers * r);
      if (stiffening[r] != formats::kNoStiffening) return reader.not_usable(SectionId::large_stiffening, r);
      continue;
    }
    if (!(stiffening[r] >= 0 && stiffening[r] <= 1e4)) return reader.not_usable(SectionId::large_stiffening, r);
    laws[r].form = LawForm(stiffening[r]);
  }
  return PALPATE_OK;
}

palpate_status read_tetrahedra(const SectionReader& of_arrays, HyperelasticBody* body) {
  using Sections = formats::IndexedSections;
  const std::uint64_t count = of_arrays.counts().tetrahedra;
  if (const palpate_status status =
          of_arrays.copy_indices(SectionId::tetrahedra, 4 * count, &Sections::tetrahedra, &body->tetrahedra))
    return status;
  return of_arrays.copy_indices(SectionId::region, count, &Sections::region, &body->region);
}

palpate_status read_fixed(const SectionReader& reader, HyperelasticBody* body) {
  if (const palpate_status status = reader.map(SectionId::fixed, &body->fixed)) return status;
  formats::IndexedSections sections;
  sections.fixed = body->fixed;
  return reader.check(sections);
}

palpate_status read_supports(const SectionReader& reader, const SectionReader& of_scratch, HyperelasticBody* body) {
  const formats::SectionEntry *const nodes = reader.find(SectionId::large_support_nodes),
                                     *const stiffness = reader.find(SectionId::large_support_stiffness);
  if (!nodes && !stiffness) return PALPATE_OK;
  if (!nodes || !stiffness || nodes->shape[0] != stiffness->shape[0])
    return fail(
        reader.error(), PALPATE_ERROR_CONTENT, (nodes ? nodes : stiffness)->offset,
        "large/support: expected as many pairs of nodes as 3 x 3 stiffnesses, found other numbers of them; rebuild "
        "the bundle");
  const std::uint64_t pairs = nodes->shape[0];
  palpate_status status = of_scratch.copy_indices(SectionId::large_support_nodes, 2 * pairs,
                                                  &formats::IndexedSections::large_support_nodes, &body->support_nodes);
  if (status == PALPATE_OK) status = reader.map(SectionId::large_support_stiffness, &body->support_stiffness);
  if (status != PALPATE_OK) return status;
  for (std::uint64_t p = 0; p < pairs; ++p) {
    const std::int32_t *const pair = body->support_nodes + 2 * p, *const before = p > 0 ? pair - 2 : nullptr;
    const bool ascends = !before || before[0] < pair[0] || (before[0] == pair[0] && before[1] < pair[1]);
    if (pair[0] > pair[1] || !ascends) return reader.not_usable(SectionId::large_support_nodes, 2 * p);
    const double* const k = body->support_stiffness + 9 * p;
    for (int i = 0; i < 9; ++i)
      if (!(std::fabs(k[i]) <= 1e15) || (pair[0] == pair[1] && k[i] != k[i % 3 * 3 + i / 3]))
        return reader.not_usable(SectionId::large_support_stiffness, 9 * p + static_cast<std::uint64_t>(i));
  }
  body->support_count = static_cast<std::int32_t>(pairs);
  return PALPATE_OK;
}

}  // namespace palpate
