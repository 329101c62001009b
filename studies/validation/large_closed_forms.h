// Closed-form solutions of large deformation. SI units.
#pragma once

#include "precompute/elements/elastic_body.h"
#include "studies/hyperelastic/large_body.h"

namespace palpate::validation {

// The laws of runtime/large, written down a second time: energies of a unit volume under principal stretches.
enum class LargeLaw {
  compressible,  // mu/2 (I - 3) - mu ln J + lambda/2 (ln J)^2
  split          // an isochoric law + kappa/2 (J - 1)^2
};

// A bar stretched by `stretch` along its axis, its sides free. Uniform strain; the width's stretch makes the stress on the sides zero.
struct StretchedBar {
  LargeLaw law;
  Material material;
  double stretch;
  LawForm form = {};  // of the split law

  double width() const;   // stretch across the axis
  double stress() const;  // nominal, Pa: force over the area at rest
};

// A block sheared by an amount gamma: x moves by gamma y. The volume stays. Ogden, Non-linear Elastic Deformations, 1984, section 2.2.
struct ShearedBlock {
  LargeLaw law;
  Material material;
  double gamma;
  LawForm form = {};

  double shear_stress() const;   // nominal, along x on the plane across y
  double normal_stress() const;  // nominal, along y on that plane: Poynting's effect
};

// An incompressible neo-Hookean cylinder whose ends are twisted against one another at constant length, `twist` rad/m. Rivlin 1949,
// Phil. Trans. R. Soc. A 242, 173-195: the torque is pi/2 mu psi R^4, the axial force -pi/4 mu psi^2 R^4 (it pushes the ends apart).
struct TwistedCylinder {
  double radius, twist, shear;

  double torque() const;
  double axial_force() const;
};

// A cantilever that bends far under a force P at its end which keeps its direction: Euler's elastica, without stretch and shear.
// alpha = P L^2 / (E I). Mattiasson 1981, Int. J. Numer. Meth. Eng. 17, 145-153, gives its numbers.
struct Elastica {
  double alpha;

  struct Tip {
    double down, back;  // over L
  };
  Tip tip() const;
};

}  // namespace palpate::validation
