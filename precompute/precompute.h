// Tetrahedra -> tensors -> bundle: the whole of palpate-precompute after its command line.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "precompute/elastic_body.h"
#include "precompute/ranks.h"
#include "precompute/stop_signals.h"

namespace palpate {

struct PrecomputeOptions {
  std::filesystem::path mesh, organ, boundary, bundle;
  std::filesystem::path image;  // for its hash only; may be empty
  double memory_gigabytes = 0;  // what this machine's ranks may take together; 0: what is free
  double tolerance = 1e-9;      // on each column's true relative residual
  int columns_at_a_time = 0;    // 0: 96 with a factor, 32 with multigrid
  std::string json;             // where the report goes as JSON; "-": standard output; empty: nowhere
};

// Collective. A PetscSession must be alive. Resumes where a part of the same run lies beside the bundle. Errors: InputError,
// OperationError; no bundle is left then, and of the part only what a rerun resumes from.
void precompute(const PrecomputeOptions& options, Ranks& ranks, StopSignals& signals);

// The tensors of a few nodes, solved anew by one process: what a bundle must hold. Needs a PetscSession. body.touchable
// and body.triangles are not used. Errors: InputError (a node without a free dof), OperationError.
struct NodeTensor {
  std::int32_t node;
  std::array<double, 9> force;       // T^f, row-major, N/m
  std::vector<double> displacement;  // T^u, [3][N][3]: row j is the displacement of all nodes for a unit of dof j
  double residual;                   // largest true relative residual of its columns
};
std::vector<NodeTensor> solve_node_tensors(const ElasticBody& body, std::span<const std::int32_t> nodes,
                                           double tolerance = 1e-9);

}  // namespace palpate
