// The processes that share one run: errors are everybody's, the columns are divided.
#pragma once

#include <mpi.h>

#include <cstdint>
#include <functional>

namespace palpate {

class Ranks {
 public:
  explicit Ranks(MPI_Comm communicator);
  int rank() const { return rank_; }
  int count() const { return count_; }
  int here() const { return here_; }  // those on this machine
  MPI_Comm communicator() const { return communicator_; }

  // Runs work on every rank. Where it throws on some, all ranks throw the error of the first of them: one sentence, one
  // exit code. Collective.
  void together(const std::function<void()>& work);

  // Inside together(), for long loops without collectives: whether another rank has failed, so that going on is
  // useless.
  bool someone_failed() const;

  // Beside together(), for a count that rank 0 shows while the others work: never blocks.
  void tell_progress(std::uint64_t done);  // on the other ranks
  std::uint64_t progress_of_others();      // on rank 0: what was told since the last call

  double least(double value) const;  // collective
  double most(double value) const;   // collective
  double sum(double value) const;    // collective

 private:
  MPI_Comm communicator_;
  int rank_ = 0, count_ = 1, here_ = 1;
};

}  // namespace palpate
