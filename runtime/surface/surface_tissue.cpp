#include "runtime/surface/surface_tissue.h"

#include <algorithm>
#include <cstring>

#include "runtime/base/error_text.h"

namespace palpate {
namespace {

using formats::SectionId;

// The value of "element" in the provenance, a flat JSON object; p1 where the key is missing.
StoredElement element_of(const char* text, std::size_t bytes) {
  const auto starts = [&](const char* at, const char* word) {
    const std::size_t length = std::strlen(word);
    return static_cast<std::size_t>(text + bytes - at) >= length && std::memcmp(at, word, length) == 0;
  };
  for (const char* at = text; at < text + bytes; ++at) {
    if (!starts(at, "\"element\"")) continue;
    at += std::strlen("\"element\"");
    while (at < text + bytes && (*at == ' ' || *at == ':')) ++at;
    if (starts(at, "\"p2-p0\"")) return StoredElement::p2_p0;
    if (starts(at, "\"p1-ang\"")) return StoredElement::p1_ang;
    return starts(at, "\"p1\"") ? StoredElement::p1 : StoredElement::p1_anp;
  }
  return StoredElement::p1;
}

}  // namespace

palpate_status read_element(palpate_bundle& bundle, StoredElement* element, palpate_error* error) {
  const char* provenance = section_as<char>(&bundle, SectionId::provenance, error);
  if (!provenance) return error->status == PALPATE_OK ? PALPATE_ERROR_FILE : error->status;
  *element = element_of(provenance, formats::find_section(bundle.index, SectionId::provenance)->bytes);
  return PALPATE_OK;
}

palpate_status read_tissue(palpate_bundle& bundle, SceneMemory& memory, SurfaceMeasure& measure, palpate_error* error) {
  const formats::BundleCounts& counts = bundle.index.counts;
  const double* young = section_as<double>(&bundle, SectionId::young, error);
  const double* poisson = section_as<double>(&bundle, SectionId::poisson, error);
  if (!young || !poisson) return error->status == PALPATE_OK ? PALPATE_ERROR_FILE : error->status;
  StoredElement element = StoredElement::p1;
  if (const palpate_status status = read_element(bundle, &element, error)) return status;
  LocalCompliance* const of_region = memory.array<LocalCompliance>(counts.regions);
  if (!of_region) return fail(error, PALPATE_ERROR_MEMORY, 0, "the allocator has no more memory for the scene");
  for (std::uint64_t r = 0; r < counts.regions; ++r) {
    if (!(young[r] > 0 && young[r] <= 1e15 && poisson[r] > -1 && poisson[r] < 0.5))
      return fail(
          error, PALPATE_ERROR_CONTENT, formats::find_section(bundle.index, SectionId::young)->offset + 8 * r,
          "region %llu: a Young's modulus above 0 Pa and a Poisson's ratio between -1 and 0.5 were expected, found "
          "%g and %g; rebuild the bundle",
          static_cast<unsigned long long>(r), young[r], poisson[r]);
    of_region[r] = local_compliance(young[r], poisson[r], element);
  }
  if (counts.regions == 1) {
    measure.set_tissue(of_region[0]);
    return PALPATE_OK;
  }

  const std::int32_t* tetrahedra = section_as<std::int32_t>(&bundle, SectionId::tetrahedra, error);
  const std::int32_t* region = section_as<std::int32_t>(&bundle, SectionId::region, error);
  if (!tetrahedra || !region) return error->status == PALPATE_OK ? PALPATE_ERROR_FILE : error->status;
  LocalCompliance* const of_node = measure.tissue_of_nodes(memory);
  double* const share = memory.array<double>(counts.surface_nodes);
  if (memory.failed()) return fail(error, PALPATE_ERROR_MEMORY, 0, "the allocator has no more memory for the scene");
  for (std::uint64_t e = 0; e < counts.tetrahedra; ++e) {
    // The file may have changed since its indices were checked, so each one is checked again here.
    const auto r = static_cast<std::uint32_t>(region[e]);
    if (r >= counts.regions) continue;
    for (int v = 0; v < 4; ++v) {
      const auto n = static_cast<std::uint32_t>(tetrahedra[4 * e + v]);
      if (n >= counts.surface_nodes) continue;
      add_weighted(of_node[n], 1, of_region[r]);
      share[n] += 1;
    }
  }
  for (std::uint64_t n = 0; n < counts.surface_nodes; ++n) {
    LocalCompliance mean;
    add_weighted(mean, 1 / std::max(1.0, share[n]), of_node[n]);
    of_node[n] = mean;
  }
  return PALPATE_OK;
}

}  // namespace palpate
