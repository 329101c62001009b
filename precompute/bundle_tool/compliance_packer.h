// Tensor columns -> the compliance in blocks: a spatial tree of clusters, dense blocks where clusters are near, low rank
// elsewhere, each block once for both sides.
//
// C is a Green's function: between clusters that are apart it is smooth, and the rank for a given error hardly grows with
// the number of nodes (Hackbusch, A sparse matrix arithmetic based on H-matrices, Computing 62, 1999; Bebendorf,
// Approximation of boundary element matrices, Numer. Math. 86, 2000, for the cross approximation).
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "formats/bundle_layout.h"
#include "formats/compliance_blocks.h"

namespace palpate {

struct CompliancePackOptions {
  formats::ElementType type = formats::ElementType::f32;  // f32 or f16
  // Bound on each column's relative error (2-norm over the surface) from low rank; none: every block is dense.
  std::optional<double> low_rank;
};

// What is asked of the source, by surface node and touchable column.
struct ComplianceSource {
  std::int32_t surface_nodes = 0;
  std::vector<double> position;         // [Ns][3]
  std::vector<std::int32_t> touchable;  // ascending surface nodes
  std::vector<double> force;            // [S][3][3] T^f
  std::vector<float> compliance;        // [S][3][Ns][3] m/N: row [k, j] is C e of dof j of column k
};

// The sections tensors/compliance/*.
struct PackedCompliance {
  std::vector<std::int32_t> nodes, cluster_ends, blocks;
  std::vector<float> scale;
  std::vector<char> values;
  std::size_t low_rank_blocks = 0, dense_blocks = 0;
  std::size_t apart_but_dense = 0;  // far enough apart for low rank, which would have been larger than dense
  std::int32_t largest_rank = 0;
};

// source.compliance is brought into cluster order in place. Deterministic. Cost: each far block's numbers times its rank.
PackedCompliance pack_compliance(ComplianceSource& source, const CompliancePackOptions& options);

// Power of two s with the largest |number| / s just below 2^15, so that halves keep 11 bits down to 2^-29 of it.
float half_scale(double largest);

}  // namespace palpate
