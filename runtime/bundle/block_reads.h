// Which bytes a product with a block of the compliance reads, to ask memory for them before the product begins.
#pragma once

#include <cstddef>

#include "formats/compliance_blocks.h"
#include "runtime/base/instructions.h"
#include "runtime/dense/loaded_runs.h"

namespace palpate {

// The same part of each of some runs of numbers.
struct ReadRuns {
  const void* first = nullptr;                              // the first run
  std::size_t stride = 0, count = 0, begin = 0, bytes = 0;  // in bytes: from run to run, and the part of each
  void fetch() const {
    constexpr std::size_t kLine = 64;
    for (std::size_t r = 0; r < count; ++r)
      for (std::size_t at = 0; at < bytes; at += kLine)
        prefetch_to_second_level(static_cast<const char*>(first) + r * stride + begin + at);
  }
};

struct BlockReads {
  ReadRuns own, other;  // numbers of the side where the loads are, and of the other one
  void fetch() const {
    own.fetch();
    other.fetch();
  }
};

// transposed: the loads are on the block's rows. Of the places between the first load and the last, those without a load are counted
// too: loads that share a block are near one another.
inline BlockReads block_reads(const formats::ComplianceBlock& block, formats::ElementType type, const void* values,
                              bool transposed, const Loads& loads) {
  const auto number = static_cast<std::size_t>(formats::element_bytes(type)), place = 3 * number;
  const auto rows = static_cast<std::size_t>(block.rows), columns = static_cast<std::size_t>(block.columns),
             rank = static_cast<std::size_t>(block.rank);
  const auto from = static_cast<std::size_t>(loads.slot[0] - (transposed ? block.row : block.column)),
             places = static_cast<std::size_t>(loads.slot[loads.count - 1] - loads.slot[0]) + 1;
  const auto at = [&](std::uint64_t first) { return static_cast<const char*>(values) + first * number; };
  BlockReads reads;
  if (rank > 0) {
    const std::size_t own = transposed ? rows : columns, other = transposed ? columns : rows;
    reads.own = {at(transposed ? block.u_run(0) : block.v_run(0)), own * place, rank, from * place, places * place};
    reads.other = {at(transposed ? block.v_run(0) : block.u_run(0)), 0, 1, 0, rank * other * place};
  } else if (transposed) {
    reads.own = {at(block.first), rows * place, 3 * columns, from * place, places * place};
  } else {
    reads.own = {at(block.first), 0, 1, 3 * from * rows * place, 3 * places * rows * place};
  }
  return reads;
}

}  // namespace palpate
