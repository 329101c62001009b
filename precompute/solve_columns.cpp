#include "precompute/solve_columns.h"

#include <fmt/format.h>

#include "formats/errors.h"
#include "formats/program.h"
#include "precompute/petsc_session.h"
#include "precompute/stopwatch.h"

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

}  // namespace

std::map<std::size_t, BlockRecord> solve_columns(const ColumnJob& job, const Ranks& ranks, ColumnSolver& solver,
                                                 SolveSeconds* seconds) {
  SectionWriter writer(job.part);
  TensorBlock solved(solver);
  DisplacementRows rows;
  std::map<std::size_t, BlockRecord> records;
  const auto first = static_cast<std::size_t>(ranks.rank()), step = static_cast<std::size_t>(ranks.count());
  std::uint64_t mine = 0;
  for (std::size_t b = first; b < job.blocks.size(); b += step) mine += 3 * job.blocks[b].nodes.size();
  Progress progress("columns", mine);
  for (std::size_t b = first; b < job.blocks.size(); b += step) {
    if (ranks.someone_failed()) return records;
    const ColumnBlock& block = job.blocks[b];
    {
      const Stopwatch watch(&seconds->solve);
      solved.solve(job.held, job.body.fixed, block.nodes);
    }
    if (b == first) refuse_unused_options();
    const Stopwatch watch(&seconds->write);
    BlockRecord record = record_of(solved, block, job.sample);
    take_rows(job.sections, solved, rows, record);
    write_rows(job.sections, block, rows, writer);
    records[b] = std::move(record);
    progress.advance(3 * block.nodes.size());
  }
  const Stopwatch watch(&seconds->write);
  writer.sync();
  return records;
}

}  // namespace palpate
