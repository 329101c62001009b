#include "precompute/journal/block_writer.h"

#include <utility>

namespace palpate {

BlockWriter::BlockWriter(const std::filesystem::path& part, const std::filesystem::path& journal,
                         const std::vector<DisplacementSection>& sections, std::span<const ColumnBlock> blocks,
                         const ReciprocitySample& sample)
    : part_(part), journal_(journal, blocks, sample), sections_(sections), blocks_(blocks), thread_([this] {
        work();
      }) {}

BlockWriter::~BlockWriter() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void BlockWriter::put(SolvedBlock& block) {
  std::unique_lock lock(mutex_);
  wait_until_idle(lock);
  std::swap(block, block_);
  busy_ = true;
  changed_.notify_all();
}

void BlockWriter::finish() {
  std::unique_lock lock(mutex_);
  wait_until_idle(lock);
  sync();
}

std::uint64_t BlockWriter::safe_columns() const {
  const std::lock_guard lock(mutex_);
  return safe_columns_;
}

void BlockWriter::wait_until_idle(std::unique_lock<std::mutex>& lock) {
  changed_.wait(lock, [this] { return !busy_; });
  if (error_) std::rethrow_exception(error_);
}

void BlockWriter::work() {
  for (std::unique_lock lock(mutex_);;) {
    changed_.wait(lock, [this] { return busy_ || ending_; });
    if (!busy_) return;
    lock.unlock();
    std::exception_ptr error;
    try {
      make_safe(block_);
    } catch (...) {
      error = std::current_exception();
    }
    lock.lock();
    if (!error) safe_columns_ += 3 * block_.record.nodes.size();
    error_ = error;
    busy_ = false;
    changed_.notify_all();
  }
}

// Rows first, then the slot that vouches for them: what a killed process wrote stays. Checksums find what a power cut
// tore, whatever order the disk kept; so the disk is made to follow once a second, not at every short block.
void BlockWriter::make_safe(const SolvedBlock& block) {
  write_rows(sections_, blocks_[block.index], block.rows, part_);
  journal_.write(block.index, block.record);
  if (std::chrono::steady_clock::now() - synced_ > std::chrono::seconds(1)) sync();
}

void BlockWriter::sync() {
  part_.sync();
  journal_.sync();
  synced_ = std::chrono::steady_clock::now();
}

}  // namespace palpate
