// The MPI ranks (processes) of one run. They divide the columns among them; an error of one rank ends all of them.
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
  int here() const { return here_; }  // how many of them run on this machine
  MPI_Comm communicator() const { return communicator_; }

  // Runs work on every rank. If work throws on some ranks, all ranks throw the error of the lowest of them, so that the
  // program prints one sentence and ends with one exit code. Collective.
  void together(const std::function<void()>& work);

  // Whether another rank has failed, so that this rank may stop. For long loops without collective calls, inside of
  // together().
  bool someone_failed() const;

  // For the progress bar of rank 0: the other ranks tell what they have done, and rank 0 asks. Neither call blocks.
  void tell_progress(std::uint64_t done);  // on the other ranks
  std::uint64_t progress_of_others();      // on rank 0: the sum of what they have told since the last call

  // Over the values of all ranks. Collective.
  double least(double value) const;
  double most(double value) const;
  double sum(double value) const;

 private:
  MPI_Comm communicator_;
  int rank_ = 0, count_ = 1, here_ = 1;
};

}  // namespace palpate
