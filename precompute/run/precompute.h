// Tetrahedra -> tensors -> bundle: the whole of palpate-precompute after its command line.
#pragma once

#include <filesystem>
#include <string>

#include "formats/bundle_layout.h"
#include "precompute/ranks/ranks.h"
#include "precompute/run/stop_signals.h"

namespace palpate {

struct PrecomputeOptions {
  std::filesystem::path mesh, organ, boundary, bundle;
  std::filesystem::path image;  // for its hash only; may be empty
  double memory_gigabytes = 0;  // what this machine's ranks may take together; 0: what is free
  double tolerance = 1e-9;      // on each column's true relative residual
  int ranks_per_operator = 0;   // 0: the fewest whose memory holds the operator
  int columns_at_a_time = 0;    // 0: 96 with a factor, 32 with multigrid
  formats::ElementType store = formats::ElementType::f32;  // of the displacements: f32 or f64
  int locking_probes = 0;  // patches of the surface where the element is compared with p2-p0; 0: none
  bool plan_only = false;  // tell what the run would take, and write nothing; bundle may be empty
  std::string json;        // where the report goes as JSON; "-": standard output; empty: nowhere
};

// Collective. A PetscSession must be alive. Resumes where a part of the same run lies beside the bundle. Errors: InputError,
// OperationError; no bundle is left then, and of the part only what a rerun resumes from.
void precompute(const PrecomputeOptions& options, Ranks& ranks, StopSignals& signals);

}  // namespace palpate
