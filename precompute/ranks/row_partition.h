// Divides the rows of K among the ranks of a group, so that each rank has a compact piece of the body and assembles its own
// rows.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "precompute/elements/elastic_body.h"
#include "precompute/elements/stiffness.h"

namespace palpate {

// The partition is known to every rank of the group. It takes 8 bytes per node.
struct RowPartition {
  std::vector<std::int32_t> row_of_node;  // -1: all dofs held, no row
  std::vector<std::int32_t> node_of_row;
  std::vector<std::int32_t> first_row;  // [ranks + 1]: rank r has rows first_row[r] .. first_row[r + 1] - 1
};

// Recursive bisection: cuts the set of nodes with a free dof into two along its longest extent, and each part again. So each
// rank gets a compact piece with its share of the rows, and rows with near numbers belong to nodes that are near in space. The
// same input gives the same partition.
RowPartition partition_rows(std::span<const std::array<double, 3>> nodes,
                            std::span<const std::array<std::uint8_t, 3>> fixed, int ranks);

// The rows of K of one rank, without removing the held dofs of nodes that have a row. Columns are numbered as the rows of the
// whole K, ascending; columns of nodes that have no row are left out. Only the tetrahedra around the rank's nodes and around
// their neighbours are assembled; that suffices for rows that equal those of the whole body to the last bit. assemble: gives K
// over all nodes of the body that it is given.
BlockMatrix assemble_own_rows(const ElasticBody& body, const RowPartition& partition, int rank,
                              const std::function<BlockMatrix(const ElasticBody&)>& assemble);

}  // namespace palpate
