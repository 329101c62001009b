// Rows of K divided among the ranks of a group: near nodes in near rows, each rank assembling its own.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "precompute/elements/elastic_body.h"
#include "precompute/elements/stiffness.h"

namespace palpate {

// Known to every rank of the group; 8 bytes per node.
struct RowPartition {
  std::vector<std::int32_t> row_of_node;  // -1: all dofs held, no row
  std::vector<std::int32_t> node_of_row;
  std::vector<std::int32_t> first_row;  // [ranks + 1]: rank r has rows first_row[r] .. first_row[r + 1] - 1
};

// Bisects the nodes with a free dof along their longest extent, again and again: each rank gets a compact piece with its
// share of the rows, and rows that are near in number are near in space. Deterministic.
RowPartition partition_rows(std::span<const std::array<double, 3>> nodes,
                            std::span<const std::array<std::uint8_t, 3>> fixed, int ranks);

// Rows of one rank, nothing held; columns: rows of the whole, ascending. Only the tetrahedra around the rank's nodes and
// their neighbours are assembled, which makes its rows the same to the last bit as those of the whole body. assemble: K
// over all nodes of the body it is given. Columns whose node has no row are left out.
BlockMatrix assemble_own_rows(const ElasticBody& body, const RowPartition& partition, int rank,
                              const std::function<BlockMatrix(const ElasticBody&)>& assemble);

}  // namespace palpate
