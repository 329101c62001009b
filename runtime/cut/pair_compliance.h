// Where the compliance of the uncut body comes from.
#pragma once

#include <cstddef>
#include <cstdint>

#include "runtime/bundle/tensors.h"

namespace palpate {

class PairCompliance {
 public:
  // read(node, others, count, rows, stride): rows[i * stride + 3 k + j], i and j from 0 to 2, is the displacement along i of `node` for a unit
  // force along j on others[k], m/N; zero where a dof is held. False where the pair is not known. All are nodes of the body at rest.
  virtual bool read(std::int32_t, const std::int32_t*, std::int32_t, double*, std::size_t) const { return false; }

 protected:
  ~PairCompliance() = default;
};

// Of the bundle's tensors: nodes that may be touched and those of the corridor. Cost: as Tensors::displacement, for each pair.
class TensorPairs final : public PairCompliance {
 public:
  // tensors, column_of_node ([nodes], -1: none): borrowed.
  TensorPairs(const Tensors& tensors, const std::int32_t* column_of_node)
      : tensors_(tensors), column_of_node_(column_of_node) {}
  bool read(std::int32_t node, const std::int32_t* others, std::int32_t count, double* rows,
            std::size_t stride) const override;

 private:
  const Tensors& tensors_;
  const std::int32_t* column_of_node_;
};

}  // namespace palpate
