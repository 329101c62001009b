// palpate-accuracy choose: prints the cheapest measured setting within limits, and writes the files that bake it.
// palpate-accuracy check: measures a bundle that was baked with those files, and compares with its certificate.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "studies/accuracy/choose.h"
#include "studies/accuracy/organ_case.h"

namespace palpate::accuracy {

struct ChooseOptions {
  std::filesystem::path study;  // the study's folder; empty: the only study below DATA
  std::filesystem::path data, source, output;
  std::vector<Limit> limits;
  std::string least = "precompute_s";
  double depth_mm = 0;  // of the deepest push; 0: not said, and the deformation stays linear
};
// Prints the setting, and with a depth the cheapest deformation (linear, response, large) whose error there is within the limits of
// force and field, 5 % where there is none. If output is given, writes there organ.toml, effects.toml, measured.json (for the bundle's
// certificate) and bake.sh, which makes bundle.h5. Errors: InputError; VerificationError that names the limit to relax.
void choose(const ChooseOptions& options);

struct CheckOptions {
  std::filesystem::path bundle, study, data;
};
// Presses the bundle at the study's sites and compares with the reference. Errors: VerificationError if an error exceeds
// the one that the bundle's certificate states; InputError if the certificate states none or names another reference.
void check(const CheckOptions& options);

}  // namespace palpate::accuracy
