// The record of a solved batch: what the journal keeps beside the displacement rows, which go into the part. It holds
// T^f, residuals and iterations of each column, and checksums of the rows.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "precompute/tensors/column_batches.h"
#include "precompute/tensors/reciprocity_sample.h"
#include "precompute/tensors/tensors.h"

namespace palpate {

struct NodeRecord {
  std::array<double, 9> stiffness;         // T^f, row-major, N/m
  std::array<double, 3> residual;          // true relative residual of each column
  std::array<std::int32_t, 3> iterations;  // of each column
  std::uint32_t reserved;
  std::array<std::uint64_t, 2> rows;  // XXH64 of the node's bytes in each displacement section; 0: no such section
};
static_assert(sizeof(NodeRecord) == 128);

struct BatchRecord {
  double cast_error = 0;          // largest relative error that rounding to the stored type made in a column
  double residual_floor = 0;      // largest ColumnReport::floor
  std::vector<NodeRecord> nodes;  // one for each node of the batch, in its order
  std::vector<double>
      compliance;  // of each node of the batch that is in the sample: what ReciprocitySample::take needs
};

// Everything but the checksums, which take_rows() fills in.
BatchRecord record_of(const BatchTensors& solved, const ColumnBatch& batch, const ReciprocitySample& sample);

// A record as plain bytes. Their number is known before the batch is solved, so that the journal can be laid out.
std::size_t record_bytes(const ColumnBatch& batch, const ReciprocitySample& sample);
std::vector<std::byte> to_bytes(const BatchRecord& record);
BatchRecord from_bytes(std::span<const std::byte> bytes, const ColumnBatch& batch);

}  // namespace palpate
