// Memory that the MPI ranks of one machine share, so that a large array is held once and not once a rank.
#pragma once

#include <mpi.h>

#include <cstdint>
#include <functional>
#include <memory>

#include "precompute/solver/memory_left.h"

namespace palpate {

// Every call but rank(), count() and data() is collective over the ranks of this machine, the destructor too.
class MachineMemory {
 public:
  // Collective over all ranks of `all`: those that run on one machine share one memory. someone_failed: asked while this rank
  // waits for the others; where it says true, this wait and all later ones throw OperationError. peak: of this process, borrowed; it is
  // told before memory is given back; may be null.
  explicit MachineMemory(MPI_Comm all, std::function<bool()> someone_failed = {}, OwnPeak* peak = nullptr);
  ~MachineMemory();
  MachineMemory(const MachineMemory&) = delete;
  MachineMemory& operator=(const MachineMemory&) = delete;

  int rank() const { return rank_; }  // on this machine
  int count() const { return count_; }

  // Once. Starts at a multiple of 64 bytes; the system takes a page when it is first written. Errors: OperationError, on every
  // rank alike.
  void allocate(std::int64_t bytes);
  void* data() const { return data_; }
  // Gives the pages behind the first `bytes` back to the system; their content is lost.
  void shrink(std::int64_t bytes);

  // Runs work, which is not collective, on every rank. Errors: bad_alloc on every rank where one of them has none.
  void allocate_together(const std::function<void()>& work);

  // Returns when every rank has called it; what a rank wrote before is then seen by all.
  void meet();
  // The least value of all ranks; as meet().
  std::int32_t least(std::int32_t value);
  // The value of rank 0; as meet().
  double first(double value);

 private:
  // What MPI reads and writes while this rank waits.
  struct Exchange {
    std::int32_t mine = 0, least = 0;
  };
  std::int32_t wait_for_least(std::int32_t value);
  [[noreturn]] void give_up(const char* why);

  std::function<bool()> someone_failed_;
  OwnPeak* peak_ = nullptr;
  MPI_Comm communicator_ = MPI_COMM_NULL;
  MPI_Win window_ = MPI_WIN_NULL;
  std::unique_ptr<Exchange> exchange_ = std::make_unique<Exchange>();  // null: this rank has given up waiting
  void* data_ = nullptr;
  std::int64_t bytes_ = 0;
  int rank_ = 0, count_ = 1;
};

// How many bytes the ranks of this machine can share at most; containers often allow 64 MB.
double sharable_bytes();

}  // namespace palpate
