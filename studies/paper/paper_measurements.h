// What the paper measured, measured here; each as JSON for studies/paper/study.py.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/peers/push.h"
#include "studies/paper/correction.h"

namespace palpate::bench {

using Json = nlohmann::ordered_json;

// Of the residual relative to the right-hand side: our choice for what the paper did.
constexpr double kTolerance = 1e-6;

// The preprocessing as the paper did it: a constrained solve for each dof of each touchable node, by conjugate gradients
// from zero with a Jacobi preconditioner. Nodes spread over the touchable ones are solved until the time is up, at least
// one; what a node's matrix takes to set up is not counted.
Json measure_columns(const Push& push, double seconds);

// Table 1 and the collision rates: every move answered by a full constrained solve, by a factor that is kept, and by touch
// and shape; linear and with the correction; and with the contact at another node in every move.
Json measure_moves(const Push& push, const Correction& correction, const std::string& bundle, double seconds);

// Figure 10: grips at the touchable nodes nearest to these points (m) displaced together, against the sum of what each
// does alone.
Json measure_superposition(const std::string& bundle, const std::vector<Eigen::Vector3d>& points,
                           const Eigen::Vector3d& displacement);

}  // namespace palpate::bench
