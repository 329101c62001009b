// Makes the header and the checksum of a changed bundle index fit, so that a test reaches the checks behind them.
#pragma once

#include <cstring>

#include "formats/bundle_layout.h"
#include "formats/checksum.h"

namespace palpate::tests {

// bytes: the whole file, at least kUserBlockBytes. Keeps the section count if it is possible.
inline void seal_index(void* bytes, std::uint64_t file_bytes) {
  using namespace formats;
  auto* head = static_cast<unsigned char*>(bytes);
  BundleHeader header;
  std::memcpy(&header, head, sizeof header);
  header.section_count %= kMaxSections + 1;
  header.index_checksum = 0;
  const std::size_t index_bytes = sizeof header + header.section_count * sizeof(SectionEntry);
  std::memcpy(header.magic, kBundleMagic, sizeof header.magic);
  header.layout_version = kLayoutVersion;
  header.file_bytes = file_bytes;
  header.user_block_bytes = kUserBlockBytes;
  std::memset(header.reserved, 0, sizeof header.reserved);
  std::memcpy(head, &header, sizeof header);
  std::memset(head + index_bytes, 0, kUserBlockBytes - index_bytes);
  header.index_checksum = xxh64(head, index_bytes);
  std::memcpy(head, &header, sizeof header);
}

// Makes only the checksum fit the index.
inline void seal_checksum(void* bytes) {
  using namespace formats;
  auto* head = static_cast<unsigned char*>(bytes);
  BundleHeader header;
  std::memcpy(&header, head, sizeof header);
  if (header.section_count > kMaxSections) return;  // the reader refuses this before it checks the checksum
  header.index_checksum = 0;
  std::memcpy(head, &header, sizeof header);
  header.index_checksum = xxh64(head, sizeof header + header.section_count * sizeof(SectionEntry));
  std::memcpy(head, &header, sizeof header);
}

}  // namespace palpate::tests
