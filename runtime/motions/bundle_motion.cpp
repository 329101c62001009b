// The names and units of a bundle's motions, for hosts.
#include <algorithm>
#include <cstring>

#include "runtime/base/error_text.h"
#include "runtime/bundle/bundle.h"
#include "runtime/include/palpate/palpate_motions.h"

namespace formats = palpate::formats;
using palpate::fail;

palpate_status palpate_bundle_motion(const palpate_bundle* bundle, int32_t motion, palpate_motion_info* info,
                                     size_t struct_bytes, palpate_error* error) {
  if (!bundle || !info) return fail(error, PALPATE_ERROR_ARGUMENT, 0, "bundle and info must not be NULL");
  std::memset(static_cast<void*>(info), 0, struct_bytes);
  const auto count = static_cast<int32_t>(bundle->index.counts.motions);
  if (motion < 0 || motion >= count)
    return fail(error, PALPATE_ERROR_ARGUMENT, 0, "expected one of the bundle's %d motions, found %d",
                static_cast<int>(count), static_cast<int>(motion));
  auto* const opened = const_cast<palpate_bundle*>(bundle);  // maps sections on their first use
  palpate_error ignored;
  const auto* const kinds = palpate::section_as<std::int32_t>(opened, formats::SectionId::motion_kinds, &ignored);
  const auto* name = palpate::section_as<char>(opened, formats::SectionId::motion_names, &ignored);
  if (!kinds || !name) return fail(error, PALPATE_ERROR_FILE, 0, "the bundle's motions cannot be mapped or copied");
  formats::IndexedSections sections;
  sections.motion_kinds = kinds;
  formats::BundleError from;
  if (formats::check_stored_indices(bundle->index, sections, &from) != formats::BundleStatus::ok)
    return fail(error, from);
  const char* const end = name + formats::find_section(bundle->index, formats::SectionId::motion_names)->bytes;
  for (int32_t line = 0; line < motion && name != end; ++name) line += *name == '\n';
  palpate_motion_info found = {};
  found.kind = static_cast<palpate_motion_kind>(kinds[motion]);
  for (std::size_t i = 0; i + 1 < sizeof found.name && name != end && *name != '\n'; ++i) found.name[i] = *name++;
  std::memcpy(static_cast<void*>(info), &found, std::min(struct_bytes, sizeof found));
  return palpate::succeed(error);
}
