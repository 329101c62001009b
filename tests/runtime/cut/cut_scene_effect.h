// An effect of tests alone: the body of the scene is a CutOrgan of parts that the test has made.
#pragma once

#include "runtime/cut/cut_organ.h"
#include "runtime/include/palpate/palpate.h"
#include "runtime/scene/scene.h"

extern "C" {
struct palpate_test_cut_def {
  palpate_part part;
  std::int32_t on;
  std::int32_t reserved;
};
}

namespace palpate::tests {

// What the effect takes, of the scene that is made next, and what it has made.
struct CutMaking {
  CutOrgan::Parts parts;
  OffsetRows rows;  // count 0: none
  CutOrgan* organ = nullptr;
  double* amount = nullptr;  // of the row in each step
  palpate_scene* scene = nullptr;
};
CutMaking& cut_making();
palpate_test_cut_def switched_on();

}  // namespace palpate::tests
