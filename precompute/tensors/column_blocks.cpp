#include "precompute/tensors/column_blocks.h"

#include <algorithm>
#include <numeric>

namespace palpate {

std::vector<ColumnBlock> column_blocks(std::span<const std::int32_t> touchable, std::span<const std::int32_t> order,
                                       std::size_t per_block) {
  std::vector<std::int32_t> places(touchable.size());
  std::iota(places.begin(), places.end(), 0);
  if (!order.empty())
    std::stable_sort(places.begin(), places.end(), [&](auto a, auto b) { return order[a] < order[b]; });
  std::vector<ColumnBlock> blocks;
  for (std::size_t at = 0; at < places.size(); at += per_block) {
    ColumnBlock block;
    const auto from = places.begin() + static_cast<std::ptrdiff_t>(at);
    block.places.assign(from, from + static_cast<std::ptrdiff_t>(std::min(per_block, places.size() - at)));
    std::sort(block.places.begin(), block.places.end());
    for (const auto place : block.places) block.nodes.push_back(touchable[place]);
    blocks.push_back(std::move(block));
  }
  return blocks;
}

}  // namespace palpate
