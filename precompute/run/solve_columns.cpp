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

// Of all ranks' columns; those that were safe before count as done.
class SharedProgress {
 public:
  SharedProgress(const ColumnJob& job, const std::vector<char>& safe, Ranks& ranks) : ranks_(ranks) {
    std::uint64_t all = 0, before = 0;
    for (std::size_t b = 0; b < job.blocks.size(); ++b) {
      all += 3 * job.blocks[b].nodes.size();
      if (safe[b]) before += 3 * job.blocks[b].nodes.size();
    }
    left_ = all - before;
    if (ranks.rank() == 0) shown_.emplace("columns", all, before);
  }

  // mine: this rank's safe columns so far.
  void update(std::uint64_t mine) {
    const std::uint64_t news = mine - mine_;
    mine_ = mine;
    if (ranks_.rank() != 0) return ranks_.tell_progress(news);
    const std::uint64_t done = news + ranks_.progress_of_others();
    left_ -= done;
    if (done > 0) shown_->advance(done);
  }

  // Rank 0, when its own columns are done: shows those of the others.
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

std::vector<char> find_safe_blocks(const ColumnJob& job, const Ranks& ranks) {
  const ColumnJournal journal(job.journal, job.blocks, job.sample);
  const PlainFile part(job.part, O_RDONLY);
  std::vector<char> safe(job.blocks.size(), 0);
  for (auto b = static_cast<std::size_t>(ranks.rank()); b < safe.size(); b += static_cast<std::size_t>(ranks.count()))
    if (const auto record = journal.read(b)) safe[b] = rows_hold(job.sections, job.blocks[b], *record, part);
  return safe;
}

void solve_columns(const ColumnJob& job, const std::vector<char>& safe, Ranks& ranks, const RankGroup& group,
                   BlockSolver& solver, SolveSeconds* seconds) {
  std::vector<std::size_t> left;
  for (std::size_t b = 0; b < safe.size(); ++b)
    if (!safe[b]) left.push_back(b);
  SharedProgress progress(job, safe, ranks);
  TensorBlock solved(solver, job.discretisation, job.held);
  SolvedBlock block;
  std::optional<BlockWriter> writer;  // the root's
  const auto solve = [&](bool first) {
    const Stopwatch watch(&seconds->solve);
    const ColumnBlock& columns = job.blocks[block.index];
    solved.solve(columns.nodes);
    if (first) refuse_unused_options();
    if (!writer) return;
    block.record = record_of(solved, columns, job.sample);
    take_rows(job.sections, solved, block.rows, block.record);
  };
  const auto write = [&] {
    const Stopwatch watch(&seconds->wait);
    writer->put(block);
    progress.update(writer->safe_columns());
  };
  bool going = group.together([&] {
    if (group.is_root()) writer.emplace(job.part, job.journal, job.sections, job.blocks, job.sample);
  });
  const auto first = static_cast<std::size_t>(group.index()), step = static_cast<std::size_t>(group.count());
  for (std::size_t i = first; going && i < left.size(); i += step) {
    block.index = left[i];
    going = group.together([&] {
      solve(i == first);
      if (writer) write();
    });
  }
  if (!going || !writer) return;
  {
    const Stopwatch watch(&seconds->wait);
    writer->finish();
  }
  progress.update(writer->safe_columns());
  progress.follow_others();
}

}  // namespace palpate
