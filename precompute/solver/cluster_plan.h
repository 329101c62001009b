// Predicts what machines of a cluster would take for a mesh, or for a number of vertices alone: memory, time, network and bytes of
// each solver.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "formats/organ_config.h"
#include "precompute/solver/solver_estimate.h"

namespace palpate {

struct ClusterRequest {
  int ranks = 1;  // in all
  int ranks_per_machine = 1;
  double machine_bytes = 0;  // memory of each machine
};

// One solver on these machines.
struct ClusterEstimate {
  std::string solver;        // "factor", "factor in single precision", "multigrid"
  double machine_bytes = 0;  // that its ranks take on one machine, at the peak
  bool fits = false;
  double setup_seconds = 0, column_seconds = 0;  // of one rank, with its neighbours at work
  double seconds = 0;                            // set-up and columns, the slowest rank
};

struct ClusterPlan {
  ClusterRequest request;
  int machines = 1;
  SolveSize size;
  double bundle_bytes = 0;   // with every column in f32
  double packed_bytes = 0;   // of --low-rank 1e-3
  double network_bytes = 0;  // in all: the mesh to each machine, the columns to the file
  std::vector<ClusterEstimate> solvers;
  int chosen = -1;  // the fastest that fits; -1: none does
};

// The size of a solve by the laws of growth that docs/scaling.md fits to the liver of 563 to 98,373 vertices (p2-p0: to 10,500). touchable:
// nodes that may be touched; 0: all surface nodes, by the law of the liver's surface.
SolveSize size_of_vertices(double vertices, Element element, double touchable, double flops_per_second);
double surface_nodes_of(double vertices);  // 2.45 n^(3/4)

// bundle_bytes: 0: the displacements of the surface alone, in f32.
ClusterPlan plan_cluster(const SolveSize& size, const ClusterRequest& request, double bundle_bytes = 0);

std::string cluster_text(const ClusterPlan& plan);
nlohmann::json cluster_json(const ClusterPlan& plan);

}  // namespace palpate
