// A group of ranks that share one operator K, because K does not fit into the memory of one rank.
#pragma once

#include <functional>

#include "precompute/ranks/ranks.h"

namespace palpate {

// Ranks 0 .. size - 1 form the first group, the next size ranks the second group, and so on.
class RankGroup {
 public:
  // Collective over all ranks. Errors: InputError where size does not divide the number of ranks.
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

  // Runs work on each rank of the group; calls in work may be collective over the group. Returns true where work has thrown
  // on no rank of the group and no rank of another group has failed. Where work throws on this rank, rethrows; the other
  // ranks of the group then return false, and Ranks::together(), which must enclose this call, gives them the error. The
  // other ranks may be waiting inside work for the rank that threw; if they do not arrive within half a minute, all
  // processes end, and the message is that of the error.
  bool together(const std::function<void()>& work) const;

 private:
  bool agree(bool fine, const char* failure) const;

  const Ranks& ranks_;
  MPI_Comm communicator_ = MPI_COMM_NULL;
  int size_, rank_ = 0, index_, count_;
};

// Keeps a copy of this rank's standard error. To be called before that is closed, so that a rank which has to end all others
// can still print its message.
void keep_standard_error();

}  // namespace palpate
