// palpate-accuracy choose: answers with the cheapest measured setting within limits, and writes what it takes to bake it.
// palpate-accuracy check: measures a bundle that was baked so anew.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "studies/accuracy/choose.h"
#include "studies/accuracy/organ_case.h"

namespace palpate::accuracy {

struct ChooseOptions {
  std::filesystem::path study;  // the study's folder; empty: the only one below DATA
  std::filesystem::path data, source, output;
  std::vector<Limit> limits;
  std::string least = "precompute_s";
};
// Prints the answer. With output: organ.toml, effects.toml, measured.json for the bundle's certificate and bake.sh, which
// makes bundle.h5 there. Errors: InputError; VerificationError that says what stands in the way.
void choose(const ChooseOptions& options);

struct CheckOptions {
  std::filesystem::path bundle, study, data;
};
// Presses the bundle at the study's places and compares with the reference. Errors: VerificationError when an error is
// above the one that its certificate states, InputError when it states none or the study is not its own.
void check(const CheckOptions& options);

}  // namespace palpate::accuracy
