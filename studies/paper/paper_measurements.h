// Repeats the paper's measurements. Each function returns JSON for studies/paper/study.py.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "studies/paper/correction.h"
#include "studies/peers/push.h"

namespace palpate::studies {

using Json = nlohmann::ordered_json;

// Tolerance of the iterative solves, relative to the right-hand side. The paper states none; this is our choice.
constexpr double kTolerance = 1e-6;

// The preprocessing as in the paper: one constrained solve for each dof of each touchable node, with conjugate gradients from
// zero and a Jacobi preconditioner. Solves a sample of the touchable nodes, at least one, for `seconds`, and extrapolates to
// all. The time to set up a node's matrix is not counted.
Json measure_columns(const Push& push, double seconds);

// Table 1 and the collision rates. Compares a full constrained solve for every move, a kept factor, and touch and shape: with
// linear elasticity, with the correction, and with the contact at another node in every move.
Json measure_moves(const Push& push, const Correction& correction, const std::string& bundle, double seconds);

// Figure 10: grips at the touchable nodes nearest to these points (m). Compares the displacement under all grips together
// with the sum of the displacements under each grip alone.
Json measure_superposition(const std::string& bundle, const std::vector<Eigen::Vector3d>& points,
                           const Eigen::Vector3d& displacement);

}  // namespace palpate::studies
