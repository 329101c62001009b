// The base of a cut's compliance: a body whose compliance is known at all nodes of the surface that move. At first that is the uncut body of the bundle's
// tensors. Re-basing (cut_rebase.h) makes what the cut has added so far a part of it:
//     B = C + A,    A: added, dense; B is the C of cut_compliance.h from then on.
#pragma once

#include <cstddef>
#include <cstdint>

#include "runtime/cut/cut_tissue.h"
#include "runtime/cut/pair_compliance.h"

namespace palpate {

// Numbers of a base for the nodes that it may have: those with columns, in their order, and then new ones.
struct BaseNumbers {
  std::int32_t* of_node = nullptr;  // [surface nodes] -1: the node does not move
  std::int32_t* node = nullptr;     // [most] surface node
  std::int32_t columns = 0, most = 0;
};

struct CutBase {
  std::int32_t count = 0;   // numbers in use
  std::size_t stride = 0;   // of a row
  double* added = nullptr;  // [3 most][stride] m/N, symmetric
  float* moved =
      nullptr;  // [loads][stride] m: what the cut adds to the displacement by each row of the offset, per unit, and by the preload
  LoadShare* share = nullptr;  // [nodes of the compliance] of the loads, that the nodes have in the base
  Vec3 moved_by(std::int32_t load, std::int32_t number) const {
    const float* const u = moved + static_cast<std::size_t>(load) * stride + 3 * static_cast<std::size_t>(number);
    return {static_cast<double>(u[0]), static_cast<double>(u[1]), static_cast<double>(u[2])};
  }
  const double* row(std::int32_t number, int axis) const {
    return added + (3 * static_cast<std::size_t>(number) + static_cast<std::size_t>(axis)) * stride;
  }
};

// Of a base: the bundle's pairs, and what is added to them.
class BasePairs final : public PairCompliance {
 public:
  // All borrowed. tissue: has all nodes of the base. first_reserve: surface node of the first new node. Memory: 4 bytes for each of `most` nodes that
  // are asked for at once.
  bool create(SceneMemory& memory, const PairCompliance& uncut, const CutTissue& tissue, const CutBase& base,
              const BaseNumbers& numbers, std::int32_t first_reserve, std::int32_t most);
  bool read(std::int32_t node, const std::int32_t* others, std::int32_t count, double* rows,
            std::size_t stride) const override;

 private:
  std::int32_t number(std::int32_t node) const;

  const PairCompliance* uncut_ = nullptr;
  const CutTissue* tissue_ = nullptr;
  const CutBase* base_ = nullptr;
  const std::int32_t* number_of_node_ = nullptr;
  std::int32_t first_reserve_ = 0, most_ = 0;
  std::int32_t* origin_ = nullptr;  // [most] scratch
};

}  // namespace palpate
