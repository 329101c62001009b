// One run at a time on an output. Locks on the journal that the kernel drops with their process, on network file systems
// too where these have locks. Not seen: a run in another folder, and a file system without locks (then it is said).
#pragma once

#include <filesystem>

#include "formats/plain_file.h"

namespace palpate {

class RunLock {
 public:
  // Rank 0, before anything else. Makes the journal where there is none. Waits up to ten seconds for the ranks of a run
  // that was killed. Errors: OperationError when another run is on it; InputError when the file cannot be made.
  static RunLock of_run(const std::filesystem::path& journal);

  // Every other rank, once rank 0 has it: keeps the next run out until this rank has ended too.
  static RunLock of_rank(const std::filesystem::path& journal, int rank);

 private:
  explicit RunLock(PlainFile file) : file_(std::move(file)) {}

  PlainFile file_;
};

}  // namespace palpate
