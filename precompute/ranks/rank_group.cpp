#include "precompute/ranks/rank_group.h"

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <exception>
#include <string>
#include <thread>

#include "formats/errors.h"

namespace palpate {
namespace {

int kept_standard_error = STDERR_FILENO;

// How long a rank that has failed waits for the other ranks of its group to arrive in agree().
constexpr std::chrono::seconds kGrace(30);

[[noreturn]] void end_all(const std::string& failure) {
  const std::string text = "palpate-precompute: " + failure + "\n";
  [[maybe_unused]] const auto written = ::write(kept_standard_error, text.data(), text.size());
  MPI_Abort(MPI_COMM_WORLD, 1);
  std::terminate();  // not reached
}

}  // namespace

void keep_standard_error() {
  if (const int kept = ::dup(STDERR_FILENO); kept >= 0) kept_standard_error = kept;
}

RankGroup::RankGroup(const Ranks& ranks, int size)
    : ranks_(ranks), size_(size), index_(ranks.rank() / size), count_(ranks.count() / size) {
  if (ranks.count() % size != 0)
    throw InputError(
        fmt::format("--ranks-per-operator {}: expected a number that divides the {} ranks", size, ranks.count()));
  MPI_Comm_split(ranks.communicator(), index_, ranks.rank(), &communicator_);
  MPI_Comm_rank(communicator_, &rank_);
}

RankGroup::~RankGroup() {
  MPI_Comm_free(&communicator_);
}

bool RankGroup::together(const std::function<void()>& work) const {
  try {
    work();
  } catch (const std::exception& error) {
    agree(false, error.what());
    throw;
  }
  return agree(!ranks_.someone_failed(), nullptr);
}

// failure: the error's sentence on a rank that threw, null on the others.
bool RankGroup::agree(bool fine, const char* failure) const {
  const int mine = fine ? 1 : 0;
  int all = 0, done = 0;
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Iallreduce(&mine, &all, 1, MPI_INT, MPI_MIN, communicator_, &request);
  if (!failure) {
    MPI_Wait(&request, MPI_STATUS_IGNORE);
    return all == 1;
  }
  const auto until = std::chrono::steady_clock::now() + kGrace;
  while (MPI_Test(&request, &done, MPI_STATUS_IGNORE), !done) {
    if (std::chrono::steady_clock::now() > until) end_all(failure);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return false;
}

}  // namespace palpate
