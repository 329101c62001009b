// Makes sure that only one run at a time writes an output, by locks on its journal. The kernel drops a lock when its
// process ends, however it ends. Works on network file systems that have locks; on a file system without locks the
// program warns.
#pragma once

#include <filesystem>

#include "formats/plain_file.h"

namespace palpate {

class RunLock {
 public:
  // Rank 0 calls this before anything else. Creates the journal where there is none. Waits up to ten seconds for the
  // ranks of a run that was killed to end. Errors: OperationError where another run has the lock; InputError where the
  // file cannot be created.
  static RunLock of_run(const std::filesystem::path& journal);

  // Every other rank calls this once rank 0 has its lock. The next run then waits until this rank has ended too.
  static RunLock of_rank(const std::filesystem::path& journal, int rank);

 private:
  explicit RunLock(PlainFile file) : file_(std::move(file)) {}

  PlainFile file_;
};

}  // namespace palpate
