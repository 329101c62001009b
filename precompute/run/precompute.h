// What palpate-precompute does after its command line is read: tetrahedra -> tensors -> bundle.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "formats/bundle_layout.h"
#include "formats/organ_config.h"
#include "precompute/ranks/ranks.h"
#include "precompute/run/stop_signals.h"

namespace palpate {

struct PrecomputeOptions {
  std::filesystem::path mesh, organ, boundary, bundle;
  std::filesystem::path image;  // its hash is recorded, and `label` selectors read it; may be empty
  double memory_gigabytes = 0;  // that all ranks on one machine may take together, GB (1e9 bytes); 0: what is free
  double tolerance = 1e-9;      // on the true relative residual of each column
  int ranks_per_operator = 0;   // 0: the fewest whose memory holds the operator
  int columns_at_a_time = 0;    // 0: 96 with a factor, 32 with multigrid
  formats::ElementType store = formats::ElementType::f32;  // of the displacements: f64, f32 or f16
  std::optional<double>
      low_rank;           // store the surface's compliance in blocks, with at most this relative error of a column
  bool interior = false;  // store the displacement of the nodes inside the organ
  bool large_deformation = false;  // store what large deformation needs (runtime/large)
  bool element_stiffness = false;  // measure the element's own stiffness also where that takes over a tenth of the run
  bool plan_only = false;          // tell what the run would take, and write nothing; bundle may be empty
  std::string json;                // where the report goes as JSON; "-": standard output; empty: nowhere
};

// Collective: all ranks call it with the same options. A PetscSession must be alive. Resumes an earlier run of the same
// input and options that was killed or failed. Errors: InputError, OperationError. After an error there is no bundle,
// and a part and a journal only where a rerun can resume from them. With low_rank or f16 the solved columns stand in the part, on the
// disk, until all of them are there; then the part is packed as palpate-bundle pack does it.
void precompute(const PrecomputeOptions& options, Ranks& ranks, StopSignals& signals);

}  // namespace palpate
