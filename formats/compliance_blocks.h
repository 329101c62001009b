// The compliance matrix stored in blocks (sections tensors/compliance/*): where the numbers of a block are, and what they
// mean. The runtime and palpate-bundle read blocks through this header. Nothing here allocates.
#pragma once

#include <cstddef>
#include <cstdint>

#include "formats/bundle_layout.h"
#include "formats/half.h"

namespace palpate::formats {

// A number of a section of floating-point numbers, widened.
inline double stored_number(ElementType type, const void* numbers, std::size_t at) {
  if (type == ElementType::f32) return static_cast<const float*>(numbers)[at];
  if (type == ElementType::f64) return static_cast<const double*>(numbers)[at];
  return float_of_half(static_cast<const std::uint16_t*>(numbers)[at]);
}

// Readers build a table of pairs of clusters, so this bounds its size.
inline constexpr std::uint64_t kMaxClusters = 4096;

// One row of tensors/compliance/blocks. A place is a position in tensors/compliance/nodes; a cluster is a run of places.
struct StoredBlock {
  std::int32_t row_begin, row_end;        // clusters
  std::int32_t column_begin, column_end;  // clusters of touchable nodes
  std::int32_t rank;                      // 0: dense
};
static_assert(sizeof(StoredBlock) == 20);

inline std::int32_t cluster_begin(const std::int32_t* cluster_ends, std::int32_t cluster) {
  return cluster == 0 ? 0 : cluster_ends[cluster - 1];
}

// A block, by the places of its rows and columns. Dense: [columns][3][rows][3], a run of rows for each column's dof. Low rank:
// [rank][rows][3] of U, then [rank][columns][3] of V. C = scale * dense, or scale * sum over q of U_q V_q^T.
struct ComplianceBlock {
  std::int32_t row = 0, rows = 0, column = 0, columns = 0, rank = 0;
  std::uint64_t first = 0;  // its first number in tensors/compliance/values
  float scale = 1;

  bool diagonal() const { return row == column; }
  // Numbers of a dense block, or of U and V. The reader has checked that they fit the section.
  std::uint64_t numbers() const {
    const auto r = static_cast<std::uint64_t>(rows), c = static_cast<std::uint64_t>(columns);
    return rank == 0 ? 9 * r * c : 3 * static_cast<std::uint64_t>(rank) * (r + c);
  }
  std::uint64_t dense_run(std::int32_t c, int j) const {
    return first +
           (3 * static_cast<std::uint64_t>(c) + static_cast<std::uint64_t>(j)) * 3 * static_cast<std::uint64_t>(rows);
  }
  std::uint64_t u_run(std::int32_t q) const {
    return first + 3 * static_cast<std::uint64_t>(q) * static_cast<std::uint64_t>(rows);
  }
  std::uint64_t v_run(std::int32_t q) const {
    return u_run(rank) + 3 * static_cast<std::uint64_t>(q) * static_cast<std::uint64_t>(columns);
  }

  // C of its r-th row node and c-th column node, row-major, m/N.
  void entry(ElementType type, const void* values, std::int32_t r, std::int32_t c, double out[9]) const {
    const auto at_row = 3 * static_cast<std::uint64_t>(r), at_column = 3 * static_cast<std::uint64_t>(c);
    for (int e = 0; e < 9; ++e) out[e] = 0;
    if (rank == 0) {
      for (unsigned j = 0; j < 3; ++j)
        for (unsigned i = 0; i < 3; ++i)
          out[3 * i + j] = scale * stored_number(type, values, dense_run(c, static_cast<int>(j)) + at_row + i);
      return;
    }
    for (std::int32_t q = 0; q < rank; ++q) {
      double u[3], v[3];
      for (unsigned i = 0; i < 3; ++i) u[i] = stored_number(type, values, u_run(q) + at_row + i);
      for (unsigned j = 0; j < 3; ++j) v[j] = stored_number(type, values, v_run(q) + at_column + j);
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) out[3 * i + j] += scale * u[i] * v[j];
    }
  }
};

inline ComplianceBlock placed_block(const StoredBlock& stored, const std::int32_t* cluster_ends, std::uint64_t first,
                                    float scale) {
  ComplianceBlock block;
  block.row = cluster_begin(cluster_ends, stored.row_begin);
  block.rows = cluster_ends[stored.row_end - 1] - block.row;
  block.column = cluster_begin(cluster_ends, stored.column_begin);
  block.columns = cluster_ends[stored.column_end - 1] - block.column;
  block.rank = stored.rank;
  block.first = first;
  block.scale = scale;
  return block;
}

}  // namespace palpate::formats
