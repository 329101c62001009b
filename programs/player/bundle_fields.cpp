#include "programs/player/bundle_fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>

#include "formats/bundle_reader.h"
#include "formats/errors.h"

namespace palpate {
namespace {

void read_at(std::ifstream& stream, std::uint64_t offset, void* bytes, std::uint64_t count,
             const std::filesystem::path& file) {
  stream.seekg(static_cast<std::streamoff>(offset));
  if (!stream.read(static_cast<char*>(bytes), static_cast<std::streamsize>(count)))
    throw OperationError(fmt::format("{}: cannot read {} bytes at byte {}", file.string(), count, offset));
}

// The whole section; its bytes were checked against the file's size by read_bundle_index.
template <typename Container>
void read_section(std::ifstream& stream, const formats::BundleIndex& index, formats::SectionId id, Container& out,
                  const std::filesystem::path& file) {
  const formats::SectionEntry* entry = formats::find_section(index, id);
  if (!entry) return;
  out.resize(entry->bytes / sizeof(out[0]));
  read_at(stream, entry->offset, out.data(), entry->bytes, file);
}

}  // namespace

BundleFields read_bundle_fields(const std::filesystem::path& bundle) {
  std::ifstream stream(bundle, std::ios::binary);
  std::error_code unreadable;
  const std::uint64_t file_bytes = std::filesystem::file_size(bundle, unreadable);
  if (!stream || unreadable) throw InputError(fmt::format("{}: expected a bundle, found no file", bundle.string()));
  std::vector<char> head(std::min<std::uint64_t>(file_bytes, formats::kUserBlockBytes));
  read_at(stream, 0, head.data(), head.size(), bundle);
  formats::BundleIndex index;
  formats::BundleError error;
  if (formats::read_bundle_index(head.data(), file_bytes, &index, &error) != formats::BundleStatus::ok)
    throw InputError(fmt::format("{}: byte {}: {}", bundle.string(), error.byte_offset, error.text));
  BundleFields fields;
  fields.identity = index.header.index_checksum;
  read_section(stream, index, formats::SectionId::provenance, fields.provenance, bundle);
  read_section(stream, index, formats::SectionId::region, fields.region, bundle);
  read_section(stream, index, formats::SectionId::fixed, fields.fixed, bundle);
  read_section(stream, index, formats::SectionId::region_names, fields.region_names, bundle);
  read_section(stream, index, formats::SectionId::young, fields.young, bundle);
  read_section(stream, index, formats::SectionId::poisson, fields.poisson, bundle);
  read_section(stream, index, formats::SectionId::large_support_nodes, fields.support_nodes, bundle);
  read_section(stream, index, formats::SectionId::large_support_stiffness, fields.support_stiffness, bundle);
  return fields;
}

}  // namespace palpate
