// Asks memory for the numbers of a block of the compliance before the product that reads them.
#pragma once

#include <cstddef>

#include "formats/compliance_blocks.h"
#include "runtime/base/instructions.h"
#include "runtime/dense/loaded_runs.h"

namespace palpate {

// The same part of each run: `bytes` from `first` on, then the same `stride` bytes further, `count` times.
inline void fetch_runs(const char* first, std::size_t stride, std::size_t count, std::size_t bytes) {
  constexpr std::size_t kLine = 64;
  for (std::size_t r = 0; r < count; ++r)
    for (std::size_t at = 0; at < bytes; at += kLine) prefetch_to_second_level(first + r * stride + at);
}

// transposed: the loads are on the block's rows. Of the places between the first load and the last, those without a load are fetched
// too: loads that share a block are near one another.
inline void fetch_block(const formats::ComplianceBlock& block, formats::ElementType type, const void* values,
                        bool transposed, const Loads& loads) {
  const auto number = static_cast<std::size_t>(formats::element_bytes(type)), place = 3 * number;
  const auto rows = static_cast<std::size_t>(block.rows), columns = static_cast<std::size_t>(block.columns),
             rank = static_cast<std::size_t>(block.rank);
  const auto from = static_cast<std::size_t>(loads.slot[0] - (transposed ? block.row : block.column)),
             places = static_cast<std::size_t>(loads.slot[loads.count - 1] - loads.slot[0]) + 1;
  const auto at = [&](std::uint64_t first) { return static_cast<const char*>(values) + first * number; };
  if (rank > 0) {
    const std::size_t own = transposed ? rows : columns, other = transposed ? columns : rows;
    fetch_runs(at(transposed ? block.u_run(0) : block.v_run(0)) + from * place, own * place, rank, places * place);
    fetch_runs(at(transposed ? block.v_run(0) : block.u_run(0)), 0, 1, rank * other * place);
  } else if (transposed) {
    fetch_runs(at(block.first) + from * place, rows * place, 3 * columns, places * place);
  } else {
    fetch_runs(at(block.first) + 3 * from * rows * place, 0, 1, 3 * places * rows * place);
  }
}

}  // namespace palpate
