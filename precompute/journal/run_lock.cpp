#include "precompute/journal/run_lock.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <thread>

#include "formats/errors.h"
#include "formats/program.h"

namespace palpate {
namespace {

// Rank r locks byte r of the journal. So a new run can tell a run at work (byte 0) from the remaining ranks of a killed
// one.
enum class Answer { taken, held, no_locks };

// Locks the bytes first .. first + count - 1, or all from first on where count is 0. type F_UNLCK unlocks them.
Answer set_lock(const PlainFile& file, short type, off_t first, off_t count) {
  struct flock range {};
  range.l_type = type;
  range.l_whence = SEEK_SET;
  range.l_start = first;
  range.l_len = count;
  if (::fcntl(file.descriptor(), F_OFD_SETLK, &range) == 0) return Answer::taken;
  return errno == EAGAIN || errno == EACCES ? Answer::held : Answer::no_locks;
}

PlainFile open_journal(const std::filesystem::path& journal) {
  try {
    return PlainFile(journal, O_RDWR | O_CREAT);
  } catch (const OperationError& error) {
    throw InputError(error.what());
  }
}

// Whether the locked file still has its name: a run that ended in between has removed it.
bool is_current(const PlainFile& file) {
  struct stat open {
  }, named{};
  return ::fstat(file.descriptor(), &open) == 0 && ::stat(file.path().c_str(), &named) == 0 &&
         open.st_dev == named.st_dev && open.st_ino == named.st_ino;
}

}  // namespace

RunLock RunLock::of_run(const std::filesystem::path& journal) {
  using namespace std::chrono;
  for (const auto until = steady_clock::now() + seconds(10);;) {
    PlainFile file = open_journal(journal);
    if (const Answer run = set_lock(file, F_WRLCK, 0, 1); run == Answer::no_locks) {
      warn(fmt::format("{}: this file system has no locks ({}); a second run on it would not be noticed",
                       journal.string(), std::strerror(errno)));
      return RunLock(std::move(file));
    } else if (run == Answer::held) {
      throw OperationError(fmt::format(
          "{}: another run is writing it; wait for its end or name another output",
          journal.parent_path().empty() ? journal.stem().string() : (journal.parent_path() / journal.stem()).string()));
    }
    if (!is_current(file)) continue;
    if (set_lock(file, F_WRLCK, 1, 0) == Answer::taken) {
      set_lock(file, F_UNLCK, 1, 0);
      return RunLock(std::move(file));
    }
    if (steady_clock::now() > until)
      throw OperationError(
          fmt::format("{}: ranks of an earlier run are still at work on it; end them first", journal.string()));
    std::this_thread::sleep_for(milliseconds(50));
  }
}

RunLock RunLock::of_rank(const std::filesystem::path& journal, int rank) {
  PlainFile file(journal, O_RDWR);
  set_lock(file, F_WRLCK, rank, 1);  // where there are no locks, rank 0 has warned already
  return RunLock(std::move(file));
}

}  // namespace palpate
