#include "precompute/solver/machine_memory.h"

#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/statvfs.h>

#include <new>
#include <utility>
#include <vector>

#include "formats/errors.h"

namespace palpate {
namespace {

constexpr const char* kFolder = "/dev/shm";  // where MPI on Linux keeps the files behind its shared windows
constexpr std::int64_t kPage = 1 << 12, kCacheLine = 64;
constexpr const char* kOtherFailed = "another rank has failed";

}  // namespace

MachineMemory::MachineMemory(MPI_Comm all, std::function<bool()> someone_failed, OwnPeak* peak)
    : someone_failed_(std::move(someone_failed)), peak_(peak) {
  MPI_Comm_split_type(all, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &communicator_);
  MPI_Comm_set_errhandler(communicator_, MPI_ERRORS_RETURN);
  MPI_Comm_rank(communicator_, &rank_);
  MPI_Comm_size(communicator_, &count_);
}

MachineMemory::~MachineMemory() {
  if (window_ != MPI_WIN_NULL) {
    MPI_Win_unlock_all(window_);
    MPI_Win_free(&window_);
  }
  MPI_Comm_free(&communicator_);
}

void MachineMemory::allocate(std::int64_t bytes) {
  void* own = nullptr;
  bytes_ = bytes;
  const int failed = MPI_Win_allocate_shared(rank_ == 0 ? static_cast<MPI_Aint>(bytes + kCacheLine) : 0, 1,
                                             MPI_INFO_NULL, communicator_, &own, &window_);
  if (least(failed == MPI_SUCCESS ? 1 : 0) == 0) {
    window_ = MPI_WIN_NULL;
    throw OperationError(
        fmt::format("the ranks of this machine cannot share {:.3g} GB; run on one rank, or give {} more room",
                    1e-9 * static_cast<double>(bytes), kFolder));
  }
  MPI_Aint size = 0;
  int unit = 1;
  MPI_Win_shared_query(window_, 0, &size, &unit, &data_);
  MPI_Win_lock_all(MPI_MODE_NOCHECK, window_);
  // The offset is the same on every rank: MPI maps whole pages, and a page starts at a multiple of a cache line.
  const auto address = reinterpret_cast<std::uintptr_t>(data_);
  data_ = reinterpret_cast<void*>((address + kCacheLine - 1) / kCacheLine * kCacheLine);
}

void MachineMemory::shrink(std::int64_t bytes) {
  if (peak_) peak_->after_stage(peak_resident_bytes(), shared_resident_bytes(), count_);
  meet();
  if (rank_ == 0) {
    const auto begin =
        (reinterpret_cast<std::uintptr_t>(data_) + static_cast<std::uintptr_t>(bytes) + kPage - 1) / kPage * kPage;
    const auto end = (reinterpret_cast<std::uintptr_t>(data_) + static_cast<std::uintptr_t>(bytes_)) / kPage * kPage;
    // Where the system refuses, the pages stay: more memory than planned, and nothing else.
    if (begin < end) static_cast<void>(madvise(reinterpret_cast<void*>(begin), end - begin, MADV_REMOVE));
  }
  meet();
}

void MachineMemory::allocate_together(const std::function<void()>& work) {
  bool fine = true;
  try {
    work();
  } catch (const std::bad_alloc&) {
    fine = false;
  }
  if (least(fine ? 1 : 0) == 0) throw std::bad_alloc();
}

void MachineMemory::meet() {
  static_cast<void>(least(0));
}

std::int32_t MachineMemory::least(std::int32_t value) {
  if (window_ != MPI_WIN_NULL) MPI_Win_sync(window_);
  const std::int32_t result = wait_for_least(value);
  if (window_ != MPI_WIN_NULL) MPI_Win_sync(window_);
  return result;
}

std::int32_t MachineMemory::wait_for_least(std::int32_t value) {
  constexpr int kTestsBetweenQuestions = 1000;
  if (!exchange_) throw OperationError(kOtherFailed);
  *exchange_ = {value, value};
  MPI_Request request = MPI_REQUEST_NULL;
  bool fine = MPI_Iallreduce(&exchange_->mine, &exchange_->least, 1, MPI_INT32_T, MPI_MIN, communicator_, &request) ==
              MPI_SUCCESS;
  int done = 0;
  for (int tests = 1; fine && !done; ++tests) {
    fine = MPI_Test(&request, &done, MPI_STATUS_IGNORE) == MPI_SUCCESS;
    if (!done && tests % kTestsBetweenQuestions == 0 && someone_failed_ && someone_failed_()) give_up(kOtherFailed);
  }
  if (!fine) give_up("the ranks of this machine cannot reach one another");
  return exchange_->least;
}

// MPI cannot take a collective operation back. It may write its result when the other ranks come, so the memory for that stays
// until the process ends.
void MachineMemory::give_up(const char* why) {
  static std::vector<std::unique_ptr<Exchange>> left;
  left.push_back(std::move(exchange_));
  throw OperationError(why);
}

double MachineMemory::first(double value) {
  meet();
  MPI_Bcast(&value, 1, MPI_DOUBLE, 0, communicator_);
  return value;
}

double sharable_bytes() {
  struct statvfs room {};
  if (statvfs(kFolder, &room) != 0) return 0;
  return static_cast<double>(room.f_bavail) * static_cast<double>(room.f_frsize);
}

}  // namespace palpate
