// The certificate of a bundle: how good its columns are, from the records of all batches.
#pragma once

#include <cstdint>
#include <span>

#include "precompute/journal/batch_record.h"
#include "precompute/tensors/element_excess.h"

namespace palpate {

struct Certificate {
  double worst_residual = 0;
  double residual_floor =
      0;  // 0, or where columns miss the tolerance, what double precision allows: epsilon ||K|| ||x||
  std::int64_t worst_node = -1, worst_dof = 0;  // node of the bundle; the first of equals
  std::int64_t most_iterations = 0;
  double reciprocity_error = 0;  // largest |C_nk - C_kn^T| / |C_nk| over pairs of nodes far apart; Frobenius norm
  std::int64_t reciprocity_pairs = 0;
  double cast_error = 0;  // largest ||T stored - T solved|| / ||T solved|| of a column
  double preload_residual = 0;
  double reciprocal_condition = 0;  // of the stiffness, about; 0 where the solver tells none
  ElementExcess element;            // how much too stiff the element itself is
};

// records: one for each batch. Fills sample. The caller fills in the members from preload_residual on.
Certificate certify(std::span<const ColumnBatch> batches, std::span<const BatchRecord> records,
                    ReciprocitySample& sample);

}  // namespace palpate
