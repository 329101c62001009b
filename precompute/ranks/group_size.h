// How many ranks share one operator, decided from the size of the mesh before anything is assembled.
#pragma once

#include "formats/organ_config.h"
#include "precompute/elements/elastic_body.h"
#include "precompute/solver/solver_plan.h"

namespace palpate {

struct GroupChoice {
  int ranks_per_operator = 1;
  bool factor = true;       // in a group of several: MUMPS's factor fits, else PETSc's gamg
  double factor_bytes = 0;  // of each rank
  double gamg_bytes = 0;
};

// available_bytes: what each rank may take. asked: the number of ranks per operator that the user wants; 0: the smallest
// number that divides ranks and whose memory holds K and its multigrid levels, or all ranks where none is large enough.
// Errors: InputError where the element adds nodes (p2-p0), whose rows cannot be divided.
GroupChoice choose_group(const ElasticBody& body, Element element, double available_bytes, int ranks, int asked);

// The plan of a group of several ranks: the memory that it will take. No time is predicted.
SolverPlan plan_of_group(const GroupChoice& choice, std::int64_t columns, double available_bytes, double bundle_bytes);

}  // namespace palpate
