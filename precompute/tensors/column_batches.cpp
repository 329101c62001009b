#include "precompute/tensors/column_batches.h"

#include <algorithm>
#include <numeric>

namespace palpate {

std::vector<ColumnBatch> column_batches(std::span<const std::int32_t> touchable, std::span<const std::int32_t> order,
                                        std::size_t per_batch) {
  std::vector<std::int32_t> slots(touchable.size());
  std::iota(slots.begin(), slots.end(), 0);
  if (!order.empty()) std::stable_sort(slots.begin(), slots.end(), [&](auto a, auto b) { return order[a] < order[b]; });
  std::vector<ColumnBatch> batches;
  for (std::size_t at = 0; at < slots.size(); at += per_batch) {
    ColumnBatch batch;
    const auto from = slots.begin() + static_cast<std::ptrdiff_t>(at);
    batch.slots.assign(from, from + static_cast<std::ptrdiff_t>(std::min(per_batch, slots.size() - at)));
    std::sort(batch.slots.begin(), batch.slots.end());
    for (const auto slot : batch.slots) batch.nodes.push_back(touchable[slot]);
    batches.push_back(std::move(batch));
  }
  return batches;
}

}  // namespace palpate
