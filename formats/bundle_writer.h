// Writes a tensor bundle: HDF5 datasets laid out once, filled by plain writes at their offsets, sealed by the index.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "formats/bundle_layout.h"

namespace palpate {

// One section to lay out. shape has the rank of bundle_sections.def.
struct SectionShape {
  formats::SectionId id;
  std::vector<std::uint64_t> shape;
};

// Creates an HDF5 file with a user block and one contiguous, early-allocated, aligned dataset per section, the attributes
// of provenance_json (a flat JSON object of strings, numbers and booleans) on the root group and the units and meanings on
// the datasets, and closes it. Returns each section's entry with offset and bytes filled (checksum 0). The file is not a
// bundle until seal_bundle. The same arguments give the same bytes (no times are stored).
// Errors: OperationError (HDF5, disk), InputError (a shape that contradicts the list).
std::vector<formats::SectionEntry> lay_out_bundle(const std::filesystem::path& file,
                                                  const std::vector<SectionShape>& sections,
                                                  const std::string& provenance_json);

// Plain positioned write into a section; any process may write any part. Errors: OperationError; a range outside the
// section is a programming error and throws std::logic_error.
class SectionWriter {
 public:
  explicit SectionWriter(const std::filesystem::path& file);
  ~SectionWriter();
  SectionWriter(const SectionWriter&) = delete;
  SectionWriter& operator=(const SectionWriter&) = delete;
  void write(const formats::SectionEntry& entry, std::uint64_t first_byte, const void* bytes, std::uint64_t count);
  void sync();

 private:
  int descriptor_ = -1;
};

// Reads every section back, computes its checksum, writes header and index into the user block, fsyncs. The caller renames
// the file into place (AtomicFile). Errors: OperationError.
void seal_bundle(const std::filesystem::path& file, std::vector<formats::SectionEntry> entries);

}  // namespace palpate
