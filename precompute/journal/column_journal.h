// The file NAME.journal beside NAME.part: which batches of columns are safe on the disk, and the record of each.
//
// The file begins with a header and the fingerprint of the run. Then each batch has pages of its own: number of the
// batch, length, checksum and record. A record counts only where its checksum holds, and it holds the checksums of the
// batch's rows in NAME.part. So a write that was torn, or lost in a power cut, costs that batch alone. The byte order
// is the machine's: only reruns of the same run read the file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "formats/plain_file.h"
#include "precompute/journal/batch_record.h"

namespace palpate {

class ColumnJournal {
 public:
  // Empties the file and lays it out for these batches. Errors: OperationError.
  static void begin(const std::filesystem::path& path, const std::string& fingerprint,
                    std::span<const ColumnBatch> batches, const ReciprocitySample& sample);

  // The fingerprint that the file was begun with; nothing where it was not begun or its header is damaged.
  static std::optional<std::string> fingerprint_of(const std::filesystem::path& path);

  // Opens a file that was begun for these batches. Errors: OperationError.
  ColumnJournal(const std::filesystem::path& path, std::span<const ColumnBatch> batches,
                const ReciprocitySample& sample);

  // In one write.
  void write(std::size_t batch, const BatchRecord& record) const;
  void sync() const { file_.sync_data(); }

  // The record of a batch; nothing where it was not written or is torn.
  std::optional<BatchRecord> read(std::size_t batch) const;

 private:
  struct RecordSpan {
    std::uint64_t offset;  // of its header in the file
    std::uint64_t bytes;   // of the record itself
  };
  PlainFile file_;
  std::span<const ColumnBatch> batches_;
  std::uint64_t seed_ = 0;  // enters the checksums, so that records of an earlier run in the same file do not count
  std::vector<RecordSpan> records_;
};

}  // namespace palpate
