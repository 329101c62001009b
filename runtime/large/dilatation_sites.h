// Where p1-anp averages the change of volume: a site for each node and each region that meets there.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/large/hyperelastic_body.h"

namespace palpate {

struct DilatationSites {
  std::int32_t count = 0;
  std::int32_t* of_corner = nullptr;  // [tetrahedron_count][4]
  std::int32_t* region = nullptr;     // [count]
  double* volume = nullptr;           // [count] m^3, V_nm
};
// False where memory ends.
bool find_dilatation_sites(SceneMemory& memory, const HyperelasticBody& body, DilatationSites* sites);

}  // namespace palpate
