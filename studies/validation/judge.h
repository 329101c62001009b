// Compares measured errors with a case's expectation.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "studies/validation/cases.h"

namespace palpate::validation {

inline constexpr double kOrderTolerance = 0.15;

struct Verdict {
  bool judged = false, holds = true;  // judged false: the report shows the error without a verdict
  double error = 0;                   // on the finest mesh; the largest if the answer should be exact
  std::optional<double> order;        // between the two finest meshes
  std::string sentence;               // the reason if it does not hold or is not judged
};

// levels[i] belongs to errors[i]; coarse to fine, at least one. finest_planned: false if the run left out the case's finest
// meshes. Then only exact answers are compared with their bounds; all other errors need only fall.
Verdict judge(const Expectation& expectation, const std::vector<int>& levels, const std::vector<double>& errors,
              bool finest_planned);

}  // namespace palpate::validation
