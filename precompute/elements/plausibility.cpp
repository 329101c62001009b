#include "precompute/elements/plausibility.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

namespace palpate {
namespace {

using Eigen::Vector3d;
using Sentences = std::vector<std::string>;

// Lengths of 1e-6 to 1e6 m as a person reads them.
std::string length_text(double metres) {
  return metres < 1e-3 || metres >= 10 ? fmt::format("{:.3g} m", metres) : fmt::format("{:.4g} mm", 1e3 * metres);
}

void warn_of_size(const ElasticBody& body, const OrganConfig& organ, const BodyFiles& files, Sentences& sentences) {
  Vector3d low = Vector3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (const auto& node : body.nodes)
    low = low.cwiseMin(Vector3d(node.data())), high = high.cwiseMax(Vector3d(node.data()));
  const double longest = (high - low).maxCoeff();
  if (longest >= kSmallestOrgan && longest <= kLargestOrgan) return;
  std::string meant;
  for (const auto& [name, metres] : {std::pair{"mm", 1e-3}, {"cm", 1e-2}, {"m", 1.0}, {"um", 1e-6}}) {
    const double then = longest / organ.mesh_unit.metres * metres;
    if (meant.empty() && then >= kSmallestOrgan && then <= kLargestOrgan)
      meant = fmt::format("; with mesh_unit = \"{}\" it would be {} long", name, length_text(then));
  }
  sentences.push_back(
      fmt::format("{}: the organ is {} long, expected 1 cm to 1 m; mesh_unit is \"{}\" in {}{}; of a mesh "
                  "by palpate-surface, which is in mm, the surface's unit (--unit in SURFACE_OPTIONS of organ.mk) "
                  "or the image's voxel size is wrong instead",
                  files.mesh.string(), length_text(longest), organ.mesh_unit.name, files.organ.string(), meant));
}

std::string pressure_text(double pascal) {
  for (const auto& [unit, size] : {std::pair{"GPa", 1e9}, {"MPa", 1e6}, {"kPa", 1e3}})
    if (pascal >= size) return fmt::format("{:.4g} {}", pascal / size, unit);
  return fmt::format("{:.4g} Pa", pascal);
}

void warn_of_stiffness(const OrganConfig& organ, const BodyFiles& files, Sentences& sentences) {
  for (const OrganConfig::Region& region : organ.regions) {
    const double young = region.young.value;
    if (young >= kSoftestTissue && young <= kStiffestTissue) continue;
    std::string meant;
    for (const double factor : {1e-3, 1e3, 1e-6, 1e6})
      if (meant.empty() && young * factor >= kSoftestTissue && young * factor <= kStiffestTissue)
        meant = fmt::format("; was {} meant, in another unit?", pressure_text(young * factor));
    sentences.push_back(
        fmt::format("{}: [[region]] \"{}\": young is {}, expected 100 Pa to 10 MPa, within which soft tissue lies{}",
                    files.organ.string(), region.name, pressure_text(young), meant));
  }
}

// By any support: held along an axis, or tied by a spring.
std::vector<char> supported_nodes(const ElasticBody& body) {
  std::vector<char> supported(body.nodes.size(), 0);
  for (std::size_t n = 0; n < body.nodes.size(); ++n)
    supported[n] = body.fixed[n][0] || body.fixed[n][1] || body.fixed[n][2];
  for (const SpringSet& set : body.springs)
    for (const Spring& spring : set.springs) supported[static_cast<std::size_t>(spring.a)] = 1;
  return supported;
}

void warn_of_held_area(const ElasticBody& body, const BodyFiles& files, Sentences& sentences) {
  const std::vector<char> supported = supported_nodes(body);
  std::vector<char> on_foundation(body.triangles.size(), 0);
  for (const Foundation& foundation : body.foundations)
    for (const auto f : foundation.triangles) on_foundation[static_cast<std::size_t>(f)] = 1;
  double whole = 0, held = 0;
  for (std::size_t f = 0; f < body.triangles.size(); ++f) {
    const auto& t = body.triangles[f];
    const Vector3d a(body.nodes[t[0]].data()), b(body.nodes[t[1]].data()), c(body.nodes[t[2]].data());
    const double area = (b - a).cross(c - a).norm() / 2;
    whole += area;
    if (on_foundation[f] || (supported[t[0]] && supported[t[1]] && supported[t[2]])) held += area;
  }
  if (held >= kLeastHeldShare * whole) return;
  sentences.push_back(
      fmt::format("{}: {:.3g} % of the surface is held ({:.4g} of {:.4g} mm2), expected at least 1 %; pressed, the "
                  "organ turns about so "
                  "small a hold; hold what the body holds, and compare the places of [[fixed]] with the organ's box",
                  files.boundary.string(), 100 * held / whole, 1e6 * held, 1e6 * whole));
}

}  // namespace

Sentences plausibility_warnings(const ElasticBody& body, const OrganConfig& organ, const BodyFiles& files) {
  Sentences sentences;
  warn_of_size(body, organ, files, sentences);
  warn_of_stiffness(organ, files, sentences);
  warn_of_held_area(body, files, sentences);
  return sentences;
}

}  // namespace palpate
