// Writes solved blocks and their slots while the next one is solved: one thread, one block at a time.
#pragma once

#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>

#include "precompute/journal/column_journal.h"
#include "precompute/journal/displacement_sections.h"

namespace palpate {

struct SolvedBlock {
  std::size_t index = 0;
  BlockRecord record;
  DisplacementRows rows;
};

class BlockWriter {
 public:
  // sections and blocks must outlive it. Errors: OperationError.
  BlockWriter(const std::filesystem::path& part, const std::filesystem::path& journal,
              const std::vector<DisplacementSection>& sections, std::span<const ColumnBlock> blocks,
              const ReciprocitySample& sample);
  ~BlockWriter();  // finishes the block at hand
  BlockWriter(const BlockWriter&) = delete;
  BlockWriter& operator=(const BlockWriter&) = delete;

  // Takes a solved block and gives back an earlier one's memory, once the block before is safe. Errors: those of writing
  // earlier blocks, OperationError.
  void put(SolvedBlock& block);

  // Waits until everything is written and on the disk. Errors: as put.
  void finish();

  // Columns of the blocks that are written: a killed process does not lose them.
  std::uint64_t safe_columns() const;

 private:
  void work();
  void make_safe(const SolvedBlock& block);
  void sync();
  void wait_until_idle(std::unique_lock<std::mutex>& lock);

  SectionWriter part_;
  ColumnJournal journal_;
  const std::vector<DisplacementSection>& sections_;
  std::span<const ColumnBlock> blocks_;

  std::chrono::steady_clock::time_point synced_ = std::chrono::steady_clock::now();
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  SolvedBlock block_;
  bool busy_ = false, ending_ = false;
  std::uint64_t safe_columns_ = 0;
  std::exception_ptr error_;
  std::thread thread_;
};

}  // namespace palpate
