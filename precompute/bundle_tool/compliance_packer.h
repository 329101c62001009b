// Columns of the compliance C -> C in few bytes. The surface nodes are divided into a tree of clusters. A pair of
// clusters that are near each other is stored as a dense matrix, a pair that are apart as a product of two thin ones
// (low rank). C is symmetric, so each pair is stored once.
//
// Low rank works because C between two clusters that are apart is a smooth function, whose rank for a given error
// hardly grows with the number of nodes (Hackbusch, A sparse matrix arithmetic based on H-matrices, Computing 62,
// 1999). The products are found by cross approximation (Bebendorf, Approximation of boundary element matrices, Numer.
// Math. 86, 2000). "Block" here is the matrix of a pair of clusters, as in formats/compliance_blocks.h.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "formats/bundle_layout.h"
#include "formats/compliance_blocks.h"

namespace palpate {

struct CompliancePackOptions {
  formats::ElementType type = formats::ElementType::f32;  // f32 or f16
  // The largest relative error of a column (2-norm over the surface) that low rank may make; empty: every block is
  // dense.
  std::optional<double> low_rank;
};

// What is packed.
struct ComplianceSource {
  std::int32_t surface_nodes = 0;
  std::vector<double> position;         // [Ns][3]
  std::vector<std::int32_t> touchable;  // ascending surface nodes
  std::vector<double> stiffness;        // [S][3][3] T^f
  // c: [3][nodes][3] m/N: row j is C e of dof j of touchable[k], at these surface nodes. Called many times for each k, so that
  // nobody has to hold all of C in memory.
  std::function<void(std::size_t k, std::span<const std::int32_t> nodes, double* c)> compliance;
};

// The numbers of the sections tensors/compliance/*.
struct PackedCompliance {
  std::vector<std::int32_t> nodes, cluster_ends, blocks;
  std::vector<float> scale;
  std::vector<char> values;
  std::size_t low_rank_blocks = 0, dense_blocks = 0;
  std::size_t apart_but_dense = 0;  // pairs that are apart but take no more numbers as a dense matrix
  std::int32_t largest_rank = 0;
};

// The same input gives the same bytes. Cost: for each pair that is apart, its numbers times its rank. Memory: the result, and
// twice the largest pair that is apart.
PackedCompliance pack_compliance(const ComplianceSource& source, const CompliancePackOptions& options);

// The same blocks with f16 in place of f32. values: the numbers of all blocks. Nodes, clusters and blocks are left empty.
PackedCompliance blocks_in_halves(std::span<const formats::ComplianceBlock> blocks, const float* values);

// The scale s of numbers that are stored as halves: a power of two that brings the largest just below 2^15, so that
// numbers keep 11 bits down to 2^-29 of the largest.
float half_scale(double largest);

}  // namespace palpate
