// The ranks that share one operator.
#pragma once

#include <functional>

#include "precompute/ranks/ranks.h"

namespace palpate {

// Ranks 0 .. size - 1 are the first group, the next ones the second, and so on.
class RankGroup {
 public:
  // Collective over all ranks. Errors: InputError where size does not divide their number.
  RankGroup(const Ranks& ranks, int size);
  ~RankGroup();
  RankGroup(const RankGroup&) = delete;
  RankGroup& operator=(const RankGroup&) = delete;

  int size() const { return size_; }
  int rank() const { return rank_; }    // within the group; rank 0 has the results and writes them
  int index() const { return index_; }  // of the group
  int count() const { return count_; }  // of groups
  bool is_root() const { return rank_ == 0; }
  MPI_Comm communicator() const { return communicator_; }

  // Runs work, whose calls may be collective over the group, on each of its ranks. True where all of them are fine and no
  // rank outside has failed either. Rethrows what work threw here; the others then get false, and the error from
  // Ranks::together(), inside of which this belongs. If they do not come to hear of it, because they wait inside work for
  // the rank that threw, all processes end with its sentence.
  bool together(const std::function<void()>& work) const;

 private:
  bool agree(bool fine, const char* failure) const;

  const Ranks& ranks_;
  MPI_Comm communicator_ = MPI_COMM_NULL;
  int size_, rank_ = 0, index_, count_;
};

// Before a rank's standard error is closed: what a rank says that ends all others must be heard.
void keep_standard_error();

}  // namespace palpate
