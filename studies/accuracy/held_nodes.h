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

// How the organ answers: by superposition; corrected by P and Q; as the hyperelastic body.
enum class HeldModel { linear, response, large };

// The nodes move together, all three dofs of each, at 0.1 m/s with a touch each millisecond.
struct HeldPath {
  std::vector<HeldAnswer> at;                            // for each depth
  double touch_us = 0, touch_us_most = 0, shape_us = 0;  // median; 99 %
  double scene_bytes = 0;                                // memory that the scene takes
};
// depths: m, growing. Errors: OperationError if a touch raises a flag, but that P or Q leave their range and that the body lags behind.
HeldPath move_nodes(const std::filesystem::path& bundle, std::span<const std::int32_t> nodes, Vec3 direction,
                    std::span<const double> depths, HeldModel model);

}  // namespace palpate::accuracy
