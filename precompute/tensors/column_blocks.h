// Which touchable nodes are solved together: the same blocks for any number of ranks, and so the same bytes.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace palpate {

struct ColumnBlock {
  std::vector<std::int32_t> places;  // ascending, into the touchable nodes: where the rows go in the bundle
  std::vector<std::int32_t> nodes;   // touchable[places[i]]
};

// order: of each touchable node, its place in the solver's elimination order; nodes close in it share a block. Empty: as
// they come. The last block may be smaller than per_block.
std::vector<ColumnBlock> column_blocks(std::span<const std::int32_t> touchable, std::span<const std::int32_t> order,
                                       std::size_t per_block);

}  // namespace palpate
