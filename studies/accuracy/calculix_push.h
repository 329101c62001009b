// A disc of nodes pushed deep into a body, solved by CalculiX with large strain: an independent solution of the discrete problem.
#pragma once

#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "precompute/elements/elastic_body.h"
#include "studies/accuracy/sites.h"

namespace palpate::accuracy {

// Surface nodes that move together along one direction.
struct DeepPush {
  Vec3 inward;
  std::vector<std::int32_t> nodes;
};
// The nodes under the disc, at least the nearest three; none that is held.
DeepPush push_at(const ElasticBody& body, const TouchSite& site, double radius);

// One depth of the push.
struct PushedState {
  std::vector<Vec3> u;  // of the surface, m
  Vec3 force;           // on the pushed nodes, N
};

// *HYPERELASTIC, NEO HOOKE: mu/2 (J^(-2/3) I - 3) + kappa/2 (J - 1)^2 in each tetrahedron, near rest E of the material and this nu.
std::function<std::string(const Material&)> neo_hookean_words(double poisson);

struct PushedByCalculix {
  std::vector<PushedState> states;  // of the depths that it reached; it prints seven digits
  std::string ended;                // why it did not reach the others
};
// depths: m, growing. exact: iterates until the residual is 1e-10 of the mean force, for comparisons to the printed digits. Creates
// folder, and removes it where some depth was reached.
PushedByCalculix push_by_calculix(const std::filesystem::path& folder, const ElasticBody& body, const DeepPush& push,
                                  std::span<const double> depths,
                                  const std::function<std::string(const Material&)>& words, bool exact = false);

}  // namespace palpate::accuracy
