#include "runtime/scene/section_reader.h"

namespace palpate {

palpate_status SectionReader::check(const formats::IndexedSections& sections) const {
  formats::BundleError from;
  if (formats::check_stored_indices(bundle_.index, sections, &from) != formats::BundleStatus::ok)
    return fail(error_, from);
  return PALPATE_OK;
}

palpate_status SectionReader::map_rows(SectionId id, DisplacementRows* out) const {
  if (const palpate_status status = map(id, &out->numbers)) return status;
  out->type = static_cast<formats::ElementType>(find(id)->type);
  out->nodes = static_cast<std::int32_t>(find(id)->shape[2]);
  return out->type == formats::ElementType::f16 ? map(SectionId::displacement_scale, &out->scale) : PALPATE_OK;
}

palpate_status SectionReader::map_preload(const palpate_scene_def& def, const double** out) const {
  *out = preload_;
  if (preload_) return PALPATE_OK;
  if (def.preload == PALPATE_PRELOAD_OFF) return PALPATE_OK;
  return map_for("preload ON", SectionId::preload_displacement, out);
}

palpate_status SectionReader::missing(const char* effect, SectionId id) const {
  return fail(error_, PALPATE_ERROR_EFFECT, 0,
              "%s needs section %s, which this bundle does not have; precompute it or turn the effect off", effect,
              formats::describe_section(id)->path);
}

palpate_status SectionReader::not_usable(SectionId id, std::uint64_t number) const {
  return fail(error_, PALPATE_ERROR_CONTENT, find(id)->offset + 8 * number,
              "section %s: number %llu is not usable (not finite, or a stiffness that is not positive definite); "
              "rebuild the bundle",
              formats::describe_section(id)->path, static_cast<unsigned long long>(number));
}

palpate_status SectionReader::no_memory(const char* of_what) const {
  return fail(error_, PALPATE_ERROR_MEMORY, 0, "the allocator has no more memory for the scene%s%s",
              of_what ? "'s " : "", of_what ? of_what : "");
}

}  // namespace palpate
