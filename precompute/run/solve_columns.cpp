#include "precompute/run/solve_columns.h"

#include <fcntl.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <thread>

#include "formats/errors.h"
#include "formats/program.h"
#include "precompute/run/stopwatch.h"
#include "precompute/solver/petsc_session.h"

namespace palpate {
namespace {

void refuse_unused_options() {
  const std::string unused = unused_petsc_options();
  if (!unused.empty())
    throw InputError(fmt::format(
        "PETSc did not use the options after \"--\": {}; check their spelling and whether the chosen solver "
        "reads them",
        unused));
}

// The progress bar, over the columns of all ranks. Columns that an earlier run solved count as done.
class SharedProgress {
 public:
  SharedProgress(const ColumnJob& job, const SafeBatches& safe, Ranks& ranks) : ranks_(ranks) {
    std::uint64_t all = 0, before = 0;
    for (std::size_t b = 0; b < job.batches.size(); ++b) {
      all += 3 * job.batches[b].nodes.size();
      if (safe[b]) before += 3 * job.batches[b].nodes.size();
    }
    left_ = all - before;
    if (ranks.rank() == 0) shown_.emplace("columns", all, before);
  }

  // mine: columns of this rank that are safe so far.
  void update(std::uint64_t mine) {
    const std::uint64_t news = mine - mine_;
    mine_ = mine;
    if (ranks_.rank() != 0) return ranks_.tell_progress(news);
    const std::uint64_t done = news + ranks_.progress_of_others();
    left_ -= done;
    if (done > 0) shown_->advance(done);
  }

  // On rank 0, when its own columns are done: shows the progress of the others until they are done.
  void follow_others() {
    while (ranks_.rank() == 0 && left_ > 0 && !ranks_.someone_failed()) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      update(mine_);
    }
  }

 private:
  Ranks& ranks_;
  std::uint64_t mine_ = 0, left_ = 0;
  std::optional<Progress> shown_;
};

}  // namespace

SafeBatches find_safe_batches(const ColumnJob& job, const Ranks& ranks) {
  const ColumnJournal journal(job.journal, job.batches, job.sample);
  const PlainFile part(job.part, O_RDONLY);
  SafeBatches safe(job.batches.size(), 0);
  for (auto b = static_cast<std::size_t>(ranks.rank()); b < safe.size(); b += static_cast<std::size_t>(ranks.count()))
    if (const auto record = journal.read(b)) safe[b] = rows_hold(job.sections, job.batches[b], *record, part);
  return safe;
}

SafeBatches agree_on_safe_batches(SafeBatches found, const Ranks& ranks) {
  MPI_Allreduce(MPI_IN_PLACE, found.data(), static_cast<int>(found.size()), MPI_UINT8_T, MPI_MAX, ranks.communicator());
  return found;
}

namespace {

// Solves this group's share of the batches that are left and hands them to the writer. Returns false where another rank has
// failed.
bool solve_share(const ColumnJob& job, const std::vector<std::size_t>& left, const RankGroup& group,
                 ColumnSolver& solver, std::optional<BatchWriter>& writer, SharedProgress& progress,
                 SolveSeconds& seconds) {
  BatchTensors solved(solver, job.discretisation, job.held);
  SolvedBatch batch;
  const auto solve = [&](bool first) {
    const Stopwatch watch(&seconds.solve);
    const ColumnBatch& columns = job.batches[batch.index];
    solved.solve(columns.nodes);
    if (first) refuse_unused_options();
    if (!writer) return;
    batch.record = record_of(solved, columns, job.sample);
    take_rows(job.sections, solved, batch.rows, batch.record);
  };
  const auto write = [&] {
    const Stopwatch watch(&seconds.wait);
    writer->put(batch);
    progress.update(writer->safe_columns());
  };
  const auto first = static_cast<std::size_t>(group.index()), step = static_cast<std::size_t>(group.count());
  for (std::size_t i = first; i < left.size(); i += step) {
    batch.index = left[i];
    const bool going = group.together([&] {
      solve(i == first);
      if (writer) write();
    });
    if (!going) return false;
  }
  return true;
}

}  // namespace

SolveSeconds solve_columns(const ColumnJob& job, const SafeBatches& safe, Ranks& ranks, const RankGroup& group,
                           ColumnSolver& solver) {
  std::vector<std::size_t> left;
  for (std::size_t b = 0; b < safe.size(); ++b)
    if (!safe[b]) left.push_back(b);
  SolveSeconds seconds;
  SharedProgress progress(job, safe, ranks);
  std::optional<BatchWriter> writer;  // on the root of each group, which has the results
  const bool going = group.together([&] {
    if (group.is_root()) writer.emplace(job.part, job.journal, job.sections, job.batches, job.sample);
  });
  if (!going || !solve_share(job, left, group, solver, writer, progress, seconds) || !writer) return seconds;
  {
    const Stopwatch watch(&seconds.wait);
    writer->finish();
  }
  progress.update(writer->safe_columns());
  progress.follow_others();
  return seconds;
}

}  // namespace palpate
