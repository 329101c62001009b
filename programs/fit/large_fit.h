// Fits a law of large strain to measured curves, and predicts those that are held out.
#pragma once

#include <string>
#include <vector>

#include "programs/fit/curve_fit.h"
#include "programs/fit/large_press.h"

namespace palpate::fit {

struct LargeOptions {
  CurveOptions curves;
  std::vector<std::string> holdout;  // names of specimens, or of places where the file has no specimens
};

// A unit that was not fitted: the predicted force over the measured one, less 1.
struct HeldOut {
  std::string name;
  int rows = 0;
  double median = 0, residual = 0;    // of the absolute values; root mean square
  double worst = 0, worst_depth = 0;  // with its sign; m
  double own_shear = 0;               // Pa: the modulus that its rows ask for, with the fitted constants
};

struct LargeFit {
  CurveFit curve;
  bool of_specimens = false;       // units are specimens; else places
  std::vector<std::string> units;  // that were fitted
  std::vector<int> unit_rows;
  std::vector<HeldOut> held_out;
  HeldOut held_out_in_all;
  std::vector<double> force;     // [row] N, fitted or predicted
  std::vector<bool> fitted;      // [row]
  std::vector<int> unit_of_row;  // over units, then those that are held out
  double deepest = 0;            // strain
  int fewest_touched = 0;        // by a ball
  std::vector<Region> regions;   // of the bundle
  bool soft_supports = false;
};

// Errors: InputError where a name of holdout is unknown, or nothing is left to fit; as those of LargePress and fit_curves.
LargeFit fit_large(PressedBundle& bundle, const Measurements& measurements, Press press, const LawFamily& family,
                   const LargeOptions& options);

}  // namespace palpate::fit
