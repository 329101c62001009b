// A neo-Hookean beam, clamped at one end, that sags under its own weight and under loads at its free end.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "formats/organ_config.h"

namespace palpate::reality {

struct BeamTest {
  std::array<double, 3> size;  // length, width, height, m; the height stands upright
  double density, gravity;     // kg/m3, m/s2
  double poisson;
  std::vector<double> loads;  // N, each hangs on the upper edge of the free end
  double sag;                 // m, measured under the own weight: Young's modulus follows from it
  double above, beyond;  // m, the point that sags by it: above the base and beyond the free end, as part of the end
  int cells;             // through the height
};

// How the free end moves as a rigid body, in the upright plane of symmetry: it turns about the middle of its base line and shifts.
struct EndMotion {
  double along, down, turn;  // m, m, rad
};

struct LoadedBeam {
  std::size_t nodes = 0;
  double young = 0;              // Pa
  std::vector<EndMotion> moved;  // under the own weight; then under it and each load
};

// By the converged solution of large deformation, p1, p1-anp or p1-ang. Errors: std::runtime_error where a solve does not converge.
LoadedBeam load_beam(const BeamTest& test, Element element);

// By linear elasticity, any element. A PetscSession must be alive.
LoadedBeam load_beam_linearly(const BeamTest& test, Element element);

}  // namespace palpate::reality
