#include "precompute/journal/batch_writer.h"

#include <utility>

namespace palpate {

BatchWriter::BatchWriter(const std::filesystem::path& part, const std::filesystem::path& journal,
                         const std::vector<DisplacementSection>& sections, std::span<const ColumnBatch> batches,
                         const ReciprocitySample& sample)
    : part_(part), journal_(journal, batches, sample), sections_(sections), batches_(batches), thread_([this] {
        work();
      }) {}

BatchWriter::~BatchWriter() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void BatchWriter::put(SolvedBatch& batch) {
  std::unique_lock lock(mutex_);
  wait_until_idle(lock);
  std::swap(batch, batch_);
  busy_ = true;
  changed_.notify_all();
}

void BatchWriter::finish() {
  std::unique_lock lock(mutex_);
  wait_until_idle(lock);
  sync();
}

std::uint64_t BatchWriter::safe_columns() const {
  const std::lock_guard lock(mutex_);
  return safe_columns_;
}

void BatchWriter::wait_until_idle(std::unique_lock<std::mutex>& lock) {
  changed_.wait(lock, [this] { return !busy_; });
  if (error_) std::rethrow_exception(error_);
}

void BatchWriter::work() {
  for (std::unique_lock lock(mutex_);;) {
    changed_.wait(lock, [this] { return busy_ || ending_; });
    if (!busy_) return;
    lock.unlock();
    std::exception_ptr error;
    try {
      make_safe(batch_);
    } catch (...) {
      error = std::current_exception();
    }
    lock.lock();
    if (!error) safe_columns_ += 3 * batch_.record.nodes.size();
    error_ = error;
    busy_ = false;
    changed_.notify_all();
  }
}

// Writes the rows first and then the record with their checksums. If the process is killed, the kernel still writes what it has
// been given. After a power cut the disk may hold any part of that; the checksums then show which batches are whole. So it is
// enough to flush to the disk once a second.
void BatchWriter::make_safe(const SolvedBatch& batch) {
  write_rows(sections_, batches_[batch.index], batch.rows, part_);
  journal_.write(batch.index, batch.record);
  if (std::chrono::steady_clock::now() - synced_ > std::chrono::seconds(1)) sync();
}

void BatchWriter::sync() {
  part_.sync();
  journal_.sync();
  synced_ = std::chrono::steady_clock::now();
}

}  // namespace palpate
