// What a fit under large strain has found: in words, as JSON, and as lines of organ.toml.
#pragma once

#include <string>
#include <vector>

#include "programs/fit/large_fit.h"
#include "programs/fit/measurements.h"

namespace palpate::fit {

struct LargeReport {
  const Measurements& measurements;
  std::string bundle;
  const LawFamily& family;
  const LargeFit& fit;
  Press press;
  LargeOptions options;
  std::string source;  // of the measurements, in words; may be empty
};

std::string summary_text(const LargeReport& report);
std::vector<std::string> warnings_of(const LargeReport& report);
std::string json_text(const LargeReport& report);
std::string organ_lines(const LargeReport& report);

}  // namespace palpate::fit
