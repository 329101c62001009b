// A thread that writes solved batches to the disk, one at a time, while the next one is solved.
#pragma once

#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>

#include "precompute/journal/column_journal.h"
#include "precompute/journal/displacement_sections.h"

namespace palpate {

struct SolvedBatch {
  std::size_t index = 0;
  BatchRecord record;
  DisplacementRows rows;
};

class BatchWriter {
 public:
  // sections and batches must outlive the writer. Errors: OperationError.
  BatchWriter(const std::filesystem::path& part, const std::filesystem::path& journal,
              const std::vector<DisplacementSection>& sections, std::span<const ColumnBatch> batches,
              const ReciprocitySample& sample);
  ~BatchWriter();  // after the batch that is being written
  BatchWriter(const BatchWriter&) = delete;
  BatchWriter& operator=(const BatchWriter&) = delete;

  // Waits until the batch before is written; then takes this one and gives the caller the memory of an earlier one in
  // its place. Errors: OperationError of writing an earlier batch.
  void put(SolvedBatch& batch);

  // Waits until all batches are written and the disk has confirmed them. Errors: as put.
  void finish();

  // Columns of the batches that are written. If the process is killed, these are not lost.
  std::uint64_t safe_columns() const;

 private:
  void work();
  void make_safe(const SolvedBatch& batch);
  void sync();
  void wait_until_idle(std::unique_lock<std::mutex>& lock);

  SectionWriter part_;
  ColumnJournal journal_;
  const std::vector<DisplacementSection>& sections_;
  std::span<const ColumnBatch> batches_;

  std::chrono::steady_clock::time_point synced_ = std::chrono::steady_clock::now();
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  SolvedBatch batch_;
  bool busy_ = false, ending_ = false;
  std::uint64_t safe_columns_ = 0;
  std::exception_ptr error_;
  std::thread thread_;
};

}  // namespace palpate
