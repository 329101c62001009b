#include "precompute/ranks/ranks.h"

#include <new>
#include <string>
#include <vector>

#include "formats/errors.h"

namespace palpate {
namespace {

enum Kind { kFine = 0, kOperation = 1, kInput = 2, kVerification = 3 };
constexpr int kFailedTag = 71, kProgressTag = 72;

[[noreturn]] void throw_as(int kind, const std::string& text) {
  if (kind == kInput) throw InputError(text);
  if (kind == kVerification) throw VerificationError(text);
  throw OperationError(text);
}

double reduce(double value, MPI_Op operation, MPI_Comm communicator) {
  double result = value;
  MPI_Allreduce(&value, &result, 1, MPI_DOUBLE, operation, communicator);
  return result;
}

}  // namespace

Ranks::Ranks(MPI_Comm communicator) : communicator_(communicator) {
  MPI_Comm_rank(communicator, &rank_);
  MPI_Comm_size(communicator, &count_);
  MPI_Comm machine = MPI_COMM_NULL;
  MPI_Comm_split_type(communicator, MPI_COMM_TYPE_SHARED, rank_, MPI_INFO_NULL, &machine);
  MPI_Comm_size(machine, &here_);
  MPI_Comm_free(&machine);
}

void Ranks::together(const std::function<void()>& work) {
  int kind = kFine;
  std::string text;
  try {
    work();
  } catch (const InputError& error) {
    kind = kInput, text = error.what();
  } catch (const VerificationError& error) {
    kind = kVerification, text = error.what();
  } catch (const std::bad_alloc&) {
    kind = kOperation, text = "out of memory; use a coarser mesh, fewer ranks on this machine, or a larger machine";
  } catch (const std::exception& error) {
    kind = kOperation, text = error.what();
  }
  if (kind != kFine)
    for (int other = 0; other < count_; ++other)
      if (other != rank_) MPI_Send(nullptr, 0, MPI_CHAR, other, kFailedTag, communicator_);  // empty: never blocks

  int mine = kind == kFine ? count_ : rank_, first = count_;
  MPI_Allreduce(&mine, &first, 1, MPI_INT, MPI_MIN, communicator_);
  // Receives the messages of the ranks that failed.
  for (int waiting = 0; MPI_Iprobe(MPI_ANY_SOURCE, kFailedTag, communicator_, &waiting, MPI_STATUS_IGNORE), waiting;)
    MPI_Recv(nullptr, 0, MPI_CHAR, MPI_ANY_SOURCE, kFailedTag, communicator_, MPI_STATUS_IGNORE);
  if (first == count_) return;
  int sizes[2] = {kind, static_cast<int>(text.size())};
  MPI_Bcast(sizes, 2, MPI_INT, first, communicator_);
  text.resize(static_cast<std::size_t>(sizes[1]));
  MPI_Bcast(text.data(), sizes[1], MPI_CHAR, first, communicator_);
  throw_as(sizes[0], text);
}

bool Ranks::someone_failed() const {
  int waiting = 0;
  MPI_Iprobe(MPI_ANY_SOURCE, kFailedTag, communicator_, &waiting, MPI_STATUS_IGNORE);
  return waiting != 0;
}

void Ranks::tell_progress(std::uint64_t done) {
  if (done > 0) MPI_Send(&done, 1, MPI_UINT64_T, 0, kProgressTag, communicator_);  // short: never blocks
}

std::uint64_t Ranks::progress_of_others() {
  std::uint64_t sum = 0;
  for (int waiting = 0;
       MPI_Iprobe(MPI_ANY_SOURCE, kProgressTag, communicator_, &waiting, MPI_STATUS_IGNORE), waiting;) {
    std::uint64_t done = 0;
    MPI_Recv(&done, 1, MPI_UINT64_T, MPI_ANY_SOURCE, kProgressTag, communicator_, MPI_STATUS_IGNORE);
    sum += done;
  }
  return sum;
}

double Ranks::least(double value) const {
  return reduce(value, MPI_MIN, communicator_);
}
double Ranks::most(double value) const {
  return reduce(value, MPI_MAX, communicator_);
}
double Ranks::sum(double value) const {
  return reduce(value, MPI_SUM, communicator_);
}

}  // namespace palpate
