// What a fit has found: in words, as JSON, and as lines of organ.toml.
#pragma once

#include <string>
#include <vector>

#include "programs/fit/bundle_family.h"
#include "programs/fit/fit.h"
#include "programs/fit/measurements.h"

namespace palpate::fit {

struct FitReport {
  const Measurements& measurements;
  const BundleFamily& family;
  const StiffnessModel& model;
  const Fit& fit;
  Press press;
  FitOptions options;
  std::string source;  // of the measurements, in words; may be empty
};

// A basic string of TOML.
std::string quoted(const std::string& text);

struct Unit {
  double pascals;
  const char* name;
};
Unit unit_of(double pascals);

// "5.43 kPa", and "5.43 kPa, 95 % interval 5.12 to 5.78 kPa".
std::string modulus_text(double pascals);
std::string modulus_text(const Estimate& estimate);

// "Poisson's ratio", or "ratio of B to A" with the regions' names; and its estimate, out of the logarithm under ratio.
std::string parameter_name(const BundleFamily& family);
Estimate parameter_estimate(const FitReport& report);

// A table of lines for a terminal.
std::string summary_text(const FitReport& report);
// What the user should know before using the result, a sentence each.
std::vector<std::string> warnings_of(const FitReport& report);
std::string json_text(const FitReport& report);
// [[region]] tables with name, young and poisson, and their source.
std::string organ_lines(const FitReport& report);

}  // namespace palpate::fit
