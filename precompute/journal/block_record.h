// What is kept of a solved block beside its displacement rows: forces, certificate, and checksums of the rows.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "precompute/tensors/column_blocks.h"
#include "precompute/tensors/reciprocity_sample.h"
#include "precompute/tensors/tensors.h"

namespace palpate {

struct NodeRecord {
  std::array<double, 9> force;             // T^f, row-major, N/m
  std::array<double, 3> residual;          // true relative residual of each column
  std::array<std::int32_t, 3> iterations;  // of each column
  std::uint32_t reserved;
  std::array<std::uint64_t, 2> rows;  // XXH64 of the node's bytes in each displacement section; 0: no such section
};
static_assert(sizeof(NodeRecord) == 128);

struct BlockRecord {
  double cast_error = 0;           // largest relative error of a stored column against the solved one
  double residual_floor = 0;       // largest ColumnReport::floor
  std::vector<NodeRecord> nodes;   // of the block, in its order
  std::vector<double> compliance;  // of the block's sampled nodes in turn: what ReciprocitySample::take wants
};

// All but the checksums, which are those of bytes to be written.
BlockRecord record_of(const TensorBlock& solved, const ColumnBlock& block, const ReciprocitySample& sample);

// A record as plain bytes of a length that is known before anything is solved.
std::size_t record_bytes(const ColumnBlock& block, const ReciprocitySample& sample);
std::vector<std::byte> to_bytes(const BlockRecord& record);
BlockRecord from_bytes(std::span<const std::byte> bytes, const ColumnBlock& block);

}  // namespace palpate
