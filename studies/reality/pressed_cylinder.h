// The force on a cylinder that is pressed, by the converged solution of large deformation.
#pragma once

#include <cstddef>
#include <vector>

#include "formats/organ_config.h"
#include "runtime/large/hyperelastic_body.h"

namespace palpate::reality {

enum class Press {
  sliding,   // between two plates without friction
  sticking,  // between two plates that hold its ends
  disc       // glued to a table, by a disc of half its radius that sticks to the middle of its top
};

struct CylinderTest {
  double radius, height;  // m
  double poisson;
  Press press;
  int cells;                          // along the radius
  Element element = Element::p1_anp;  // p1, p1-anp or p1-ang
  LawForm law = {};                   // over a shear modulus of 1 Pa
};

// Over the shear modulus, so that a curve serves every stiffness: force = shear x these.
struct PressedCylinder {
  std::size_t nodes = 0;
  std::vector<double> force;  // m^2, at each strain
  double slope = 0;           // m^2: force over strain near rest, as linear elasticity of the same mesh has it
};

// strains: depth over height, growing. Errors: std::runtime_error where a solve does not converge.
PressedCylinder press_cylinder(const CylinderTest& test, const std::vector<double>& strains);

}  // namespace palpate::reality
