// The bundles of a fit: one, or several of one body whose materials differ in Poisson's ratio or in the ratio of two moduli.
#pragma once

#include <string>
#include <vector>

#include "programs/fit/presses.h"
#include "programs/fit/stiffness_model.h"

namespace palpate::fit {

enum class Parameter { none, poisson, ratio };

struct BundleFamily {
  Parameter parameter = Parameter::none;
  std::vector<std::string> files;  // of the bundles, by ascending parameter
  std::vector<double> values;  // of the parameter: none has one 0; poisson; ratio: the logarithm of the moduli's ratio
  std::vector<Region>
      regions;               // of the first bundle; the modulus of the first region is fitted, and the others follow it
  std::vector<bool> varied;  // [region] under poisson: it has the fitted ratio; under ratio: its modulus varies
  std::vector<std::vector<double>> stiffness;  // [bundle][spot] over the first region's modulus, m
  bool soft_supports = false;                  // foundations or springs, whose stiffness does not scale with the moduli
  std::vector<std::string> warnings;
  double plate_height = 0;  // m
  double linear_limit = 0;  // m: the least that a bundle states; 0: none does

  // A region's modulus over the first region's, where the bundles do not vary it.
  double relative_young(std::size_t region) const { return regions[region].young / regions[0].young; }
};

// Opens the bundles, finds out in what they differ, and presses all spots on each. Errors: InputError where the bundles are not of
// one body, have the same materials, or differ in more than one parameter.
BundleFamily press_bundles(const std::vector<std::filesystem::path>& files, const Measurements& measurements,
                           Press press);

}  // namespace palpate::fit
