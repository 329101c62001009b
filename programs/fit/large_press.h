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

  // [form][row] m^2, the force over the first region's shear modulus, where all regions have this law over their moduli. The moduli keep their
  // ratios to one another and to the soft supports. Solutions begin at those of the last call, and those of the other forms, which should lie near
  // the first one, at those of the first one; a form without a solution has no rows. Errors: OperationError where the first form has none. The
  // curves are solved on all cores.
  std::vector<Eigen::VectorXd> forces(const std::vector<LawForm>& forms) const;

  // Nodes that the ball touched at its deepest row, the fewest of all curves; 0: no ball.
  int fewest_touched() const { return fewest_touched_; }

 private:
  struct Way;   // what is held and which rows there are
  struct Body;  // with a law
  struct State {
    Eigen::VectorXd u;
    std::vector<std::int32_t> touched;  // by a ball
  };
  Way way_of(const PressedCurve& curve, const HeldDisc* disc) const;
  double press(const Way& way, const Body& body, double depth, double from, State* state) const;
  double press_on(const Way& way, const PressedCurve& curve, const Body& body, double depth, double from,
                  State* state) const;
  std::vector<std::vector<double>> solve(std::size_t c, const std::vector<LawForm>& forms, int* touched) const;
  Eigen::VectorXd at_rows(const std::vector<std::vector<std::vector<double>>>& found, std::size_t form) const;

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
  std::vector<HeldDisc> discs_;                   // [curve]; none under a plate
  std::vector<double> supports_;                  // over the shear modulus, m
  mutable std::vector<std::vector<State>> kept_;  // [curve][solved depth] of the last call
  mutable int fewest_touched_ = 0;
};

}  // namespace palpate::fit
