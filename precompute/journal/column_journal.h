// NAME.journal beside NAME.part: which blocks of columns are safe on the disk, and the record of each.
//
// Header and fingerprint, then for every block of columns a slot of its own pages: block, length and checksum, the record.
// A slot counts when its checksum holds, and vouches for the block's rows in NAME.part by theirs: a write that was torn,
// or that a power cut lost, costs that block alone. Native byte order: the file serves its own run and reruns.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "formats/plain_file.h"
#include "precompute/journal/block_record.h"

namespace palpate {

class ColumnJournal {
 public:
  // Empties the file and begins anew. Errors: OperationError.
  static void begin(const std::filesystem::path& path, const std::string& fingerprint,
                    std::span<const ColumnBlock> blocks, const ReciprocitySample& sample);

  // What the file was begun with; nothing when it was not begun or its header is damaged.
  static std::optional<std::string> fingerprint_of(const std::filesystem::path& path);

  // Opens what was begun for these blocks. Errors: OperationError.
  ColumnJournal(const std::filesystem::path& path, std::span<const ColumnBlock> blocks,
                const ReciprocitySample& sample);

  // One write.
  void write(std::size_t block, const BlockRecord& record) const;
  void sync() const { file_.sync_data(); }

  // Nothing where the block was not written, or is torn.
  std::optional<BlockRecord> read(std::size_t block) const;

 private:
  struct Slot {
    std::uint64_t offset, bytes;  // of the record
  };
  PlainFile file_;
  std::span<const ColumnBlock> blocks_;
  std::uint64_t seed_ = 0;  // ties the slots to their header
  std::vector<Slot> slots_;
};

}  // namespace palpate
