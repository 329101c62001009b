// Imposes displacements on surface nodes of a bundle through the runtime, without collision and without contact laws.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "runtime/base/vec3.h"

namespace palpate::accuracy {

struct HeldAnswer {
  std::vector<Vec3> u;  // of the surface, m
  Vec3 force;           // on the organ, N: the sum over the nodes
};

// All three dofs of each node are imposed; displacement[i], m, belongs to nodes[i]. Errors: OperationError if the step
// raises a flag.
HeldAnswer hold_nodes(const std::filesystem::path& bundle, std::span<const std::int32_t> nodes,
                      std::span<const Vec3> displacement);

}  // namespace palpate::accuracy
