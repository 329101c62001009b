// How much too stiff an element is on this very mesh, measured against p2-p0 where that is cheap.
#pragma once

#include <string>

#include "formats/organ_config.h"
#include "precompute/elements/elastic_body.h"

namespace palpate {

struct LockingRequest {
  int probes = 3;            // 0: none
  bool at_any_cost = false;  // else the reference must take at most most_operations
  double most_bytes = 0;     // that the reference may take
  double most_operations = 0;
  double own_factor_operations = 0;  // of the element's factor on this mesh; 0: not known
};

struct LockingEstimate {
  int probes = 0;  // 0: not measured, note says why
  double ratio =
      0;  // mean over the probes of force(element) / force(p2-p0) for the same displacement; above 1: too stiff
  double bytes = 0;  // predicted, beyond what the process held
  std::string note;  // empty where measured
};

// Each probe is a patch, a touchable node and its touchable neighbours, pushed by a uniform load: the trace of its
// compliance (mean displacement per force, over the free dofs), p2-p0's over the element's. The probes are spread along
// the body's longest side. What is measured is the error of the mesh and of locking together. Same input, same bits;
// whether it is measured hangs on the request and on counts, never on clocks or free memory. p2-p0 has about eight times
// the unknowns: two factors, and three columns a probe. Errors: OperationError where at_any_cost needs more than
// most_bytes.
LockingEstimate estimate_locking(const ElasticBody& body, Element element, const LockingRequest& request);

// What is not asked for stays within: bytes where no limit is given, a quarter of it where one is; operations of some
// seconds, or half of run_operations.
double locking_bytes(double memory_gigabytes);
double locking_operations(double run_operations);

}  // namespace palpate
