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

// available_bytes: what each rank may take. asked: the user's number of ranks per operator; 0: the fewest that hold K and
// its multigrid levels, of the numbers that divide ranks; all of them where none does. Errors: InputError
// where the element adds nodes (p2-p0), whose rows are not divided.
GroupChoice choose_group(const ElasticBody& body, Element element, double available_bytes, int ranks, int asked);

// In the words of the plan: what a group of several will take. No time is predicted.
SolverPlan plan_of_group(const GroupChoice& choice, std::int64_t columns, double available_bytes, double bundle_bytes);

}  // namespace palpate
