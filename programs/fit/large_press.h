// Presses a body under large strain: the force on the indenter at each measured depth, by the converged solution of the studies
// (studies/hyperelastic).
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "programs/fit/presses.h"
#include "runtime/large/hyperelastic_body.h"

namespace palpate::fit {

// How a curve is pressed: the rows of one place and one indenter.
struct PressedCurve {
  Spot spot;                   // of its first row
  std::vector<double> depths;  // m, ascending, those of its rows
  double scale = 0;  // m: the body's height under a plate, else the indenter's radius; depth over it is called strain
  std::vector<int> rows;
  std::vector<int> depth_of_row;
};

class LargePress {
 public:
  // The bundle and the measurements are borrowed. Errors: InputError where the bundle's element has no large deformation, where its
  // soft supports are not stored, or where a spot cannot be pressed.
  LargePress(PressedBundle& bundle, const Measurements& measurements, Press press);

  const std::vector<PressedCurve>& curves() const { return curves_; }

  // [row] m^2, the force over the first region's shear modulus, where all regions have this law over their moduli. The moduli keep their
  // ratios to one another and to the soft supports. Errors: OperationError where a solution is not found. The curves are solved on all cores.
  Eigen::VectorXd forces(const LawForm& form) const;

  // Nodes that the ball touched at its deepest row, the fewest of all curves; 0: no ball.
  int fewest_touched() const { return fewest_touched_; }

 private:
  struct Way;  // what is held and which rows there are
  Way way_of(const PressedCurve& curve, const HeldDisc* disc) const;
  std::vector<double> solve(const Way& way, const PressedCurve& curve, const LawForm& form, int* touched) const;

  const Measurements& data_;
  Press press_;
  BundleBody body_;
  std::vector<Region> regions_;
  double shear_ = 0;  // Pa, of the first region
  std::string file_;
  std::vector<std::int32_t> pressed_;  // plate: the nodes
  int axis_ = 0;
  double sign_ = 1;
  std::vector<PressedCurve> curves_;
  std::vector<HeldDisc> discs_;   // [curve]; none under a plate
  std::vector<double> supports_;  // over the shear modulus, m
  mutable int fewest_touched_ = 0;
};

}  // namespace palpate::fit
