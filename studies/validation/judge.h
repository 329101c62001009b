// Measured errors against what a case promises.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "studies/validation/cases.h"

namespace palpate::validation {

inline constexpr double kOrderTolerance = 0.15;

struct Verdict {
  bool judged = false, holds = true;  // not judged: shown only
  double error = 0;                   // on the finest mesh; of exact answers, the largest
  std::optional<double> order;        // between the two finest meshes, h going with 1 / level
  std::string sentence;               // why it does not hold, or is not judged; else empty
};

// levels and errors: beside one another, at least one, coarse to fine. finest_planned: false where the case's finest meshes were
// left out; then exact answers are held to their bounds and the others have only to fall.
Verdict judge(const Expectation& expectation, const std::vector<int>& levels, const std::vector<double>& errors,
              bool finest_planned);

}  // namespace palpate::validation
