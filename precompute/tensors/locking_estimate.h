// How much too stiff an element is on this very mesh, measured against p2-p0 on the same mesh.
#pragma once

#include <string>

#include "formats/organ_config.h"
#include "precompute/elements/elastic_body.h"

namespace palpate {

struct LockingEstimate {
  int probes = 0;  // 0: not measured, note says why
  double ratio =
      0;  // force(element) / force(p2-p0) for the same displacement, mean over the probes; above 1: too stiff
  double bytes = 0;  // predicted memory of the reference's factor, beyond what the process held
  std::string note;  // empty where it is measured
};

// A probe is a patch: a touchable node and its touchable neighbours, under a uniform load. What is compared is the
// trace of the patch's compliance (its mean displacement per force, over the free dofs) with p2-p0 and with the
// element. The patches are spread along the longest side of the body. The ratio is above 1 where the element locks, and
// where the mesh is coarse. The same input gives the same bits. Cost: p2-p0 has about eight times the unknowns; two
// factors, three columns a probe. most_bytes: what the factor of p2-p0 may take. Errors: OperationError where it would
// take more.
LockingEstimate estimate_locking(const ElasticBody& body, Element element, int probes, double most_bytes);

// What the bundle says where nobody asked.
LockingEstimate locking_not_asked_for();

}  // namespace palpate
