// Writes a tensor bundle in three steps: lay_out_bundle (HDF5 datasets), SectionWriter (their bytes), seal_bundle (the index).
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "formats/bundle_layout.h"
#include "formats/plain_file.h"

namespace palpate {

// One section to lay out. shape has the rank of bundle_sections.def; type is needed where the list offers several.
struct SectionShape {
  formats::SectionId id;
  std::vector<std::uint64_t> shape;
  std::optional<formats::ElementType> type = {};
};

// Creates an HDF5 file with a user block and one contiguous, early-allocated, aligned dataset per section, the
// attributes of provenance_json on the root group and the unit, shape and meaning on the datasets, and closes it.
// Writes the section "provenance", which need not be in the list. Returns each section's entry, in the order of the
// list, with offset and bytes filled (checksum 0). The file is not a bundle until seal_bundle. The same arguments give
// the same bytes (no times are stored). Text sections become one fixed-length string. The file is sparse:
// PlainFile::reserve takes its disk space.
//
// provenance_json is a flat JSON object of strings, numbers and booleans. Keys that programs look for:
//   format "palpate bundle" · version (layout, number) · program_version · element "p1" · units "m, N, Pa" · frame
//   organ, boundary: their names · image_sha256 ("" where unknown), mesh_sha256, organ_sha256, boundary_sha256
//   preload: whether there is one
//   solver: what solved, in words · tolerance: on the true relative residual · worst_residual · most_iterations
//   reciprocity_error: largest |C_nk - C_kn^T| / |C_nk| of the pairs looked at · cast_error: largest relative error of
//   a stored column. These and element stand on the group certificate as well.
//
// Errors: OperationError (HDF5, disk), InputError (a shape that contradicts the list, provenance that is not flat).
std::vector<formats::SectionEntry> lay_out_bundle(const std::filesystem::path& file,
                                                  const std::vector<SectionShape>& sections,
                                                  const std::string& provenance_json);

// The entry of a section that was laid out. Errors: std::logic_error where it was not.
const formats::SectionEntry& entry_of(const std::vector<formats::SectionEntry>& entries, formats::SectionId id);

// Gives the numbers of a laid-out bundle's provenance their final values, where they are known only after the tensors:
// the attributes are written in place, the section's text is ended by spaces. The JSON given to lay_out_bundle must
// have had the same keys and texts, a number of the same kind (whole or not) for each, and room (spaces at its end) for
// longer ones. Errors: OperationError (HDF5, disk), InputError (keys or kinds that differ, no room).
void finish_provenance(const std::filesystem::path& file, const std::vector<formats::SectionEntry>& entries,
                       const std::string& provenance_json);

// Plain positioned write into a section; any process may write any part. Errors: OperationError; a range outside the
// section is a programming error and throws std::logic_error.
class SectionWriter {
 public:
  explicit SectionWriter(const std::filesystem::path& file);
  void write(const formats::SectionEntry& entry, std::uint64_t first_byte, const void* bytes, std::uint64_t count);
  void sync();

 private:
  PlainFile file_;
};

// Is called with the bytes of a section, from first_byte on, as seal_bundle reads them.
using SectionReader = std::function<void(const formats::SectionEntry& entry, std::uint64_t first_byte,
                                         const char* bytes, std::size_t count)>;

// Reads every section back, computes its checksum, writes header and index into the user block, fsyncs. The caller
// renames the file (AtomicFile). `also` is called with all bytes that are read, and may throw. Errors: OperationError.
void seal_bundle(const std::filesystem::path& path, std::vector<formats::SectionEntry> entries,
                 const SectionReader& also = {});

}  // namespace palpate
