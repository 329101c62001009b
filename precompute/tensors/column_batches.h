// Which touchable nodes are solved together. The batches do not depend on the number of ranks, so the bundle does not
// either.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace palpate {

struct ColumnBatch {
  // The slots of the nodes, ascending. The slot of a node is its position in the list of touchable nodes, and so the
  // position of its rows in every section of the bundle that has an entry for each touchable node.
  std::vector<std::int32_t> slots;
  std::vector<std::int32_t> nodes;  // touchable[slots[i]]
};

// order: for each touchable node its position in the solver's elimination order, or empty. Nodes that are close in that
// order share a batch, because their triangular solves then visit the same rows. The last batch may have fewer than
// per_batch nodes.
std::vector<ColumnBatch> column_batches(std::span<const std::int32_t> touchable, std::span<const std::int32_t> order,
                                        std::size_t per_batch);

}  // namespace palpate
